"""The view command: writes an HTML page of a model or a G-code file."""

import webbrowser
from pathlib import Path

from machine.notices import plain_line, say, show
from machine.pipeline.comparison import compare_with_one_part
from machine.pipeline.output import check_model_files, check_writable, write_bytes
from machine.pipeline.programs import load_program
from machine.pipeline.requests import ModelRequest
from machine.program import Program
from machine.quantities import amount
from machine.view.page import DATA, print_page
from machine.view.paths import MOST_ROWS
from machine.view.scene import relevant_findings
from profiles.errors import GcodeError, OutputError, ProfileError


def view(request: ModelRequest, open_browser: bool = False) -> int:
    """Write the page, and open the browser if requested; findings of the dry run are shown in it and do not stop the command."""
    path = request.outputs.html or _default_page(request.project.name if request.project else request.name)
    check_writable(path)
    check_model_files(request, () if request.outputs.html else (("page", path),))
    if request.compare and request.is_gcode:
        raise ProfileError(f"--compare goes with a model: {request.model} is G-code, which prints in one way only")
    loaded = load_program(request)
    program, profile, known = loaded.program, loaded.profile, loaded.machine_known
    if not len(program.run.program.line):
        raise GcodeError(f"{request.model} contains no move: there is nothing to show")
    if not known:
        say(f"{request.name} does not name its machine: shown for {profile.machine.name}, --machine names another")
    alternatives = compare_with_one_part(program, profile) if request.compare else ()
    content = print_page(request.name, program, profile, known=known, alternatives=alternatives)
    write_bytes(path, content)
    show(plain_line(f"wrote {path}: {amount(len(content) / 1e6, 1)} MB, {_in_words(program, known)}") + "\n")
    if open_browser and not webbrowser.open(path.resolve().as_uri()):
        say(f"no browser could be started: open {path} in one")
    return 0


def _in_words(program: Program, known: bool) -> str:
    """Phrase that counts moves, errors and warnings."""
    count, findings = len(program.run.program.line), relevant_findings(program.run, known)
    phrases = [f"{count} moves" if count > 1 else "1 move", *([f"thinned to {MOST_ROWS} or fewer"] if count > MOST_ROWS else [])]
    for severity in ("error", "warning"):
        number = sum(finding.severity == severity for finding in findings)
        phrases += [f"{number} {severity}{'s' * (number > 1)}"] if number else []
    return ", ".join(phrases)


def _default_page(name: str) -> Path:
    """Default file of the page, named after the model. Raises OutputError if another kind of file has that name."""
    path = Path(Path(name.removeprefix("demo:")).stem + ".html")
    if path.is_file() and DATA not in path.read_bytes():
        raise OutputError(f"output {path} exists and is not a page of tiltprint: name another file with -o")
    return path
