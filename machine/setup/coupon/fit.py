"""Fit of break loads: strengths, and settings whose effect on joints exceeds the scatter; as text, tables and profiles.

The logarithm of a bar's strength is the sum of terms for its plate, its kind and, for a jointed bar, plus or minus half of each
factor's effect. Least squares find the terms; the residuals give the scatter, the same in per cent for all bars. An effect is
significant if scatter alone would produce its Student's t once in a hundred times.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from math import atan, cos, exp, isnan, log, pi, sin, sqrt
from typing import Any

import numpy as np
import tomlkit

from machine.quantities import amount, percent
from machine.setup.coupon.bars import Shape
from machine.setup.coupon.design import JOINTS, KINDS, Factor, Sheet, settings_in_words, signs
from profiles.errors import ProfileError
from profiles.material import Material

BY_CHANCE = 0.01
LEAST_FREEDOM = 3  # loads beyond the number of unknowns


@dataclass(frozen=True)
class Effect:
    """Effect of a factor on joints. ratio: strength with the other value to that with the process's own; by_chance: probability
    that scatter alone shows as much; least_ratio: smallest significant effect."""

    factor: Factor
    ratio: float
    by_chance: float
    least_ratio: float

    @property
    def significant(self) -> bool:
        """Whether the effect is significant."""
        return self.by_chance < BY_CHANCE

    @property
    def wins(self) -> bool:
        """Whether the other value is significantly better."""
        return self.significant and self.ratio > 1.0


@dataclass(frozen=True)
class Outcome:
    """Strengths in MPa of the whole section: of joints of the process and of the best joints, of bars in one piece upright and
    flat (None: not loaded). scatter: relative standard deviation of a bar's strength; loads: their number."""

    effects: tuple[Effect, ...]
    joint_mpa: float
    best_joint_mpa: float
    upright_mpa: float | None
    lying_mpa: float | None
    scatter: float
    loads: int

    @property
    def won(self) -> dict[str, object]:
        """The settings that are better than the process's own."""
        return {effect.factor.key: effect.factor.other for effect in self.effects if effect.wins}


def evaluate(sheet: Sheet) -> Outcome:
    """Strengths and effects from the loads of a sheet. Raises ProfileError for too few loads."""
    rows = [(bar, plate, load) for bar, loads in enumerate(sheet.loads_n, start=1) for plate, load in enumerate(loads)]
    rows = [row for row in rows if not isnan(row[2])]
    plates = sorted({plate for _, plate, _ in rows})
    others = [kind for kind in ("z", "x") if any(KINDS[bar - 1] == kind for bar, _, _ in rows)]
    levels = signs(len(sheet.factors))
    logarithms = np.array([log(sheet.shape.strength_mpa(load)) for _, _, load in rows])
    sought = max(1, len(plates)) + len(others) + len(sheet.factors)
    freedom = len(rows) - sought
    if freedom < LEAST_FREEDOM:
        raise ProfileError(f"{len(rows)} loads are too few for {sought} numbers: at least {sought + LEAST_FREEDOM} are needed")
    design = np.array([_row(bar, plate, plates, others, levels) for bar, plate, _ in rows])
    if np.linalg.matrix_rank(design) < sought:
        raise ProfileError("the loads do not distinguish the settings: those of more jointed bars, 1 to 8, are needed")
    found, *_ = np.linalg.lstsq(design, logarithms, rcond=None)
    scatter = sqrt(float(np.sum((logarithms - design @ found) ** 2)) / freedom)
    sigma = scatter * np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
    first = len(plates) + len(others)
    effects = tuple(
        _effect(factor, float(found[first + k]), float(sigma[first + k]), freedom) for k, factor in enumerate(sheet.factors)
    )
    middle = float(np.mean(found[: len(plates)]))
    own = middle - float(np.sum(found[first:]))
    whole = {kind: exp(middle + float(found[len(plates) + k])) for k, kind in enumerate(others)}
    better = sum(2.0 * float(found[first + k]) for k, effect in enumerate(effects) if effect.wins)
    return Outcome(effects, exp(own), exp(own + better), whole.get("z"), whole.get("x"), scatter, len(rows))


def _row(bar: int, plate: int, plates: list[int], others: list[str], levels: list[tuple[int, ...]]) -> list[float]:
    kind = KINDS[bar - 1]
    factors = levels[bar - 1] if bar <= JOINTS else (0,) * len(levels[0])
    return [*(float(plate == k) for k in plates), *(float(kind == k) for k in others), *map(float, factors)]


def _effect(factor: Factor, half: float, sigma: float, freedom: int) -> Effect:
    least = exp(2.0 * sigma * _t_of(BY_CHANCE, freedom))
    by_chance = student_beyond(abs(half) / sigma, freedom) if sigma > 0.0 else float(half == 0.0)
    return Effect(factor, exp(2.0 * half), by_chance, least)


