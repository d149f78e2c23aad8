"""Resume: go on with a print that was cut off by a power cut, a crash or a pulled plug, as its journal tells."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import hypot
from pathlib import Path

from machine.app.interrupts import interrupting
from machine.app.journals import continued
from machine.app.pipeline import Program
from machine.app.printing import SIMULATED, Follow, check_dialect, ended, streamed
from machine.app.progress import say
from machine.app.traffic import TrafficLog, new_log
from machine.app.view.live import served
from machine.app.view.page import print_page
from machine.dialects import DIALECTS
from machine.dryrun.dryrun import dry_run
from machine.link.inquiry import Found
from machine.link.job import Begin
from machine.link.journal import Heading, Moment, Story, mark_resumed, read_journal
from machine.link.program import GcodeFile
from machine.link.resume import AWAY, Point, Way, heights_mm, point_of, stood, way_on
from machine.link.wishes import CancelledError
from profiles.errors import JournalError
from profiles.profile import Profile, section

UNSURE_MM = 0.005


def resume(
    journal: Path,
    port: str,
    baud: int,
    yes: bool,
    given: Profile | None = None,
    file: Path | None = None,
    log: Path | None = None,
    watch_port: int | None = None,
) -> int:
    """Tell where a print goes on, ask, and print the rest; 0 when it was printed, 1 when the answer was no.

    given: the profile whose machine the user has named; file: of the new journal; log: of the traffic. watch_port: serve the
    print's page on this port of this computer, 0: on any free one; None: serve nothing.
    """
    if port == SIMULATED:
        raise JournalError("--port sim: a simulated printer ends with its print; the port of a printer is expected")
    story = read_journal(journal)
    profile = _profile(journal, story.heading, given)
    check_dialect(profile.machine)
    text = _program(journal, story)
    point = point_of(text, story.last, profile, DIALECTS[profile.machine.dialect].longest_line)
    lines = tuple(text)
    _tell(story, point, profile, len(lines))

    def begin(found: Found) -> Begin:
        way = way_on(point, found, profile)
        say(_sentence(way, point, profile))
        if not yes and not _agreed():
            raise CancelledError
        # From here on the printer counts its lines anew: only the new journal can tell whether it has restarted.
        done = way.begin.line - 1
        further.mark(replace(story.last, sent=done, acknowledged=done, executed=done))
        mark_resumed(journal, story, further.path)
        return way.begin

    title = f"the rest of {story.heading.name} to {port}"
    program = Program(lines, dry_run(lines, profile), None)
    further = continued(text, profile, story.heading.name, file)
    try:
        with (
            new_log("print", title) if log is None else TrafficLog(log, title) as kept,
            further,
            _followed(story.heading.name, program, profile, watch_port) as (follow, end),
        ):
            outcome = streamed(program, profile, port, baud, title, kept, follow, further, begin)
            end("stopped" if outcome.cancelled else "done")
    finally:
        if further.last == Moment():  # a journal that tells nothing would let the whole program begin anew
            further.path.unlink(missing_ok=True)
    if outcome.cancelled and outcome.heaters_off is None:
        say("nothing was moved or heated")
        return 1
    return ended(outcome, journal=further)


@contextmanager
def _followed(
    name: str, program: Program, profile: Profile, watch_port: int | None
) -> Iterator[tuple[Follow | None, Callable[[str], None]]]:
    """What tells the page of a print its progress, and its end; nothing where no page is wanted."""
    if watch_port is None:
        yield None, lambda state: None
        return
    with served(print_page(name, program, profile, live=True), watch_port) as watched:
        say(f"watch the print at {watched.address}")
        yield watched.follow, watched.end


def _profile(journal: Path, heading: Heading, given: Profile | None) -> Profile:
    """The journal's own profile, homed as the machine says that was named.

    Raises JournalError when that is another machine, ProfileError when the journal's profile is not valid.
    """
    profile = Profile.model_validate({name: section(name, table) for name, table in heading.profile.items()})
    if given is None:
        return profile
    gcode = profile.machine.gcode.model_copy(update={"resume": given.machine.gcode.resume})
    machine = profile.machine.model_copy(update={"gcode": gcode})
    if given.machine != machine:
        raise JournalError(
            f"journal {journal} is of a print on {profile.machine.name}; --machine gives another machine ({given.machine.name}), "
            "or one whose profile has changed since"
        )
    return profile.model_copy(update={"machine": machine})


def _program(journal: Path, story: Story) -> GcodeFile:
    """The program, as it was printed. Raises JournalError."""
    if story.rest is not None:
        raise JournalError(f"journal {journal}: this print was resumed already, what became of it is in {story.rest}")
    if story.finished:
        raise JournalError(f"journal {journal}: this print ran to its end, there is nothing to resume")
    program = GcodeFile(Path(story.heading.program))
    if not program.path.is_file():
        raise JournalError(f"journal {journal}: its program {program.path} is gone")
    if program.sha256() != story.heading.sha256:
        raise JournalError(f"journal {journal} is of another program: {program.path} has changed since it was printed")
    return program


def _tell(story: Story, point: Point, profile: Profile, lines: int) -> None:
    place, at = point.place, point.modal.at
    where = [f"part {place.part}" + (f" of {place.parts}" if place.parts else "")] if place.part is not None else []
    where += [f"layer {place.layer}"] if place.layer is not None else []
    say(f"{story.heading.name}, {', '.join([*where, f'line {point.line} of {lines}'])}")
    letters = point.modal.axes.letters
    known = [f"{letter} {value:.3f}" for letter, value in zip(letters[:5], at[:5], strict=True) if value is not None]
    say(f"surely executed: up to line {point.line - 1}" + (f", at {', '.join(known)}" if known else ""))
    if story.torn:
        say(f"the journal's end is torn: {story.torn} of its records could not be read")


def _sentence(way: Way, point: Point, profile: Profile) -> str:
    """What is going to be done, and what the person must make sure of."""
    told = f"it goes on with line {way.begin.line}: {way.certain}"
    if not way.homes:
        return told
    low, high = heights_mm(point)
    (x, y, z), pose = stood(point, profile)
    tilt, turn, machine = pose.tilt_deg, pose.turn_deg, profile.machine
    place = f"tip at X {x:.1f} Y {y:.1f} Z {z:.2f}"
    if point.moment.state not in AWAY and high - low > UNSURE_MM:
        place += f" (or up to {high - low:.2f} mm higher: watch how the first lines lie)"
    if hypot(tilt, turn) > 0:
        turns = f", {int(turn // 360)} whole turns and {turn % 360:.3f}" if abs(turn) >= 360 else ""
        place += f", table at {machine.tilt.letter} {tilt:.3f} {machine.turn.letter} {turn:.3f}{turns}"
    if machine.gcode.resume:
        return f"{told}\nit was cut off with the {place}\nthen: machine.gcode.resume homes the axes, bed and nozzle heat"
    return (
        f"{told}\nlook first: all must stand as it was cut off, {place}\n"
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
