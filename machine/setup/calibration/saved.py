"""Saved: the numbers that a calibration or a coupon found, as a profile in the user's own folder that inherits the rest."""

import tomllib
from collections.abc import Mapping, MutableMapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from machine.setup.calibration.fit import Calibration
from profiles.machine import Machine
from profiles.places import PARENT, merged, own, own_folder, parse, shipped

DIRECTIONS = ("machine.tilt.axis", "machine.turn.axis")
DIGITS = {"axis": 6}  # a millionth of a unit vector is a tenth of a micrometre at 100 mm; of other numbers four digits are kept
FOUND = tuple(f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("sign", "point_mm"))


def fitted_keys(zero_of_turn: bool, directions: bool = False) -> tuple[str, ...]:
    """The keys that a calibration finds; the turn's zero only where the mark's direction was told, the axes' where sought."""
    zeros = ("machine.tilt.zero_deg", *(("machine.turn.zero_deg",) if zero_of_turn else ()))
    return (*FOUND, *zeros, *(DIRECTIONS if directions else ()))


def fitted_tables(before: Machine, calibration: Calibration, zero_of_turn: bool) -> dict[str, Any]:
    """The tables of the calibrated profile: numbers, sources, and what is left uncalibrated."""
    source = f"tiltprint calibrate, {len(calibration.residuals_mm)} touches, {calibration.rms_mm:.3f} mm off"
    return found_tables(before, calibration.machine, fitted_keys(zero_of_turn, calibration.directions), source)


def found_tables(before: Machine, after: Machine, keys: Sequence[str], source: str) -> dict[str, Any]:
    """The tables of a profile in which these keys of the rotary axes are found: numbers, sources, what is left uncalibrated."""
    axes: dict[str, dict[str, Any]] = {"tilt": {}, "turn": {}}
    for key in keys:
        _, axis, name = key.split(".")
        value = getattr(getattr(after, axis), name)
        digits = DIGITS.get(name, 4)
        axes[axis][name] = [round(x, digits) for x in value] if isinstance(value, tuple) else round(value, digits)
    left = [key for key in before.uncalibrated if key not in keys]
    return {"machine": {"uncalibrated": left, **axes, "sources": dict.fromkeys(keys, source)}}


def own_profile(kind: str, name: str, parent: str, tables: Mapping[str, Any]) -> tuple[Path, str]:
    """The file in the user's folder for a kind of profile and its new text: what it holds already, comments too, the new tables
    over it."""
    file = own_folder(kind) / f"{name}.toml"
    if name not in own(kind):
        known = parent in (*shipped(kind), *own(kind))
        return file, tomlkit.dumps({PARENT: parent if known else str(Path(parent).resolve()), **tables})
    whole = merged(parse(file), tables)
    document = tomlkit.parse(file.read_text(encoding="utf-8"))
    _overlay(document, tables)
    text = tomlkit.dumps(document)
    # Beside dotted keys tomlkit puts a new table before the keys that follow: then the comments are given up.
    return file, text if tomllib.loads(text) == whole else tomlkit.dumps(whole)


def _overlay(table: MutableMapping[str, Any], values: Mapping[str, Any]) -> None:
    """Put values into a table, its other keys left as they are."""
    for key, value in values.items():
        below = table.get(key)
        if isinstance(value, Mapping) and isinstance(below, MutableMapping):
            _overlay(below, value)
        else:
            table[key] = value
