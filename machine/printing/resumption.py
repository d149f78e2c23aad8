"""Resumption: reads an interrupted print from its journal, and prints the rest once printer and user agree.

The user is asked only after the printer has reported its position; until then nothing moves or heats.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import hypot
from os.path import isfile
from pathlib import Path

from machine.dryrun.dryrun import dry_run
from machine.firmware import dialect_of
from machine.gcode.lines import GcodeFile
from machine.link.journal import (
    Checkpoint,
    Journal,
    JournalContents,
    JournalHeading,
    is_being_printed,
    mark_resumed,
    read_journal,
)
from machine.link.pending_commands import CancelledError
from machine.link.resume import (
    PARKED,
    InterruptedPrint,
    ResumePoint,
    heights_mm,
    is_in_doubt,
    plan_resume,
    position_at_interruption,
    read_interrupted_print,
)
from machine.link.status import PrinterStatus
from machine.notices import say
from machine.pipeline.output import check_roles, printing_files
from machine.pipeline.programs import LoadedProgram
from machine.printing.checks import check_dialect
from machine.printing.destination import SerialPort, Simulated, at_printer
from machine.printing.history import Reach, recorded
from machine.printing.job import NOT_MOVED, End, Person, PrintJob, Scene
from machine.printing.journal_folder import continue_journal
from machine.printing.serial_log import new_log
from machine.printing.serial_print import report_end, stream_program
from machine.program import Program
from profiles.errors import JournalError, ProfileError
from profiles.messages import key_name, phrase
from profiles.profile import Profile, profile_of_tables

HEIGHT_QUESTION = (  # otherwise the rest would be printed too high or too low
    "the tip was cut off between two heights: it stands at {heights}; look at the print below it, for Z is not homed"
)
RESTARTED = (
    "this computer may have restarted since the print began, so the newest records may be missing: check that the print is no "
    "higher than this, and that tip and table stand as stated, before you continue"
)


@dataclass(frozen=True, eq=False)
class Resumption:
    """A print that can be resumed, from its journal and its program. journal: its file; at: the port of its printer."""

    at: SerialPort
    journal: Path
    story: JournalContents
    profile: Profile
    text: GcodeFile
    point: InterruptedPrint
    lines: Sequence[str]

    @property
    def name(self) -> str:
        """The name of the print."""
        return self.story.heading.name

    def sentences(self) -> tuple[str, ...]:
        """Where it was interrupted, as sentences for the user."""
        position, at = self.point.position, self.point.modal.at
        of_parts = f" of {position.parts}" if position.parts else ""
        where = [f"part {position.part}{of_parts}"] if position.part is not None else []
        where += [f"layer {position.layer}"] if position.layer is not None else []
        letters = self.point.modal.axes.letters
        known = [f"{letter} {value:.3f}" for letter, value in zip(letters[:5], at[:5], strict=True) if value is not None]
        torn, offset_mm = self.story.torn, self.story.last.z_offset_mm
        return (
            f"{self.name}, {', '.join([*where, f'line {self.point.line} of {len(self.lines)}'])}",
            f"surely executed: up to line {self.point.line - 1}" + (f", at {', '.join(known)}" if known else ""),
            *([f"the tip was shifted by a Z offset of {offset_mm:+g} mm"] if offset_mm else []),
            *([f"{torn} of the journal's records could not be read: a power cut has torn them"] if torn else []),
            *([] if self.story.computer_ran_on else [RESTARTED]),
        )


def read_resumption(job: PrintJob) -> Resumption:
    """Read the journal of a job, whose profile is the one named by the user.

    Raises JournalError and other UserErrors for a print that cannot be resumed at this printer.
    """
    journal, at = job.cut_off, at_printer(job.destination)
    assert journal is not None
    if isinstance(at, Simulated):
        raise JournalError(
            f"{phrase('', '--port sim: ')}a simulated printer ends with its print; the port of a printer is expected"
        )
    if is_being_printed(journal):  # checked first: the files read below no longer change
        raise JournalError(
            f"journal {journal}: its print runs now, in another terminal or page: it can be resumed when it has ended"
        )
    story = read_journal(journal)
    profile = _profile(journal, story.heading, job.profile)
    check_dialect(profile.machine)
    text = _program(journal, story)
    check_roles((("the journal", journal), ("its program", text.path)), printing_files(job.log, job.journal))
    point = read_interrupted_print(text, story.last, profile, dialect_of(profile.machine).longest_line)
    return Resumption(at, journal, story, profile, text, point, tuple(text))


def rest_of(cut_off: Resumption) -> LoadedProgram:
    """The dry-run program whose rest is printed."""
    return LoadedProgram(cut_off.name, Program(cut_off.lines, dry_run(cut_off.lines, cut_off.profile), None), cut_off.profile)


def print_rest(cut_off: Resumption, rest: LoadedProgram, job: PrintJob, person: Person) -> End:
    """Query the printer's position, ask the user whether to continue, and print the rest with a new journal.

    If several heights of the tip are possible, the user chooses it. Raises PrinterError, and JournalError when no user can
    answer.
    """
    return recorded(rest, cut_off.at.name, lambda reach: _print_rest(cut_off, rest, job, person, reach))


def _print_rest(cut_off: Resumption, rest: LoadedProgram, job: PrintJob, person: Person, reach: Reach) -> End:
    with _further_journal(cut_off, job) as further:

        def begin(status: PrinterStatus) -> ResumePoint:
            way = plan_resume(cut_off.point, status, cut_off.profile)
            point = cut_off.point
            if is_in_doubt(way, point, cut_off.profile):
                heights = heights_mm(point)
                choices = tuple(f"Z {z:.2f}" for z in heights)
                chosen = person.ask(HEIGHT_QUESTION.format(heights=" or ".join(choices)), choices)
                if chosen is None:
                    raise CancelledError
                point = replace(point, stood_mm=heights[chosen])
                way = plan_resume(point, status, cut_off.profile)
            shifts_z = way.shifts_z and status.capabilities.get("BABYSTEPPING", True)
            way.check_offset(dialect_of(cut_off.profile.machine).babystep if shifts_z else "")
            if person.ask(_question(way, point, cut_off.profile)) is None:
                raise CancelledError
            _hand_over(cut_off, further, way.line - 1)
            return way

        title = f"the rest of {rest.name} to {cut_off.at.name}"
        with new_log("print", title, job.log) as log:
            outcome = stream_program(rest, cut_off.at, Scene(title, log, further), person, reach, begin=begin)
        if outcome.cancelled and outcome.heaters_off is None:
            say(NOT_MOVED.sentence)
            return NOT_MOVED
        return report_end(outcome, journal=further)


@contextmanager
def _further_journal(cut_off: Resumption, job: PrintJob) -> Iterator[Journal]:
    """The journal of the rest; removed without a record because it would restart the whole program."""
    with continue_journal(cut_off.text, cut_off.profile, cut_off.name, job.journal) as further:
        try:
            yield further
        finally:
            if further.last == Checkpoint():
                further.abandon()


def _hand_over(cut_off: Resumption, further: Journal, done: int) -> None:
    """Before the rest begins: write the new journal to disk, then mark the old one as resumed.

    The printer then restarts its line numbers, so that only the new journal can show a restart of the printer. done: lines of the
    program that are not repeated. Raises JournalError when one of them cannot be written; then nothing has moved, and only the
    old one can be resumed.
    """
    further.write(replace(cut_off.story.last, sent=done, acknowledged=done, executed=done))
    try:
        if trouble := further.settle():
            raise JournalError(f"{trouble}; nothing was moved or heated")
        mark_resumed(cut_off.journal, cut_off.story, further.path)
    except JournalError:
        further.abandon()
        raise


def _profile(journal: Path, heading: JournalHeading, named: Profile | None) -> Profile:
    """The journal's profile, with the home positions and the resume block of the machine named by the user.

    Raises JournalError for a different machine, or for an invalid profile in the journal.
    """
    try:
        profile = profile_of_tables(heading.profile)
    except ProfileError as error:
        raise JournalError(f"journal {journal} holds a profile that is not valid: {error}") from None
    if named is None:
        return profile
    old, new = profile.machine, named.machine
    homed = {name: getattr(old, name).model_copy(update={"home_mm": getattr(new, name).home_mm}) for name in ("x", "y", "z")}
    homed |= {name: getattr(old, name).model_copy(update={"home_deg": getattr(new, name).home_deg}) for name in ("tilt", "turn")}
    machine = old.model_copy(update=homed | {"gcode": old.gcode.model_copy(update={"resume": new.gcode.resume})})
    if named.machine != machine:
        raise JournalError(
            f"journal {journal} is of a print on {profile.machine.name}; "
            f"{phrase('homed as in names', '--machine gives')} another machine ({named.machine.name}), "
            "or one whose profile has changed since"
        )
    return profile.model_copy(update={"machine": machine})


def _program(journal: Path, story: JournalContents) -> GcodeFile:
    """The program, as it was printed. Raises JournalError."""
    if story.last.continued_in is not None:
        raise JournalError(f"journal {journal}: this print was resumed already, its rest is in {story.last.continued_in}")
    if story.finished:
        raise JournalError(f"journal {journal}: this print ran to its end, there is nothing to resume")
    program = GcodeFile(Path(story.heading.program))
    if not isfile(program.path):
        raise JournalError(f"journal {journal}: its program {program.path} is gone")
    if program.sha256() != story.heading.sha256:
        raise JournalError(f"journal {journal} is of another program: {program.path} has changed since it was printed")
    return program


def _question(way: ResumePoint, point: InterruptedPrint, profile: Profile) -> str:
    """The question with the next steps, and what the user must make sure of."""
    reason = f"it continues with line {way.line}: {way.reason}"
    if not way.homes:
        return reason
    (x, y, z), pose = position_at_interruption(point, profile)
    tilt, turn, machine = pose.tilt_deg, pose.turn_deg, profile.machine
    tip = f"tip at X {x:.1f} Y {y:.1f} Z {z:.2f}"
    heights = heights_mm(point)
    if point.checkpoint.state not in PARKED and len(heights) > 1:
        tip += f" (or up to {heights[-1] - heights[0]:.2f} mm higher)"
    if hypot(tilt, turn) > 0:
        turns = f", {int(turn // 360)} whole turns and {turn % 360:.3f}" if abs(turn) >= 360 else ""
        tip += f", table at {machine.tilt.letter} {tilt:.3f} {machine.turn.letter} {turn:.3f}{turns}"
    if machine.gcode.resume:
        return (
            f"{reason}\nit was cut off with the {tip}\nthen: {key_name('machine.gcode.resume')} homes the axes, bed "
            "and nozzle heat"
        )
    return (
        f"{reason}\nlook first: all must stand as it was cut off, {tip}\n"
        "if anything was moved since, answer no, for only X and Y will be homed, Z and the table will not\n"
        "then: bed and nozzle heat where the tip stands, the tip rises, X and Y are homed"
    )
