"""Resume: go on with a print that was cut off by a power cut, a crash or a pulled plug, as its journal tells."""

import sys
from dataclasses import replace
from math import hypot
from pathlib import Path

from machine.app.file_roles import check_roles, printing_files
from machine.app.printer.attendance import Observers
from machine.app.printer.compatibility import check_dialect
from machine.app.printer.journal_folder import continue_journal
from machine.app.printer.serial_log import new_log
from machine.app.printer.server_checks import check_no_server
from machine.app.printer.stream import PrintJob, report_end, stream_program
from machine.app.printer.watch_page import serve_watch_page
from machine.app.requests import SIMULATED, PrintRequest
from machine.app.terminal.interrupts import interrupting
from machine.app.terminal.progress import say, say_lines
from machine.dryrun.dryrun import dry_run
from machine.firmware import dialect_of
from machine.link.journal import Checkpoint, JournalContents, JournalHeading, mark_resumed, read_journal
from machine.link.pending_commands import CancelledError
from machine.link.resume import (
    PARKED,
    InterruptedPrint,
    ResumePlan,
    ResumePoint,
    heights_mm,
    plan_resume,
    position_at_interruption,
    read_interrupted_print,
)
from machine.link.status import PrinterStatus
from machine.reader.gcode_file import GcodeFile
from machine.view.program import Program
from profiles.errors import JournalError
from profiles.profile import SECTIONS, Profile, section

UNSURE_MM = 0.005


def resume(journal: Path, printing: PrintRequest, named: Profile | None = None, yes: bool = False) -> int:
    """Tell where a print goes on, ask, and print the rest; 0 when it was printed, 1 when the answer was no.

    named: the profile whose machine the user has named. yes: go on without asking. The journal of the request is a new one.
    """
    if printing.port == SIMULATED:
        raise JournalError("--port sim: a simulated printer ends with its print; the port of a printer is expected")
    check_no_server(printing.port)
    story = read_journal(journal)
    profile = _profile(journal, story.heading, named)
    check_dialect(profile.machine)
    text = _program(journal, story)
    check_roles((("the journal", journal), ("its program", text.path)), printing_files(printing))
    point = read_interrupted_print(text, story.last, profile, dialect_of(profile.machine).longest_line)
    lines = tuple(text)
    _describe(story, point, profile, len(lines))

    def begin(status: PrinterStatus) -> ResumePoint:
        way = plan_resume(point, status, profile)
        say_lines(_sentence(way, point, profile))
        if not yes and not _agreed():
            raise CancelledError
        # From here on the printer counts its lines anew: only the new journal can tell whether it has restarted.
        done = way.start.line - 1
        further.write(replace(story.last, sent=done, acknowledged=done, executed=done))
        mark_resumed(journal, story, further.path)
        return way.start

    job = PrintJob(story.heading.name, Program(lines, dry_run(lines, profile), None), profile)
    further = continue_journal(text, profile, job.name, printing.journal)
    try:
        with (
            new_log("print", f"the rest of {job.name} to {printing.port}", printing.log) as log,
            further,
            serve_watch_page(job.name, job.program, profile, printing.watch_port) as watchers,
        ):
            outcome = stream_program(job, printing, Observers(log, further, watchers.follow), begin)
            watchers.end("stopped" if outcome.cancelled else "done")
    finally:
        if further.last == Checkpoint():  # a journal that tells nothing would let the whole program begin anew
            further.path.unlink(missing_ok=True)
    if outcome.cancelled and outcome.heaters_off is None:
        say("nothing was moved or heated")
        return 1
    return report_end(outcome, journal=further)


