"""Saved: the numbers that a calibration found, as a profile in the user's own folder that inherits the rest."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from machine.calibration.fit import Calibration
from profiles.machine import Machine
from profiles.places import PARENT, merged, own, own_folder, parse, shipped

FOUND = tuple(f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("sign", "point_mm"))


def found_keys(zero_of_turn: bool) -> tuple[str, ...]:
    """The keys that a calibration finds; the turn's zero only where the mark's direction was told."""
    return (*FOUND, "machine.tilt.zero_deg", *(("machine.turn.zero_deg",) if zero_of_turn else ()))


def found_tables(before: Machine, calibration: Calibration, zero_of_turn: bool) -> dict[str, Any]:
    """The tables of the calibrated profile: numbers, sources, and what is left uncalibrated."""
    keys = found_keys(zero_of_turn)
    source = f"tiltprint calibrate, {len(calibration.residuals_mm)} touches, {calibration.rms_mm:.3f} mm off"
    axes: dict[str, dict[str, Any]] = {"tilt": {}, "turn": {}}
    for key in keys:
        _, axis, name = key.split(".")
        value = getattr(getattr(calibration.machine, axis), name)
        axes[axis][name] = [round(x, 4) for x in value] if isinstance(value, tuple) else round(value, 4)
    left = [key for key in before.uncalibrated if key not in keys]
    return {"machine": {"uncalibrated": left, **axes, "sources": dict.fromkeys(keys, source)}}


def own_document(name: str, parent: str, tables: Mapping[str, Any]) -> tuple[Path, dict[str, Any]]:
    """The file in the user's folder and what it shall hold: what it holds already, the new tables over it."""
    file = own_folder("machine") / f"{name}.toml"
    if name in own("machine"):
        return file, merged(parse(file), tables)
    inherited = parent if parent in (*shipped("machine"), *own("machine")) else str(Path(parent).resolve())
    return file, {PARENT: inherited, **tables}
