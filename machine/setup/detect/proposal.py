"""Proposal: applies the values of a firmware's text to the nearest shipped machine, and lists what is left to measure."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from machine.firmware import FIRMWARES
from machine.setup.detect import grblhal, klipper, linuxcnc, marlin, reprapfirmware
from machine.setup.detect.found import ACCELERATION, LIMITS, PRINTING, SPEED, ConfigText, Found, Reading, rounded
from profiles.errors import ProfileError
from profiles.machine import Machine
from profiles.messages import option
from profiles.places import shipped
from profiles.profile import load_one
from profiles.toml_text import value_text

LINEAR = {LIMITS: "limits_mm", SPEED: "speed_mm_s", ACCELERATION: "acceleration_mm_s2"}
ROTARY = {LIMITS: "limits_deg", SPEED: "speed_deg_s", ACCELERATION: "acceleration_deg_s2"}
SETTINGS = ("junction_speed_mm_s", "extruder_speed_mm_s", "extruder_acceleration_mm_s2", "nozzle_limit_c", "bed_limit_c",
            "head.nozzle_mm", "arcs", "receive_bytes")  # fmt: skip
CHOICES = ("machine.arcs", "machine.receive_bytes")  # a print differs with them, but does not fail
CALIBRATED = tuple(f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("point_mm", "sign", "zero_deg"))
DRAWN = ("machine.tilt.axis", "machine.turn.budget_deg", "machine.table", "machine.head.silhouette_mm", "machine.head.boxes",
         "machine.cradle")  # fmt: skip
OF_A_FIXED_BED = ("machine.table", "machine.tool_mm")
ABOUT = {"A": [1.0, 0.0, 0.0], "B": [0.0, 1.0, 0.0]}  # ISO 841: A turns about X, B about Y, C about Z
SOURCE = re.compile(r"^\s*(?://\s*)?#define\s+[A-Z]|^\[(?:platformio|env:|config:)", re.MULTILINE)


@dataclass(frozen=True)
class Proposal:
    """A profile to create. base: the profile to inherit; values: key -> reading; absent: keys that this firmware does not report:
    the base's stay; measured: keys that no firmware knows; remarks: notes for the user."""

    base: str
    values: Mapping[str, Reading]
    absent: Sequence[str]
    measured: Sequence[str]
    remarks: Sequence[str]


def propose(found: Found, base: str | None = None) -> Proposal:
    """The profile's differences from a base: the profile named by the user, or the nearest shipped machine.

    Raises ProfileError when it is unknown which axes tilt and turn the table.
    """
    remarks = list(found.remarks)
    named = None if base is None else _machine(base)
    tilts = len(found.rotary) + len(found.doubtful) > 1 if named is None else named.tilts
    pair = _pair(found, named, remarks) if tilts else ""
    name = base or _nearest(found, pair)
    values: dict[str, Reading] = {"machine.dialect": Reading(found.dialect, "its dialect")}
    for letter in PRINTING:
        values |= {f"machine.{letter.lower()}.{LINEAR[key]}": reading for key, reading in found.axes[letter].items()}
    if tilts:
        values |= _turning(found, pair, _machine(name))
        if named is None:  # the base's may belong to another firmware
            values["machine.coordinates"] = Reading("table", "its axes are plain unless a command makes it follow the table")
    else:
        values |= _bed(values)
        remarks.append(_why_fixed(found, name))
    values |= {f"machine.{key}": reading for key, reading in found.settings.items() if tilts or key != "coordinates"}
    measured = (*CALIBRATED, *DRAWN) if tilts else OF_A_FIXED_BED
    absent = [key for key in _sought(tilts) if key not in values]
    return Proposal(name, values, absent, measured, remarks)