def student_beyond(t: float, freedom: int) -> float:
    """Probability that |Student's t| with `freedom` degrees of freedom is greater: Abramowitz and Stegun, 26.7.3 and 26.7.4.

    >>> round(student_beyond(2.776, 4), 4), round(student_beyond(3.169, 10), 4), round(student_beyond(12.706, 1), 4)
    (0.05, 0.01, 0.05)
    """
    angle = atan(t / sqrt(freedom))
    term, total = (1.0, 1.0) if freedom % 2 == 0 else (cos(angle), cos(angle))
    for k in range(2 if freedom % 2 == 0 else 3, freedom - 1, 2):
        term *= cos(angle) ** 2 * (k - 1) / k
        total += term
    if freedom % 2 == 0:
        return 1.0 - sin(angle) * total
    return 1.0 - 2.0 / pi * (angle + (sin(angle) * total if freedom > 1 else 0.0))


def _t_of(beyond: float, freedom: int) -> float:
    """The t that is exceeded with a given probability, by bisection."""
    low, high = 0.0, 1000.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if student_beyond(middle, freedom) > beyond else (low, middle)
    return high


def outcome_text(outcome: Outcome) -> str:
    """Strengths, effects and scatter for the terminal."""
    lines = [f"{name}: {amount(mpa, 1)} MPa{share}" for name, mpa, share in _strengths(outcome)]
    lines += [f"{_setting(effect)}: {_verdict(effect)}" for effect in outcome.effects]
    lines.append(f"scatter: {percent(outcome.scatter, 1)} % of a bar's strength, from {outcome.loads} loads")
    return "\n".join(lines) + "\n"


def report_lines(sheet: Sheet, outcome: Outcome, version: str) -> list[str]:
    """Markdown report: what was printed and how it broke, strengths, effects, every bar."""
    how = {"machine": sheet.machine, "material": sheet.material, "process": sheet.process, "bars": bars_in_words(sheet.shape)}
    how |= {"loads": str(outcome.loads), "scatter": f"{percent(outcome.scatter, 1)} %", "tiltprint": version}
    strengths = [(name, amount(mpa, 1), share.strip(" ,")) for name, mpa, share in _strengths(outcome)]
    lines = [f"# Joints: {sheet.material} on {sheet.machine}", "", *_table(["what", "value"], list(how.items()))]
    lines += ["", *_table(["strength", "MPa", "of one piece upright"], strengths)]
    effects = []
    for effect in outcome.effects:
        chance = f"{effect.by_chance:.3f}" if effect.by_chance >= 0.001 else "< 0.001"
        effects.append((_setting(effect), f"{100 * (effect.ratio - 1.0):+.0f} %", chance, _verdict(effect)))
    lines += ["", *_table(["setting", "effect", "by chance", "so"], effects), ""]
    bars = []
    for bar, loads in enumerate(sheet.loads_n, start=1):
        known = [load for load in loads if not isnan(load)]
        loads_n = ", ".join(f"{load:g}" for load in known)
        mpa = ", ".join(amount(sheet.shape.strength_mpa(load), 1) for load in known)
        bars.append((str(bar), settings_in_words(sheet, bar), loads_n, mpa))
    return [*lines, *_table(["bar", "printed", "broke at N", "MPa"], bars)]


def bars_in_words(shape: Shape) -> str:
    """The section and its load case."""
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


def _setting(effect: Effect) -> str:
    return f"{effect.factor.key} = {effect.factor.other} instead of {effect.factor.own}"


def _verdict(effect: Effect) -> str:
    change = f"{100 * abs(effect.ratio - 1.0):.0f} % {'stronger' if effect.ratio > 1.0 else 'weaker'}"
    if effect.significant:
        return f"{change}, {effect.factor.other if effect.wins else effect.factor.own} is taken"
    least = f"{100 * (effect.least_ratio - 1.0):.0f} %"
    chance = f"{100 * (1 - BY_CHANCE):.0f} of 100 times scatter alone stays below {least}"
    return f"{change} cannot be distinguished from scatter ({chance}): {effect.factor.own} stays"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    written = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *written)]


def material_tables(outcome: Outcome, before: Material, day: date) -> dict[str, Any]:
    """Tables of a material: its strength across layers, from bars in one piece, and the fraction that the best joints reach, at
    most 1. before: material whose strength stays if no such bar was broken."""
    measured = outcome.upright_mpa is not None
    upright = round(outcome.upright_mpa, 2) if outcome.upright_mpa is not None else before.interlayer_strength_mpa
    factor = round(min(1.0, outcome.best_joint_mpa / upright), 3)
    values = {"interlayer_strength_mpa": upright} if measured else {}
    return {
        "material": {key: _with_source(value, outcome, day) for key, value in (values | {"cold_weld_factor": factor}).items()}
    }


def process_tables(outcome: Outcome, day: date) -> dict[str, Any]:
    """Tables of a process with the settings that won; {} if none did."""
    return {"process": {key: _with_source(value, outcome, day) for key, value in outcome.won.items()}} if outcome.won else {}


def _with_source(value: Any, outcome: Outcome, day: date) -> Any:
    source = f"tiltprint coupon, {day.isoformat()}, {outcome.loads} loads, scatter {100 * outcome.scatter:.0f} %"
    return tomlkit.item(value).comment(source)
