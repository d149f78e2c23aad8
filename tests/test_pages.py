"""The examples of README and docs run: all commands of a page, in order, in one folder, on small prints."""

import re
import shlex
from pathlib import Path

import pytest
import typer

from machine.cli.cli import app, main
from mdp.save import stl
from profiles.folders import settings_folder
from tests.shapes import tee

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
# Only parsed: commands that need a user, a device, a server or a browser, and the piece whose plan fits no other size.
ONLY_PARSED = (
    "tiltprint edit",
    "tiltprint simulator",
    "tiltprint console",
    "tiltprint send",
    "tiltprint follow",
    "tiltprint ports",
)
PARSED_WITH = (
    "/dev/",
    "moonraker:",
    "duet:",
    "octoprint:",
    "--scheduler",
    "--watch",
    "--open",
    "MINE",
    "JOURNAL",
    "jog by keys",
    "--measured",
    "piece.gcode",
    "--plate",
)
# A process profile in the user's folder makes every print small and quick.
QUICK = """inherits = "standard"

[process]
layer_height_mm = 0.3
first_layer_height_mm = 0.3
scale = 0.25
walls = 1
infill_density = 0.05

[search]
directions = 40
beam_width = 1
seam_mm = 0.0
cut_mm2 = 0.0
"""


def commands(page: Path) -> list[str]:
    """The lines of a page's shell blocks that begin with tiltprint."""
    blocks = re.findall(r"^```sh\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    return [line.removeprefix(".venv/bin/") for line in lines if line.removeprefix(".venv/bin/").startswith("tiltprint ")]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the files that the pages assume."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    own = settings_folder() / "profiles" / "processes"
    own.mkdir(parents=True)
    (own / "standard.toml").write_text(QUICK)
    (tmp_path / "models").mkdir()
    for name in ("model.stl", "models/tee.stl"):
        (tmp_path / name).write_bytes(stl(tee()))
    (tmp_path / "my.toml").write_text('inherits = "generic_ac"\n\n[machine]\nlift_mm = 12.0\n')
    (tmp_path / "config.ini").write_text("; PrusaSlicer\nlayer_height = 0.2\nperimeters = 2\nnozzle_diameter = 0.4\n")
    (tmp_path / "faults.toml").write_text("seed = 7\n")
    (tmp_path / "marks.toml").write_text("version = 1\n")
    return tmp_path


def parsed(words: list[str]) -> bool:
    """Whether the command line accepts these words, without running their command."""
    group = typer.main.get_command(app)
    with group.make_context("tiltprint", [words[0], "--help"], resilient_parsing=True) as context:
        name, command, rest = group.resolve_command(context, words)
        while hasattr(command, "resolve_command"):
            with command.make_context(name, [*rest], resilient_parsing=True) as context:
                name, command, rest = command.resolve_command(context, rest)
        command.make_context(name, rest)
    return True


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.stem)
def test_the_examples_of_a_page_run(page: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for line in commands(page):
        words = shlex.split(line, comments=True)[1:]
        if line.startswith(ONLY_PARSED) or any(word in line for word in PARSED_WITH):
            assert parsed(words), line
        else:
            assert main(words) == 0, f"{line}\n{capsys.readouterr().err}"