def settings_of(proposal: Proposal, name: str, firmware: str) -> list[str]:
    """KEY=VALUE settings over the base: the values, their sources, and the keys left to measure."""
    base = _machine(proposal.base)
    uncertain = [*proposal.measured, *(key for key in proposal.absent if key not in CHOICES)]
    left = [key for key in base.uncalibrated if key not in proposal.values]
    copied = f"as {proposal.base} has it"
    sources = dict.fromkeys((*base.sources, *proposal.absent), copied)
    sources |= {key: f"{firmware}: {reading.source}" for key, reading in proposal.values.items()}
    tables = {
        "machine.name": name,
        **{key: reading.value for key, reading in proposal.values.items()},
        "machine.uncalibrated": list(dict.fromkeys((*uncertain, *left))),
        "machine.sources": sources,
    }
    return [f"{key}={value_text(value)}" for key, value in tables.items()]


def _machine(name: str) -> Machine:
    machine = load_one(name, kind="machine")["machine"]
    assert isinstance(machine, Machine)
    return machine


def _nearest(found: Found, pair: str) -> str:
    """The nearest shipped machine by firmware, letters, dialect and differing axis numbers; the first by name if several tie.
    pair: the letters of tilt and turn, empty for a fixed table."""

    def differences(name: str) -> tuple[bool, bool, bool, int, str]:
        machine = _machine(name)
        other_firmware = _firmware(machine.dialect) != _firmware(found.dialect)
        other_letters = pair not in ("", machine.tilt.letter + machine.turn.letter)
        return other_firmware, other_letters, machine.dialect != found.dialect, _differing(found, machine), name

    return min((name for name in shipped("machine") if _machine(name).tilts == bool(pair)), key=differences)


def _differing(found: Found, machine: Machine) -> int:
    """Number of axis values that differ from a machine's."""
    linear = {"X": machine.x, "Y": machine.y, "Z": machine.z}
    values = [
        (getattr(linear[letter], LINEAR[key]), read.value) for letter in PRINTING for key, read in found.axes[letter].items()
    ]
    for axis in (machine.tilt, machine.turn):
        values += [(getattr(axis, ROTARY[key]), read.value) for key, read in found.axes.get(axis.letter, {}).items()]
    return sum((list(value) if isinstance(value, tuple) else value) != read for value, read in values)


def _firmware(dialect: str) -> str:
    return next(firmware.name for firmware in FIRMWARES if dialect in firmware.dialects)


def _turning(found: Found, pair: str, machine: Machine) -> dict[str, Reading]:
    """Letters and numbers of the tilt and the turn axis. machine: the base."""
    values: dict[str, Reading] = {}
    for axis, letter in zip(("tilt", "turn"), pair, strict=True):
        values[f"machine.{axis}.letter"] = Reading(letter, "its axes")
        values |= {f"machine.{axis}.{ROTARY[key]}": reading for key, reading in found.axes[letter].items()}
        if letter in found.steppers:
            values[f"machine.{axis}.stepper"] = Reading(found.steppers[letter], f"[manual_stepper {found.steppers[letter]}]")
    tilt = pair[0]
    if tilt in ABOUT and tilt != machine.tilt.letter:
        source = f"{tilt} turns about {'Y' if tilt == 'B' else 'X'} by ISO 841: look whether it does"
        values["machine.tilt.axis"] = Reading(ABOUT[tilt], source)
    return values


def _pair(found: Found, named: Machine | None, remarks: list[str]) -> str:
    """The letters of tilt and turn: those of the machine named by the user, else C turns and the other one tilts (ISO 841).

    Raises ProfileError for an ambiguity: a wrong axis would tilt the table instead of turning it, or move Z.
    """
    if named is not None and {named.tilt.letter, named.turn.letter} <= {*found.rotary, *found.doubtful}:
        return named.tilt.letter + named.turn.letter
    way = f"{option('base')} NAME names a machine, or a file of yours, whose machine.tilt.letter and machine.turn.letter say it"
    others = found.rotary.replace("C", "")
    if len(found.rotary) == 2 and len(others) == 1:
        remarks.append(f"{others} is taken for the tilt and C for the turn: move both once and look")
        remarks.extend(f"{letter} is left alone: {why}" for letter, why in found.doubtful.items())
        return others + "C"
    for why in found.doubtful.values():
        raise ProfileError(f"{why}, so it is not known which two axes tilt and turn the table: {way}")
    if len(found.rotary) < 2:
        rotary = f"one rotary axis, {found.rotary}" if found.rotary else "no rotary axis"
        raise ProfileError(f"{found.firmware} reports {rotary}, the base has two: leave out {option('base')}")
    letters = " ".join(found.rotary)
    raise ProfileError(f"{found.firmware} has the rotary axes {letters}, and nothing says which tilts and which turns: {way}")


