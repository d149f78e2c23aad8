"""Report: what a coupon says, in words, as a Markdown table that others can compare with, and as tables of the material's and
the process's profile.
"""

from collections.abc import Sequence
from datetime import date
from math import isnan
from typing import Any

import tomlkit

from machine.setup.coupon.bars import Shape
from machine.setup.coupon.fit import BY_CHANCE, Effect, Outcome
from machine.setup.coupon.sheet import Sheet, settings_in_words
from profiles.material import Material


def outcome_text(outcome: Outcome) -> str:
    """Strengths, effects and scatter for the terminal."""
    lines = [f"{name}: {mpa:.1f} MPa{share}" for name, mpa, share in _strengths(outcome)]
    lines += [f"{_setting(effect)}: {_verdict(effect)}" for effect in outcome.effects]
    lines.append(f"scatter: {100 * outcome.scatter:.1f} % of a bar's strength, from {outcome.loads} loads")
    return "\n".join(lines) + "\n"


def report_lines(sheet: Sheet, outcome: Outcome, version: str) -> list[str]:
    """The Markdown page: what was printed and broken how, strengths, effects, every bar."""
    lines = [f"# Joints: {sheet.material} on {sheet.machine}", ""]
    how = [
        ("machine", sheet.machine),
        ("material", sheet.material),
        ("process", sheet.process),
        ("bars", bars_in_words(sheet.shape)),
    ]
    how += [("loads", str(outcome.loads)), ("scatter", f"{100 * outcome.scatter:.1f} %"), ("tiltprint", version)]
    lines += _table(["what", "value"], how)
    lines += [
        "",
        *_table(
            ["strength", "MPa", "of one piece upright"], [(n, f"{m:.1f}", s.strip(" ,") or "") for n, m, s in _strengths(outcome)]
        ),
    ]
    effects = [(_setting(e), f"{100 * (e.ratio - 1.0):+.0f} %", _chance(e), _verdict(e)) for e in outcome.effects]
    lines += ["", *_table(["setting", "effect", "by chance", "so"], effects), ""]
    bars = []
    for bar, loads in enumerate(sheet.loads_n, start=1):
        known = [load for load in loads if not isnan(load)]
        strengths = ", ".join(f"{sheet.shape.strength_mpa(load):.1f}" for load in known)
        bars.append((str(bar), settings_in_words(sheet, bar), ", ".join(f"{load:g}" for load in known), strengths))
    return [*lines, *_table(["bar", "printed", "broke at N", "MPa"], bars)]


def bars_in_words(shape: Shape) -> str:
    """The section and how it is stressed."""
    section = f"{shape.depth_mm:g} x {shape.thickness_mm:g} mm"
    if shape.lever_mm > 0.0:
        return f"bent, {section}, {shape.lever_mm:g} mm from the joint: 6 F L / (b d^2), d = {shape.depth_mm:g} mm"
    return f"pulled, ISO 527-2 5A in outline, {section}: F / A"


def _strengths(outcome: Outcome) -> list[tuple[str, float, str]]:
    upright = outcome.upright_mpa

    def share(mpa: float) -> str:
        return f", {100 * mpa / upright:.0f} %" if upright else ""

    rows = [("joint as the process has it", outcome.joint_mpa, share(outcome.joint_mpa))]
    if outcome.won:
        rows.append(("joint with what won", outcome.best_joint_mpa, share(outcome.best_joint_mpa)))
    if upright is not None:
        rows.append(("in one piece, upright", upright, ""))
    if outcome.lying_mpa is not None:
        rows.append(("in one piece, lying", outcome.lying_mpa, share(outcome.lying_mpa)))
    return rows


def _chance(effect: Effect) -> str:
    return f"{effect.by_chance:.3f}" if effect.by_chance >= 0.001 else "< 0.001"


def _setting(effect: Effect) -> str:
    return f"{effect.factor.key} = {effect.factor.other} instead of {effect.factor.own}"


def _verdict(effect: Effect) -> str:
    change = f"{100 * abs(effect.ratio - 1.0):.0f} % {'stronger' if effect.ratio > 1.0 else 'weaker'}"
    if effect.told:
        return f"{change}, {effect.factor.other if effect.wins else effect.factor.own} is taken"
    least = f"{100 * (effect.least_ratio - 1.0):.0f} %"
    chance = f"{100 * (1 - BY_CHANCE):.0f} of 100 times scatter alone stays below {least}"
    return f"{change} is not told from scatter ({chance}): {effect.factor.own} stays"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    written = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *written)]


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
