"""The view command: a model or a G-code file as one HTML page."""

import webbrowser
from pathlib import Path

from machine.app.commands import GCODE_SUFFIXES, machine_known, program_of
from machine.app.compare import compared
from machine.app.output import check_writable, write_bytes
from machine.app.pipeline import model_name
from machine.app.progress import say
from machine.app.report import show
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
    count = len(program.run.program.line)
    if not count:
        raise GcodeError(f"{model} holds no move: there is nothing to show")
    known = machine_known(program, profile, given, named)
    if not known:
        say(f"{model_name(model)} does not tell its machine: shown for {profile.machine.name}, --machine names another")
    content = print_page(model_name(model), program, profile, known, compared(program, profile) if compare else ())
    write_bytes(path, content)
    thinned = f", thinned to fewer than {MOST_ROWS}" if count > MOST_ROWS else ""
    show(f"{path}: {len(content) / 1e6:.1f} MB, {count} moves{thinned}\n")
    if show_it and not webbrowser.open(path.resolve().as_uri()):
        say(f"no browser could be started: open {path} in one")
    return 0


def _beside(model: str) -> Path:
    """The page's file where none is named: here, by the model's name; refused where that is a file of another kind."""
    path = Path(Path(model_name(model).removeprefix("demo:")).stem + ".html")
    if path.is_file() and DATA not in path.read_bytes():
        raise OutputError(f"output {path} exists and is no page of tiltprint's: -o names another file")
    return path
