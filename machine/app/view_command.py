"""The view command: a model or a G-code file as one HTML page."""

import webbrowser
from pathlib import Path

from machine.app.commands import GCODE_SUFFIXES, machine_known, program_of
from machine.app.compare import compared
from machine.app.output import check_writable, write_bytes
from machine.app.pipeline import Program, model_name
from machine.app.progress import say
from machine.app.report import show
from machine.app.view.findings import judged
from machine.app.view.page import DATA, print_page
from machine.app.view.thinning import MOST_ROWS
from profiles.errors import GcodeError, OutputError, ProfileError
from profiles.profile import Profile


def view(
    model: str, profile: Profile, ranker: str, orient: bool, out: Path | None, show_it: bool, compare: bool, named: frozenset[str]
) -> int:
    """Write the page, and show it in the browser where asked; what the dry run finds is shown in it and stops nothing."""
    path = _beside(model) if out is None else out
    check_writable(path)
    if compare and Path(model).suffix.lower() in GCODE_SUFFIXES:
        raise ProfileError(f"--compare goes with a model: {model} is G-code, which prints in one way only")
    given = profile
    program, profile = program_of(model, profile, ranker, orient, named)
    if not len(program.run.program.line):
        raise GcodeError(f"{model} holds no move: there is nothing to show")
    known = machine_known(program, profile, given, named)
    if not known:
        say(f"{model_name(model)} does not tell its machine: shown for {profile.machine.name}, --machine names another")
    content = print_page(model_name(model), program, profile, known, compared(program, profile) if compare else ())
    write_bytes(path, content)
    show(f"{path}: {len(content) / 1e6:.1f} MB, {_in_words(program, known)}\n")
    if show_it and not webbrowser.open(path.resolve().as_uri()):
        say(f"no browser could be started: open {path} in one")
    return 0


def _in_words(program: Program, known: bool) -> str:
    """What the page holds: moves, errors, warnings."""
    count, found = len(program.run.program.line), judged(program.run, known)
    told = [f"{count} moves" if count > 1 else "1 move", *([f"thinned to {MOST_ROWS} or fewer"] if count > MOST_ROWS else [])]
    for severity in ("error", "warning"):
        number = sum(finding.severity == severity for finding in found)
        told += [f"{number} {severity}{'s' * (number > 1)}"] if number else []
    return ", ".join(told)


def _beside(model: str) -> Path:
    """The page's file where none is named: here, by the model's name; refused where that is a file of another kind."""
    path = Path(Path(model_name(model).removeprefix("demo:")).stem + ".html")
    if path.is_file() and DATA not in path.read_bytes():
        raise OutputError(f"output {path} exists and is no page of tiltprint's: -o names another file")
    return path
