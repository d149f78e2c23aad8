"""Proposal: a profile of the nearest shipped machine with what a firmware tells over it, and what only a measurement tells."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from machine.detect.found import ACCELERATION, LIMITS, PRINTING, SPEED, Found, Reading, rounded
from machine.firmware import FIRMWARES
from profiles.errors import ProfileError
from profiles.machine import Machine
from profiles.places import shipped
from profiles.profile import load_one
from profiles.toml_text import value_text

LINEAR = {LIMITS: "limits_mm", SPEED: "speed_mm_s", ACCELERATION: "acceleration_mm_s2"}
ROTARY = {LIMITS: "limits_deg", SPEED: "speed_deg_s", ACCELERATION: "acceleration_deg_s2"}
SETTINGS = ("junction_speed_mm_s", "extruder_speed_mm_s", "extruder_acceleration_mm_s2", "nozzle_limit_c", "bed_limit_c",
            "head.nozzle_mm", "arcs", "receive_bytes")  # fmt: skip
CHOICES = ("machine.arcs", "machine.receive_bytes")  # with which a print differs, but does not fail
CALIBRATED = tuple(f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("point_mm", "sign", "zero_deg"))
DRAWN = ("machine.tilt.axis", "machine.table", "machine.head.silhouette_mm", "machine.head.boxes", "machine.cradle")
OF_A_FIXED_BED = ("machine.table", "machine.tool_mm")
ABOUT = {"A": [1.0, 0.0, 0.0], "B": [0.0, 1.0, 0.0]}  # ISO 841: A turns about X, B about Y, C about Z


@dataclass(frozen=True)
class Proposal:
    """base: the profile that is inherited; values: key -> reading, of a machine; absent: keys that the firmware does not tell, so
    that they are the base's; measured: keys that no firmware knows; remarks: sentences."""

    base: str
    values: Mapping[str, Reading]
    absent: Sequence[str]
    measured: Sequence[str]
    remarks: Sequence[str]


def propose(found: Found, base: str | None = None) -> Proposal:
    """What a profile says otherwise than the base; None: the nearest shipped machine. Raises ProfileError."""
    remarks = list(found.remarks)
    tilts = len(found.rotary) >= 2 if base is None else _machine(base).tilts
    name = base or _nearest(found, tilts)
    machine = _machine(name)
    values: dict[str, Reading] = {"machine.dialect": Reading(found.dialect, "its dialect")}
    for letter in PRINTING:
        values |= {f"machine.{letter.lower()}.{LINEAR[key]}": reading for key, reading in found.axes[letter].items()}
    if tilts:
        values |= _turning(found, machine, remarks)
    else:
        values |= _bed(values)
        remarks.append(_why_fixed(found, name))
    values |= {f"machine.{key}": reading for key, reading in found.settings.items() if tilts or key != "coordinates"}
    measured = (*CALIBRATED, *DRAWN) if tilts else OF_A_FIXED_BED
    absent = [key for key in _sought(tilts) if key not in values]
    return Proposal(name, values, absent, measured, remarks)


def settings_of(proposal: Proposal, name: str, firmware: str) -> list[str]:
    """KEY=VALUE settings over the base: the values, where each comes from, and what is left to measure."""
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


def _nearest(found: Found, tilts: bool) -> str:
    """The shipped machine of the same firmware, then letters, then dialect, whose axes differ least; the first by name among
    equals."""

    def differences(name: str) -> tuple[bool, bool, bool, int, str]:
        machine = _machine(name)
        letters = {machine.tilt.letter, machine.turn.letter}
        other_firmware = _firmware(machine.dialect) != _firmware(found.dialect)
        other_letters = tilts and not letters <= set(found.rotary)
        return other_firmware, other_letters, machine.dialect != found.dialect, _differing(found, machine), name

    return min((name for name in shipped("machine") if _machine(name).tilts == tilts), key=differences)


