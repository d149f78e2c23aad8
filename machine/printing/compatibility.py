"""Compatibility: whether the printer at a port, the machine's profile and the program belong together, before anything moves."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from time import monotonic, sleep

from machine.dryrun.dryrun import summary
from machine.dryrun.starvation import find_starvation
from machine.firmware import dialect_of, dialects, firmware_of, identify
from machine.firmware.firmware import LineRules
from machine.link.identification import Answer, Kind, ask, ask_at_any_rate
from machine.link.port import Port, open_port
from machine.notices import say
from machine.pipeline.embedded_profile import read_embedded_profile
from machine.pipeline.programs import refuse_errors
from machine.pipeline.requests import FORCE_GOES_ON, SIMULATED, PrintRequest
from machine.program import Program
from profiles.errors import FirmwareError, PortError, PrinterError, SilenceError
from profiles.machine import Machine
from profiles.profile import Profile

ECHO = ("M114", "M115")
STARTING_S, STARTING_AGAIN_S = 60.0, 5.0  # Klipper takes 5 to 20 s until its boards are connected
SLACK = 0.01  # mm or deg: what the firmware and the program round
# What a program depends on: made for one such machine it is wrong on another. Speeds and accelerations are not among it.
SHAPING = ("shape", "dialect", "coordinates", "tool_mm")
AXIS = ("letter", "stepper", "axis", "point_mm", "sign", "zero_deg")


def identify_printer(wire: Port, baud: int, halted: bool = False) -> Answer:
    """What answers at a port, which must be a printer at this rate; raises PrinterError with a sentence of what it is.

    One that is still starting is waited for. halted: one that has halted will do, if a command lets it print again.
    """
    answer, rate = ask_at_any_rate(wire, baud)
    end_s = monotonic() + STARTING_S
    while answer.kind is Kind.STARTING and monotonic() < end_s:
        say(f"{answer.firmware} at {wire.name} is still starting: waiting up to {end_s - monotonic():.0f} s more")
        sleep(STARTING_AGAIN_S)
        answer = ask(wire)
    if not (halted and answer.kind is Kind.HALTED and rate == baud and answer.revival != LineRules.revival):
        check_answer(answer, wire.name, baud, rate)
    return answer


def check_answer(answer: Answer, port: str, baud: int, rate: int) -> None:
    """Refuse what is no printer, or one that answers at another rate; raises PrinterError with a sentence of what it is."""
    if answer.kind.is_printer and rate != baud:
        raise PortError(f"the printer at {port} does not speak at {baud} baud but at {rate}: use --baud {rate}")
    if answer.kind is not Kind.PRINTER:
        error, refusal, _ = NO_PRINTERS[answer.kind]
        raise error(refusal.format(port=port, baud=baud, **_words(answer)))


def _words(answer: Answer) -> dict[str, str]:
    """What a sentence about an answer may name. Marlin says of its work only that it does something, or waits."""
    words = answer.words[:60]
    usual = answer.words.startswith(("processing", "paused for", "busy")) or not words
    work = "it heats, moves or waits for a person" if usual else words
    stranger = "it sends back what it is told" if answer.words in ECHO else f"it says {words!r}"
    return {"words": words, "work": work, "stranger": stranger, "firmware": answer.firmware, "revival": answer.revival}


# What answers that is no printer to print on: the error, as a sentence, and how it is listed.
NO_PRINTERS: Mapping[Kind, tuple[type[PrinterError], str, str]] = {
    Kind.BUSY: (
        PrinterError,
        "the printer at {port} is busy ({work}): wait until it is done, or restart it",
        "a printer that is busy ({work}), at {baud} baud",
    ),
    Kind.STARTING: (
        PrinterError,
        "the printer at {port} is still starting ({firmware}): if it does not become ready, look at Klipper's own log",
        "a printer that is still starting ({firmware}), at {baud} baud",
    ),
    Kind.HALTED: (
        FirmwareError,
        "the printer at {port} has stopped with an error of its own ({words}): {revival} before the next print",
        "a printer that has stopped with an error ({words}), at {baud} baud",
    ),
    Kind.STRANGER: (
        PrinterError,
        "what answers at {port} is no printer: {stranger} instead of answering M115",
        "something answers but is no printer: {stranger}",
    ),
    Kind.RUBBISH: (
        PortError,
        "only rubbish comes from {port} at {baud} baud, and no printer answers at the usual other rates: "
        "the firmware's settings tell its rate for --baud",
        "rubbish at {baud} baud, and nothing at the usual other rates: --baud N tries another",
    ),
    Kind.SILENT: (
        SilenceError,
        "nothing answers at {port}: is the printer switched on, and is {baud} baud the firmware's rate? "
        "One that has halted says nothing until it is switched off and on",
        "nothing answers",
    ),
}


def check_port(port: str, baud: int, sim_speed: float) -> Answer | None:
    """What answers at a port, refused at once when it is no printer; None for the simulated one. Raises PrinterError."""
    check_speed(sim_speed)
    if port == SIMULATED:
        return None
    with open_port(port, baud) as wire:
        return identify_printer(wire, baud)


def is_rate_limited(port: str) -> bool:
    """Whether bytes take the time that the baud rate says: not over native USB, a network or a pseudo-terminal."""
    if port == SIMULATED or "://" in port:
        return False
    device = Path(port).resolve()  # of a stable name under /dev/serial/by-id
    return device.parent.name != "pts" and not device.name.startswith(("ttyACM", "cu.usbmodem"))


def check_speed(sim_speed: float) -> None:
    """Refuse a speed at which no simulated printer can run."""
    if not (isfinite(sim_speed) and sim_speed >= 0):
        raise PrinterError(f"--sim-speed is {sim_speed:g}: it must be 0 (as fast as possible) or a number above")


def check_dialect(machine: Machine) -> None:
    """Refuse a machine whose firmware takes no lines over a serial port."""
    if not dialect_of(machine).serial:
        streamed = ", ".join(name for name, dialect in dialects().items() if dialect.serial)
        raise PrinterError(
            f"{machine.name} speaks {machine.dialect}, which opens files itself: use export; print serves the dialects {streamed}"
        )


def describe_answer(answer: Answer, baud: int) -> str:
    """What answers, for a person."""
    if answer.kind is Kind.PRINTER:
        axes = f", axes {' '.join(answer.letters)}" if answer.letters else ""
        return f"{answer.firmware or 'a printer that does not name its firmware'}{axes}, at {baud} baud"
    return NO_PRINTERS[answer.kind][2].format(baud=baud, **_words(answer))


def check_printer(answer: Answer | None, machine: Machine, force: bool) -> None:
    """Refuse a printer whose firmware cannot print for the machine; force: only say so. None: nothing is known."""
    if answer is not None:
        refuse(firmware_mismatch(answer, machine), force)


def check_machine(answer: Answer | None, machine: Machine, force: bool) -> None:
    """Refuse a machine whose firmware takes no lines, or is not that of the printer; force: of the latter only say so."""
    check_dialect(machine)
    check_printer(answer, machine, force)


def check_program(answer: Answer | None, program: Program, profile: Profile, file: str, force: bool) -> None:
    """Refuse a program that was made for another machine, or that leaves the limits that the firmware tells; force: say so."""
    own, sections = read_embedded_profile(program.lines, profile, frozenset())
    if "machine" in sections:
        refuse(machine_mismatch(own.machine, profile.machine, file), force)
    if answer is not None:
        machine, reached = profile.machine, {letter: reach for letter, reach in summary(program.run)["axes"].items() if reach}
        rotary = (machine.tilt.letter, machine.turn.letter)
        followed = machine.coordinates == "workpiece"  # X Y Z of such a file are no places of the axes
        refuse(exceeded_limit(answer, {key: reach for key, reach in reached.items() if key in rotary or not followed}), force)


def ready_program(
    answer: Answer | None, program: Program, profile: Profile, *, name: str, printing: PrintRequest, force: bool
) -> Program:
    """The program with what the dry run finds of this line's rate. Raises PrinterError, MoveError; force: only says so."""
    check_program(answer, program, profile, name, force)
    refuse_errors(program.run.errors, force)
    if not is_rate_limited(printing.port):
        return program
    return replace(program, run=find_starvation(program.run, program.lines, profile.machine, printing.baud))