def _profile(journal: Path, heading: JournalHeading, named: Profile | None) -> Profile:
    """The journal's own profile, homed and after a restart believed as the machine says that was named.

    Raises JournalError when that is another machine, ProfileError when the journal's profile is not valid.
    """
    sections = {name: section(name, table) for name, table in heading.profile.items() if name in SECTIONS}
    profile = Profile.model_validate(sections | {"parts": heading.profile.get("parts", [])})
    if named is None:
        return profile
    old, new = profile.machine, named.machine
    homed = {name: getattr(old, name).model_copy(update={"home_mm": getattr(new, name).home_mm}) for name in ("x", "y", "z")}
    homed |= {name: getattr(old, name).model_copy(update={"home_deg": getattr(new, name).home_deg}) for name in ("tilt", "turn")}
    machine = old.model_copy(update=homed | {"gcode": old.gcode.model_copy(update={"resume": new.gcode.resume})})
    if named.machine != machine:
        raise JournalError(
            f"journal {journal} is of a print on {profile.machine.name}; --machine gives another machine ({named.machine.name}), "
            "or one whose profile has changed since"
        )
    return profile.model_copy(update={"machine": machine})


def _program(journal: Path, story: JournalContents) -> GcodeFile:
    """The program, as it was printed. Raises JournalError."""
    if story.continued_in is not None:
        raise JournalError(f"journal {journal}: this print was resumed already, what became of it is in {story.continued_in}")
    if story.finished:
        raise JournalError(f"journal {journal}: this print ran to its end, there is nothing to resume")
    program = GcodeFile(Path(story.heading.program))
    if not program.path.is_file():
        raise JournalError(f"journal {journal}: its program {program.path} is gone")
    if program.sha256() != story.heading.sha256:
        raise JournalError(f"journal {journal} is of another program: {program.path} has changed since it was printed")
    return program


def _describe(story: JournalContents, point: InterruptedPrint, profile: Profile, lines: int) -> None:
    place, at = point.position, point.modal.at
    where = [f"part {place.part}" + (f" of {place.parts}" if place.parts else "")] if place.part is not None else []
    where += [f"layer {place.layer}"] if place.layer is not None else []
    say(f"{story.heading.name}, {', '.join([*where, f'line {point.line} of {lines}'])}")
    letters = point.modal.axes.letters
    known = [f"{letter} {value:.3f}" for letter, value in zip(letters[:5], at[:5], strict=True) if value is not None]
    say(f"surely executed: up to line {point.line - 1}" + (f", at {', '.join(known)}" if known else ""))
    if story.torn:
        say(f"the journal's end is torn: {story.torn} of its records could not be read")


def _sentence(way: ResumePlan, point: InterruptedPrint, profile: Profile) -> str:
    """What is going to be done, and what the person must make sure of."""
    reason = f"it goes on with line {way.start.line}: {way.reason}"
    if not way.homes:
        return reason
    low, high = heights_mm(point)
    (x, y, z), pose = position_at_interruption(point, profile)
    tilt, turn, machine = pose.tilt_deg, pose.turn_deg, profile.machine
    place = f"tip at X {x:.1f} Y {y:.1f} Z {z:.2f}"
    if point.checkpoint.state not in PARKED and high - low > UNSURE_MM:
        place += f" (or up to {high - low:.2f} mm higher: watch how the first lines lie)"
    if hypot(tilt, turn) > 0:
        turns = f", {int(turn // 360)} whole turns and {turn % 360:.3f}" if abs(turn) >= 360 else ""
        place += f", table at {machine.tilt.letter} {tilt:.3f} {machine.turn.letter} {turn:.3f}{turns}"
    if machine.gcode.resume:
        return f"{reason}\nit was cut off with the {place}\nthen: machine.gcode.resume homes the axes, bed and nozzle heat"
    return (
        f"{reason}\nlook first: all must stand as it was cut off, {place}\n"
        "if anything was moved since, answer no, for only X and Y will be homed, Z and the table will not\n"
        "then: bed and nozzle heat where the tip stands, the tip rises, X and Y are homed"
    )


def _agreed() -> bool:
    """Ask; raises JournalError where nobody can answer."""
    if not sys.stdin.isatty():
        raise JournalError("whether to go on is asked first: give --yes where there is no terminal to ask at")
    sys.stderr.write("go on? [y/N] ")
    sys.stderr.flush()
    with interrupting():
        return sys.stdin.readline().strip().lower() in ("y", "yes")
