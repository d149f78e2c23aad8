"""Saved: what a coupon found, as tables of the material's and the process's profile, each value with its source and date."""

from datetime import date
from typing import Any

import tomlkit

from machine.setup.coupon.fit import Outcome
from profiles.material import Material


def material_tables(outcome: Outcome, before: Material, day: date) -> dict[str, Any]:
    """What the material bears across layers, by the bars in one piece, and which share of it a joint with what won does; a joint
    that bears more counts as one piece. before: whose strength stays where no such bar was broken."""
    measured = outcome.upright_mpa is not None
    upright = round(outcome.upright_mpa, 2) if outcome.upright_mpa is not None else before.interlayer_strength_mpa
    factor = round(min(1.0, outcome.best_joint_mpa / upright), 3)
    values = {"interlayer_strength_mpa": upright} if measured else {}
    return {
        "material": {key: _with_source(value, outcome, day) for key, value in (values | {"cold_weld_factor": factor}).items()}
    }


def process_tables(outcome: Outcome, day: date) -> dict[str, Any]:
    """The settings that won; empty where none did."""
    return {"process": {key: _with_source(value, outcome, day) for key, value in outcome.won.items()}} if outcome.won else {}


def _with_source(value: Any, outcome: Outcome, day: date) -> Any:
    source = f"tiltprint coupon, {day.isoformat()}, {outcome.loads} loads, scatter {100 * outcome.scatter:.0f} %"
    return tomlkit.item(value).comment(source)
