"""Saved: what a coupon found, as tables of the material's and the process's profile, each value with its source and date."""

from datetime import date
from typing import Any

import tomlkit

from machine.calibration.coupon.fit import Outcome


def material_tables(outcome: Outcome, day: date) -> dict[str, Any]:
    """The strengths of the material: across layers, of bars in one piece, and of joints as they are printed now."""
    strengths = {"interlayer_strength_mpa": outcome.upright_mpa, "joint_strength_mpa": outcome.best_joint_mpa}
    return {"material": {key: _with_source(round(mpa, 2), outcome, day) for key, mpa in strengths.items() if mpa is not None}}


def process_tables(outcome: Outcome, day: date) -> dict[str, Any]:
    """The settings that won; empty where none did."""
    return {"process": {key: _with_source(value, outcome, day) for key, value in outcome.won.items()}} if outcome.won else {}


def _with_source(value: Any, outcome: Outcome, day: date) -> Any:
    source = f"tiltprint coupon, {day.isoformat()}, {outcome.loads} loads, scatter {100 * outcome.scatter:.0f} %"
    return tomlkit.item(value).comment(source)