def _bed(values: Mapping[str, Reading]) -> dict[str, Reading]:
    """A bed as large as X and Y reach, with the model at its centre."""
    reach = [values.get(f"machine.{axis}.limits_mm") for axis in "xy"]
    spans = [reading.value for reading in reach if reading is not None and isinstance(reading.value, list)]
    if len(spans) < 2:
        return {}
    source = "computed: the bed is assumed to be as large as X and Y reach"
    size, middle = [high - low for low, high in spans], [(low + high) / 2.0 for low, high in spans]
    return {"machine.table.size_mm": Reading(rounded(size), source), "machine.tool_mm": Reading(rounded([*middle, 0.0]), source)}


def _why_fixed(found: Found, base: str) -> str:
    others = " ".join((*found.rotary, *found.doubtful))
    if not others:
        return f"it reports no rotary axis: shape is fixed, as in {base}, and all is printed in one part"
    return f"shape is fixed, as in {base}, where two axes would tilt and turn the table; of its own it has {others}"


def _sought(tilts: bool) -> list[str]:
    """Every key that at least one firmware reports."""
    linear = [f"machine.{axis}.{key}" for axis in "xyz" for key in LINEAR.values()]
    rotary = [f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("letter", *ROTARY.values())]
    return [*linear, *(rotary if tilts else ()), *(f"machine.{key}" for key in SETTINGS)]


# For each firmware whether a text is its own, the reader (raises ProfileError), and the kind of text for messages.
READERS: tuple[tuple[Callable[[str], bool], Callable[[ConfigText], Found], str], ...] = (
    (linuxcnc.recognise, linuxcnc.read, "LinuxCNC's .ini"),
    (klipper.recognise, klipper.read, "Klipper's printer.cfg"),
    (reprapfirmware.recognise, reprapfirmware.read, "RepRapFirmware's config.g"),
    (grblhal.recognise, grblhal.read, "a dump of grblHAL's $$"),
    (marlin.recognise, marlin.read, "a log of Marlin's M503"),
)


def read(config: ConfigText) -> Found:
    """The values in a text of any known firmware, rounded as in a profile.

    Raises ProfileError for other texts, and for one without speed or acceleration of X, Y or Z, which is incomplete.
    """
    found = _reader(config)(config)
    lacking = [
        f"{word} of {letter}" for letter in PRINTING for word in (SPEED, ACCELERATION) if word not in found.axes.get(letter, {})
    ]
    if lacking:
        raise ProfileError(f"{config.name}: it is {found.firmware}'s, but reports no {', no '.join(lacking[:2])}: is it whole?")
    axes = {letter: _rounded(readings) for letter, readings in found.axes.items()}
    return replace(found, axes=axes, settings=_rounded(found.settings))


def _reader(config: ConfigText) -> Callable[[ConfigText], Found]:
    for recognise, reader, _ in READERS:
        if recognise(config.text):
            return reader
    if SOURCE.search(config.text):
        raise ProfileError(
            f"{config.name}: it is source that a firmware is built from (Configuration.h, platformio.ini, config.ini), not what "
            "the printer has stored: the answers to M115, M503 and M211 are expected, saved as a log or queried by "
            f"{option('port')}"
        )
    known = [text for _, _, text in READERS]
    raise ProfileError(f"{config.name}: not a firmware's configuration: {', '.join(known[:-1])} or {known[-1]} is expected")


def _rounded(readings: Mapping[str, Reading]) -> dict[str, Reading]:
    return {key: Reading(rounded(value), source) for key, (value, source) in readings.items()}
