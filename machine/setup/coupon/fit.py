"""Fit: what the break loads of a coupon say: strengths, and which settings make joints stronger than their scatter can.

The logarithm of a bar's strength is a sum: of the plate it was printed on, its kind, and for a jointed bar half of each factor's
effect, up or down. Least squares find them, what is left over is the scatter, the same in per cent for all bars. An effect counts
where Student's t of it would come from scatter alone once in a hundred times.
"""

from dataclasses import dataclass
from math import atan, cos, exp, isnan, log, pi, sin, sqrt

import numpy as np

from machine.setup.coupon.design import JOINTS, KINDS, Factor, signs
from machine.setup.coupon.sheet import Sheet
from profiles.errors import ProfileError

BY_CHANCE = 0.01
LEAST_FREEDOM = 3  # loads beyond the numbers that are sought


@dataclass(frozen=True)
class Effect:
    """How many times as much a joint holds with a factor's other value as with the process's own; how often scatter alone would
    show as much; and how large an effect must be to be told from scatter."""

    factor: Factor
    ratio: float
    by_chance: float
    least_ratio: float

    @property
    def told(self) -> bool:
        """Whether it is more than scatter."""
        return self.by_chance < BY_CHANCE

    @property
    def wins(self) -> bool:
        """Whether the other value is the better one."""
        return self.told and self.ratio > 1.0


@dataclass(frozen=True)
class Outcome:
    """Strengths in MPa, of the whole section: of joints as the process makes them and with what won, of bars in one piece upright
    and lying (None: no load is told); scatter: standard deviation of a bar's strength, share of it; how many loads tell it."""

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
    """Strengths and effects from the loads of a sheet. Raises ProfileError where they are too few."""
    rows = [(bar, plate, load) for bar, loads in enumerate(sheet.loads_n, start=1) for plate, load in enumerate(loads)]
    rows = [row for row in rows if not isnan(row[2])]
    plates = sorted({plate for _, plate, _ in rows})
    others = [kind for kind in ("z", "x") if any(KINDS[bar - 1] == kind for bar, _, _ in rows)]
    levels = signs(len(sheet.factors))
    told = np.array([log(sheet.shape.strength_mpa(load)) for _, _, load in rows])
    sought = max(1, len(plates)) + len(others) + len(sheet.factors)
    freedom = len(rows) - sought
    if freedom < LEAST_FREEDOM:
        raise ProfileError(f"{len(rows)} loads are too few for {sought} numbers: at least {sought + LEAST_FREEDOM} are needed")
    design = np.array([_row(bar, plate, plates, others, levels) for bar, plate, _ in rows])
    if np.linalg.matrix_rank(design) < sought:
        raise ProfileError("the loads do not tell the settings apart: those of more jointed bars, 1 to 8, are needed")
    found, *_ = np.linalg.lstsq(design, told, rcond=None)
    scatter = sqrt(float(np.sum((told - design @ found) ** 2)) / freedom)
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
    """How often |Student's t| with `freedom` degrees of freedom is greater: Abramowitz and Stegun, 26.7.3 and 26.7.4.

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
    """The t beyond which that share lies, by halving."""
    low, high = 0.0, 1000.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if student_beyond(middle, freedom) > beyond else (low, middle)
    return high
