"""Programs: made from a model by cutting, slicing and planning, or read from a G-code file; dry-run in both cases."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from machine.dryrun.dryrun import dry_run
from machine.dryrun.findings import Finding
from machine.gcode.lines import GcodeFile, Lines
from machine.notices import say
from machine.pipeline import compilers
from machine.pipeline.embedded_profile import in_words, read_embedded_profile
from machine.pipeline.requests import FORCE_GOES_ON, ModelRequest
from machine.program import Program
from profiles.errors import GcodeError, MoveError, PlanError
from profiles.messages import option, phrase
from profiles.profile import Profile


@dataclass(frozen=True, eq=False)
class LoadedProgram:
    """A program and the profile of its dry run, which a G-code file may contain. name: of the printed object.

    source: the G-code file that holds it; None: it is saved beside the journal. machine_known: the file or the user names the
    machine, it is not assumed.
    """

    name: str
    program: Program
    profile: Profile
    source: Path | None = None
    machine_known: bool = True


def load_program(request: ModelRequest, pictures: bool = False) -> LoadedProgram:
    """The program of a model or of a G-code file. pictures: a model's program gets thumbnails because it becomes a file.

    Raises GcodeError for a file that cannot be read.
    """
    compilers.return_large_arrays()
    if not request.is_gcode:
        from machine.pipeline.pipeline import build, decompose_model  # a G-code file needs no search and no slicer

        decomposed = decompose_model(request, to_build=True)
        program = build(decomposed.decomposition, decomposed.profile, pictures=pictures, stops=request.stops)
        return LoadedProgram(request.name, program, decomposed.profile)
    _refuse_cuts(request)
    source = Path(request.model)
    lines = read_gcode_lines(source)
    profile, sections = read_embedded_profile(lines, request.profile, request.chosen_sections)
    if sections:
        say(f"{request.name}: {in_words(sections, profile)}, as the file itself says")
    compilers.wait_for(compilers.DRY_RUN)
    known = "machine" in request.chosen_sections or profile.machine is not request.profile.machine
    return LoadedProgram(request.name, Program(lines, dry_run(lines, profile), None), profile, source, known)


def _refuse_cuts(request: ModelRequest) -> None:
    """Raise PlanError for options that would cut, slice or place a G-code file."""
    if request.beside:
        raise PlanError(f"{request.model} is G-code, which is a plate of its own: {request.beside[0]} cannot go beside it")
    cut, sliced = "is cut already", "is sliced already"
    given: list[tuple[str, object, str]] = [
        ("plan", request.plan, cut),
        ("parts", request.parts, cut),
        ("copies", request.copies if request.copies != 1 else None, sliced),
        *((stop.option, stop.at, "says itself where it stops") for stop in request.stops),
        *(("part", settings.part, sliced) for settings in request.profile.parts),
    ]
    for name, value, why in given:
        if value is not None:
            raise PlanError(f"{option(name, value)}: {request.model} is G-code, which {why}; it goes with a model")


def read_gcode_lines(path: Path) -> Lines:
    """The lines of a G-code file. Raises GcodeError when it is unreadable, not text, or empty."""
    lines = GcodeFile(path).lines()
    if not any(line.strip() for line in lines):
        raise GcodeError(f"G-code file {path} is empty")
    return lines


def refuse_errors(errors: Sequence[Finding], force: bool) -> None:
    """Raise MoveError for a program whose dry run found errors; force: only report them."""
    if not errors:
        return
    count = count_of_errors(errors)
    if force:
        say(count, forced=True)
        return
    raise MoveError(
        f"{count}, the first: {errors[0].message} ({phrase('', 'simulate lists all, ')}{FORCE_GOES_ON})", forcible=True
    )


def count_of_errors(errors: Sequence[Finding]) -> str:
    """Number of errors of a dry run, as a sentence; "" for none."""
    return f"the dry run found {len(errors)} error{'s' * (len(errors) > 1)}" if errors else ""
