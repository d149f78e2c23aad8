"""The examples of README and docs run: all commands of a page, in order, in one folder, on small prints and at stand-ins."""

import argparse
import io
import re
import runpy
import shlex
import signal
import subprocess
import sys
import webbrowser
from contextlib import ExitStack
from pathlib import Path

import pytest
import typer

from machine.cli.cli import app, main
from mdp.save import stl
from profiles.folders import settings_folder
from profiles.places import own_folder
from tests import stand_ins
from tests.shapes import tee

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
# Commands that install something or need a scheduler: neither run nor checked, with the README's own test command.
NEITHER = ("python3 -m venv ", "pip install ", "dask ")
# Checked for valid options only: they need a scheduler, or run for an hour or more.
ONLY_PARSED = ("tiltprint batch /farm", "python -m mdp.learning.", "python tools/campaigns/")
ONLY_PARSED += ("python tools/bench/benchmark.py",)
UNTIL_CTRL_C = ("edit", "simulator")  # run in a process of their own
PATIENCE_S = 60.0
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


def shell_lines(page: Path) -> list[str]:
    """The lines of a page's shell blocks."""
    blocks = re.findall(r"^```sh\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]


def commands(page: Path) -> list[str]:
    """The commands of a page, without the environment's path, except those that install something."""
    return [line.removeprefix(".venv/bin/") for line in shell_lines(page) if not line.startswith(NEITHER)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the files that the pages assume."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    stand_ins.set_up(monkeypatch, tmp_path)
    own = settings_folder() / "profiles" / "processes"
    own.mkdir(parents=True)
    (own / "standard.toml").write_text(QUICK)
    for kind, name in (("process", "standard"), ("material", "pla")):  # MINE is what `profiles import` calls its result
        file = own_folder(kind) / "MINE.toml"
        file.parent.mkdir(exist_ok=True)
        file.write_text(f'inherits = "{name}"\n\n[{kind}]\nname = "mine"\n')
    (tmp_path / "models").mkdir()
    for name in ("model.stl", "models/tee.stl"):
        (tmp_path / name).write_bytes(stl(tee()))
    (tmp_path / "plan.toml").write_text('version = 1\nmodel = "model.stl"\n')
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


def options_are_valid(words: list[str], monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether a script of ours accepts these words: it ends as soon as it has read them."""

    class ReadError(Exception):
        pass

    def read(parser: argparse.ArgumentParser, *_: object, **__: object) -> None:
        parse_known_args(parser)
        raise ReadError

    parse_known_args = argparse.ArgumentParser.parse_known_args
    with monkeypatch.context() as patched:
        patched.setattr(argparse.ArgumentParser, "parse_args", read)
        with pytest.raises(ReadError):
            run_script(words, patched)
    return True


def run_script(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Run `-m MODULE ...` or `FILE ...` in this process, as from the folder of README.md."""
    monkeypatch.setattr(sys, "argv", words[1:] if words[0] == "-m" else words)
    if words[0] == "-m":
        runpy.run_module(words[1], run_name="__main__", alter_sys=True)
    else:
        runpy.run_path(str(ROOT / words[0]), run_name="__main__")


def until_ctrl_c(words: list[str]) -> tuple[str, int]:
    """The first line of a command in a process of its own, and its exit code after Ctrl-C."""
    command = [sys.executable, "-m", "machine.cli.cli", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        try:
            line = process.stdout.readline()
            process.send_signal(signal.SIGINT)
            return line, process.wait(PATIENCE_S)
        finally:
            process.kill()


def run(line: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """The exit code of an example."""
    words = shlex.split(line, comments=True)[1:]
    if "--measured" in words:
        stand_ins.fill_in(Path(words[words.index("--measured") + 1]))
    if words[0] == "calibrate":  # two ways to measure one machine: the second would not replace the first one's profile
        for file in own_folder("machine").glob("*.toml"):
            file.unlink()
    if words[0] in UNTIL_CTRL_C:
        shown, code = until_ctrl_c(words)
        assert shown.startswith(("http://127.0.0.1:", "https://127.0.0.1:", "/dev/"))
        return code
    if not line.startswith("tiltprint "):
        run_script(words, monkeypatch)
        return 0
    typed = {"console": io.StringIO("M115\n"), "resume": stand_ins.Terminal("y\n")}
    monkeypatch.setattr(sys, "stdin", typed.get(words[0], io.StringIO()))
    return main(words)


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.stem)
def test_the_examples_of_a_page_run(
    page: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(webbrowser, "open", lambda address: True)
    if page.stem == "calibration":  # its piece has a plan for its own size and usual seams
        (own_folder("process") / "standard.toml").write_text(QUICK.replace("scale = 0.25\n", "").partition("[search]")[0])
    if page.stem == "network":
        assert main(["export", "model.stl", "-o", "model.gcode"]) == 0
    for line in commands(page):
        words = shlex.split(line, comments=True)
        if line.startswith(ONLY_PARSED):
            assert parsed(words[1:]) if words[0] == "tiltprint" else options_are_valid(words[1:], monkeypatch), line
            continue
        kept = Path("my.toml").read_bytes()
        if line.startswith("tiltprint profiles detect"):  # one example for each firmware, all into one file
            Path("my.toml").unlink()
        with ExitStack() as until_end, monkeypatch.context() as patched:
            code = run(stand_ins.at_stand_ins(line, patched, until_end), patched)
        if stand_ins.SERVER.search(line):  # the examples that follow are for a serial port
            Path("my.toml").write_bytes(kept)
        assert code == 0, f"{line}\n{capsys.readouterr().err}"


@pytest.mark.parametrize("exception", [*NEITHER, *ONLY_PARSED])
def test_an_exception_stands_for_an_example(exception: str) -> None:
    assert any(line.startswith(exception) for page in PAGES for line in shell_lines(page))