def refuse(sentence: str, force: bool) -> None:
    if sentence and not force:
        raise PrinterError(f"{sentence} ({FORCE_GOES_ON})", forcible=True)
    if sentence:
        say(sentence, forced=True)


def firmware_mismatch(answer: Answer, machine: Machine) -> str:
    """Why this firmware cannot print for a machine, as a sentence; "" when it can, or does not tell enough to say."""
    firmware = identify(answer.words)
    dialects = tuple(firmware.dialects) if firmware is not None else ()  # none: what it understands is not known
    if dialects and machine.dialect not in dialects:
        return (
            f"the printer's firmware is {answer.firmware}, but {machine.name} writes for {machine.dialect}: "
            f"machine.dialect must be {' or '.join(dialects)}"
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
    """Which axis of a program leaves the limits that the firmware tells, as a sentence; "" when none does.

    reached: letter -> least and greatest value of the program, mm or deg. Firmwares clip such a move without a word.
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
    """Why a program made for one machine is wrong on another, as a sentence; "" when both are the same to it."""
    if recorded.name != chosen.name:
        return f"{file} was made for the machine {recorded.name}, not for {chosen.name}"
    for key in SHAPING:
        if (then := getattr(recorded, key)) != (now := getattr(chosen, key)):
            return _changed(file, chosen, key, then, now)
    for axis in ("tilt", "turn"):
        for key in AXIS:
            if (then := getattr(getattr(recorded, axis), key)) != (now := getattr(getattr(chosen, axis), key)):
                return _changed(file, chosen, f"{axis}.{key}", then, now)
    return ""


def _changed(file: str, machine: Machine, key: str, then: object, now: object) -> str:
    return f"{file} was made when machine.{key} of {machine.name} was {_text(then)}, but it is {_text(now)}"


def _text(value: object) -> str:
    return ", ".join(f"{x:g}" for x in value) if isinstance(value, tuple) else str(value)
