"""A command never overwrites a file that it reads, and never writes one file twice."""

from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.pipeline.output import check_roles
from machine.printing.journal_folder import new_journal
from mdp.save import stl
from profiles.errors import OutputError
from profiles.profile import load
from tests import shapes

GCODE = "G28\nG1 X5 F600\n"
READ = "is the same file as the model, which is read: another name is expected"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.stl").write_bytes(stl(shapes.box()))
    (tmp_path / "t.gcode").write_text(GCODE)
    (tmp_path / "own.toml").write_text('inherits = "pla"\n[material]\n')
    (tmp_path / "link.stl").symlink_to("m.stl")
    (tmp_path / "hard.stl").hardlink_to(tmp_path / "m.stl")
    (tmp_path / "part-02.stl").write_bytes(stl(shapes.box()))
    return tmp_path


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("export m.stl -o m.stl", f"output m.stl {READ}"),
        ("export m.stl -o link.stl", f"output link.stl {READ}"),
        ("export link.stl -o hard.stl", f"output hard.stl {READ}"),
        ("export m.stl -o x.gcode --json ./x.gcode", "--json x.gcode is the same file as output, which is written too"),
        ("export m.stl -o own.toml --material own.toml", "output own.toml is the same file as --material, which is read"),
        ("decompose m.stl --png m.stl", f"--png m.stl {READ}"),
        ("decompose part-02.stl -o .", "output folder . gets a file part-02.stl, but that is the model, which is read"),
        ("view m.stl -o m.stl", f"page m.stl {READ}"),
        ("view t.gcode -o t.gcode", f"page t.gcode {READ}"),
        ("simulate t.gcode --json t.gcode", f"--json t.gcode {READ}"),
        ("simulate t.gcode --model m.stl --html m.stl", "page m.stl is the same file as --model, which is read"),
        ("print t.gcode --port sim --log t.gcode", f"--log t.gcode {READ}"),
        ("print t.gcode --port sim --journal t.gcode", f"--journal t.gcode {READ}"),
        ("print m.stl --port sim --journal j --log j.gcode", "the program beside --journal j.gcode is the same file as --log"),
        ("print m.stl --port sim --journal t", "journal t: t.gcode exists already"),
    ],
)
def test_a_file_with_two_roles_is_refused_and_stays(
    folder: Path, capsys: pytest.CaptureFixture[str], words: str, sentence: str
) -> None:
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    assert main(words.split()) == 1
    assert sentence in " ".join(capsys.readouterr().err.split())
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


def test_a_device_may_be_written_by_several() -> None:
    check_roles((), (("--png", Path("/dev/null")), ("--json", Path("/dev/null"))))


def test_a_second_print_leaves_the_program_of_the_first(tmp_path: Path) -> None:
    with new_journal(["G28", "G1 X5"], load(), "first", None, tmp_path / "j"):
        pass
    with pytest.raises(OutputError, match="exists already"):
        new_journal(["G28", "G1 X99"], load(), "second", None, tmp_path / "j")
    assert (tmp_path / "j.gcode").read_text() == "G28\nG1 X5\n"


def test_parts_of_an_earlier_run_go_and_files_of_others_stay(folder: Path) -> None:
    (folder / "d").mkdir()
    for name, content in (("part-07.stl", stl(shapes.box())), ("part-08.stl", b"solid mine"), ("notes.txt", b"mine")):
        (folder / "d" / name).write_bytes(content)
    assert main(["decompose", "m.stl", "-o", "d"]) == 0
    assert sorted(file.name for file in (folder / "d").glob("part*")) == ["part-01.stl", "part-08.stl"]
    assert (folder / "d" / "notes.txt").read_bytes() == b"mine"
