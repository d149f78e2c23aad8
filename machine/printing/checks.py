"""Checks before anything moves: whether printer, machine profile and program fit together.

An objection is a sentence: it is raised, or only reported with --force.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from operator import attrgetter

from machine.dryrun.dryrun import reached
from machine.dryrun.starvation import find_starvation
from machine.firmware import dialect_of, dialects, firmware_of, identify
from machine.firmware.klipper import stepper_name
from machine.gcode.commands import command_named
from machine.gcode.line_text import macro_name
from machine.link.identification import Answer
from machine.link.print_state import PrintState, PrintStatus
from machine.notices import say
from machine.pipeline.embedded_profile import read_embedded_profile
from machine.pipeline.programs import LoadedProgram, count_of_errors, refuse_errors
from machine.pipeline.requests import FORCE_GOES_ON
from machine.printing.destination import Destination, SerialPort, Server
from machine.printing.servers.server import Identity
from machine.printing.servers.servers import dialect_mismatch
from machine.program import Program
from profiles.errors import PrinterError, ServerError
from profiles.machine import Machine
from profiles.messages import key_name, phrase
from profiles.profile import Profile

CLEAN = "the dry run found no error: every move is within the limits and clear of the head"
SLACK = 0.01  # mm or deg: rounding of firmware and program
# The keys on which a program depends: a program made with other values is wrong here. Speeds and accelerations do not count.
OF_AXIS = ("letter", "stepper", "axis", "point_mm", "sign", "zero_deg")
SHAPING = ("shape", "dialect", "coordinates", "tool_mm", *(f"{axis}.{key}" for axis in ("tilt", "turn") for key in OF_AXIS))


def check(sentences: Iterable[str], force: bool) -> bool:
    """Raise PrinterError for the first objection, or report all with force; True when there is none."""
    found = False
    for sentence in filter(None, sentences):
        if not force:
            raise PrinterError(f"{sentence} ({FORCE_GOES_ON})", forcible=True)
        found = True
        say(sentence, forced=True)
    return not found


def check_machine(answer: Answer | None, machine: Machine) -> None:
    """Refuse a machine whose firmware takes no lines, or differs from the firmware at the port (answer; None: unknown). Raises
    PrinterError."""
    check_dialect(machine)
    check([firmware_mismatch(answer, machine)], force=False)


def check_destination(destination: Destination, machine: Machine) -> None:
    """Refuse a machine whose dialect the destination cannot read; needs no connection. Raises PrinterError."""
    if not isinstance(destination, Server):
        check_dialect(machine)
    elif sentence := dialect_mismatch(destination, machine.name, machine.dialect):
        raise PrinterError(sentence)


def check_dialect(machine: Machine) -> None:
    """Refuse a machine whose firmware takes no lines over a serial port."""
    if not dialect_of(machine).serial:
        streamed = ", ".join(name for name, dialect in dialects().items() if dialect.serial)
        raise PrinterError(
            f"{machine.name} speaks {machine.dialect}, which opens files itself: use export; print serves the dialects {streamed}"
        )


def machine_sentences(identity: Identity, machine: Machine) -> Iterator[str]:
    """Objections to a machine at this printer."""
    yield firmware_mismatch(identity.printer, machine)
    yield lacking_steppers(identity, machine)
    yield _unknown_macros(lacking_macros(identity, _block_lines(machine)), machine.name)


def program_sentences(identity: Identity, loaded: LoadedProgram, force: bool) -> Iterator[str]:
    """Objections to a program: made for another machine, beyond the firmware's limits, or calling macros that a Klipper lacks.
    Raises MoveError for errors of its dry run, unless forced."""
    program, machine = loaded.program, loaded.profile.machine
    recorded, sections = read_embedded_profile(program.lines, loaded.profile, frozenset())
    if "machine" in sections:
        yield machine_mismatch(recorded.machine, machine, loaded.name)
    if identity.printer is not None:
        rotary = (machine.tilt.letter, machine.turn.letter)
        # in workpiece coordinates X Y Z are not positions of the axes
        letters = rotary if machine.coordinates == "workpiece" else None
        moved = {axis: reach for axis, reach in reached(program.run).items() if reach and (letters is None or axis in letters)}
        yield exceeded_limit(identity.printer, moved)
    lacking = lacking_macros(identity, _block_lines(machine))
    yield _unknown_macros([name for name in lacking_macros(identity, program.lines) if name not in lacking], loaded.name)
    if not force:
        refuse_errors(program.run.errors, force=False)
    yield count_of_errors(program.run.errors)


def with_starvation(destination: Destination, program: Program, profile: Profile) -> Program:
    """The program, with findings where the serial line is too slow for it."""
    if not isinstance(destination, SerialPort) or not destination.is_rate_limited:
        return program
    return replace(program, run=find_starvation(program.run, program.lines, profile.machine, destination.baud))


def check_free(server: str, status: PrintStatus) -> None:
    """Refuse a server that cannot start a print now. Raises ServerError."""
    if status.state.is_printing:
        now = f"{server} is {status.state} {status.file or 'another file'} now"
        raise ServerError(
            f"{now}: wait until that is done; {phrase('hand over', 'send without --start hands a file over meanwhile')}"
        )
    if status.state is PrintState.OFFLINE:
        raise ServerError(f"{server} cannot print now: {status.message or 'its printer is not connected'}")


def check_idle(server: str, status: PrintStatus) -> None:
    """Refuse to query a server that is printing or has no printer connected. Raises ServerError."""
    if status.state.is_printing:
        raise ServerError(f"{server} is {status.state} {status.file or 'a file'} now: try again when that is done")
    if status.state is PrintState.OFFLINE:
        raise ServerError(f"{server} cannot report its settings now: {status.message or 'its printer is not connected'}")


def firmware_mismatch(answer: Answer | None, machine: Machine) -> str:
    """Why this firmware cannot print for a machine; "" when it can, or when its answer does not decide that."""
    if answer is None:
        return ""
    firmware = identify(answer.words)
    dialects = tuple(firmware.dialects) if firmware is not None else ()  # empty: unknown
    if dialects and machine.dialect not in dialects:
        return (
            f"the printer's firmware is {answer.firmware}, but {machine.name} writes for {machine.dialect}: "
            f"{key_name('machine.dialect')} must be {' or '.join(dialects)}"
        )
    wanted = "XYZ" + (machine.tilt.letter + machine.turn.letter if machine.tilts else "")
    lacking = [letter for letter in wanted if letter not in answer.letters]
    if not firmware_of(machine).line.reports_rotary_axes or not answer.letters or not lacking:
        return ""
    return (
        f"the printer's firmware moves {' '.join(answer.letters)}, but {machine.name} needs {' '.join(wanted)}: "
        f"{' and '.join(lacking)} {'is' if len(lacking) == 1 else 'are'} missing"
    )


def exceeded_limit(answer: Answer, reached: Mapping[str, Sequence[float]]) -> str:
    """Which axis of a program exceeds the limits that the firmware reports; "" when none does.

    reached: letter -> least and greatest value of the program, mm or deg. Firmwares clip such moves silently.
    """
    for letter, (low, high) in reached.items():
        least, most = answer.limits.get(letter, (low, high))
        if low < least - SLACK or high > most + SLACK:
            return (
                f"the program moves {letter} from {low:.2f} to {high:.2f}, but the printer's firmware allows "
                f"{least:g} to {most:g}: the machine profile's limits must be those of the firmware"
            )
    return ""


def machine_mismatch(recorded: Machine, chosen: Machine, file: str) -> str:
    """Why a program made for one machine is wrong on another; "" when the two do not differ in SHAPING."""
    if recorded.name != chosen.name:
        return f"{file} was made for the machine {recorded.name}, not for {chosen.name}"
    for key in SHAPING:
        then, now = (attrgetter(key)(machine) for machine in (recorded, chosen))
        if then != now:
            return f"{file} was made when {key_name(f'machine.{key}')} of {chosen.name} was {_text(then)}, but it is {_text(now)}"
    return ""


def _text(value: object) -> str:
    return ", ".join(f"{x:g}" for x in value) if isinstance(value, tuple) else str(value)


def lacking_steppers(identity: Identity, machine: Machine) -> str:
    """Which [manual_stepper] of the machine's table a Klipper lacks; "" when it has all or reports none."""
    if identity.steppers is None or not machine.tilts:
        return ""
    wanted = [stepper_name(axis) for axis in (machine.tilt, machine.turn)]
    lacking = [name for name in wanted if name not in identity.steppers]
    if not lacking:
        return ""
    there = ", ".join(sorted(identity.steppers)) or "none"
    sections = " and ".join(f"[manual_stepper {name}]" for name in lacking)
    return (
        f"{machine.name} turns its table by {sections}, which this Klipper lacks; it has {there}: "
        f"{key_name('machine.tilt.stepper')} names it"
    )


def lacking_macros(identity: Identity, lines: Iterable[str]) -> list[str]:
    """The macros that the lines call and a Klipper lacks; [] when it has all, or does not report them."""
    if identity.commands is None:
        return []
    called = dict.fromkeys(name for line in lines if (name := macro_name(line)))
    return [name for name in called if name not in identity.commands and not command_named(name).shows]


def _block_lines(machine: Machine) -> list[str]:
    blocks = machine.gcode
    return [line for block in (blocks.start, blocks.before_part, blocks.after_part, blocks.end) for line in block.split("\n")]


def _unknown_macros(names: list[str], caller: str) -> str:
    """Sentence about missing macros, "" for none. Klipper answers an unknown command with a text and continues (klippy/gcode.py,
    cmd_default): nothing would be homed."""
    if not names:
        return ""
    sections = " and ".join(f"[gcode_macro {name}]" for name in names)
    return f"{caller} calls {' and '.join(names)}, which this Klipper does not know and would pass over: it needs {sections}"