def _differing(found: Found, machine: Machine) -> int:
    """How many numbers of the axes are others than a machine's."""
    linear = {"X": machine.x, "Y": machine.y, "Z": machine.z}
    values = [
        (getattr(linear[letter], LINEAR[key]), told.value) for letter in PRINTING for key, told in found.axes[letter].items()
    ]
    for axis in (machine.tilt, machine.turn):
        values += [(getattr(axis, ROTARY[key]), told.value) for key, told in found.axes.get(axis.letter, {}).items()]
    return sum((list(value) if isinstance(value, tuple) else value) != told for value, told in values)


def _firmware(dialect: str) -> str:
    return next(firmware.name for firmware in FIRMWARES if dialect in firmware.dialects)


def _turning(found: Found, machine: Machine, remarks: list[str]) -> dict[str, Reading]:
    """Letters and numbers of the two axes that turn the table."""
    values: dict[str, Reading] = {}
    pair = _pair(found, machine, remarks)
    for axis, letter in zip(("tilt", "turn"), pair, strict=False):
        values[f"machine.{axis}.letter"] = Reading(letter, "its axes")
        values |= {f"machine.{axis}.{ROTARY[key]}": reading for key, reading in found.axes[letter].items()}
        if letter in found.steppers:
            values[f"machine.{axis}.stepper"] = Reading(found.steppers[letter], f"[manual_stepper {found.steppers[letter]}]")
    tilt = pair[:1]
    if tilt in ABOUT and tilt != machine.tilt.letter:
        source = f"{tilt} turns about {'Y' if tilt == 'B' else 'X'} by ISO 841: look whether it does"
        values["machine.tilt.axis"] = Reading(ABOUT[tilt], source)
    return values


def _pair(found: Found, machine: Machine, remarks: list[str]) -> str:
    """The letters of tilt and turn: the base's where they are there, else C turns, or what comes last in the alphabet."""
    usual = machine.tilt.letter + machine.turn.letter
    if set(usual) <= set(found.rotary):
        return usual
    letters = sorted(letter for letter in found.rotary if letter in "ABC") or sorted(found.rotary)
    if len(letters) == 1 or not letters:
        remarks.append(f"it tells of {len(letters) or 'no'} rotary axis where two turn a table: those of the base are kept")
        return ""
    if len(letters) > 2:
        raise ProfileError(
            f"{found.firmware} has the rotary axes {' '.join(letters)}, of which two tilt and turn the table: --base names a "
            "machine that has those two letters"
        )
    tilt, turn = letters
    remarks.append(f"{tilt} is taken for the tilt and {turn} for the turn: move both once and look")
    return tilt + turn


def _bed(values: Mapping[str, Reading]) -> dict[str, Reading]:
    """A bed as large as X and Y reach, the model on its middle."""
    reach = [values.get(f"machine.{axis}.limits_mm") for axis in "xy"]
    spans = [reading.value for reading in reach if reading is not None and isinstance(reading.value, list)]
    if len(spans) < 2:
        return {}
    source = "worked out: the bed is taken to be as large as X and Y reach"
    size = [rounded(high - low) for low, high in spans]
    middle = [rounded((low + high) / 2.0) for low, high in spans]
    return {"machine.table.size_mm": Reading(size, source), "machine.tool_mm": Reading([*middle, 0.0], source)}


def _why_fixed(found: Found, base: str) -> str:
    if len(found.rotary) == 1:
        return f"only {found.rotary} turns, and a table that tilts and turns has two such axes: shape is fixed, as in {base}"
    if found.rotary:
        return f"shape is fixed, as in {base}, although {' and '.join(found.rotary)} turn"
    return f"it tells of no axis that turns: shape is fixed, as in {base}, and all is printed in one part"


def _sought(tilts: bool) -> list[str]:
    """Every key that some firmware tells."""
    linear = [f"machine.{axis}.{key}" for axis in "xyz" for key in LINEAR.values()]
    rotary = [f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("letter", *ROTARY.values())]
    return [*linear, *(rotary if tilts else ()), *(f"machine.{key}" for key in SETTINGS)]
