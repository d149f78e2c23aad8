"""Sheets of coupons with known strengths of joints and bars, with scatter."""

import numpy as np

from machine.setup.coupon.bars import BEND, Shape
from machine.setup.coupon.design import KINDS, Factor, Sheet, signs

FACTORS = (
    Factor("interface_overlap", 0.5, 0.75),
    Factor("interface_flow", 1.1, 1.15),
    Factor("interface_temperature_add_c", 10.0, 20.0),
    Factor("interface_bottom_layers", 1, 2),
)
WHOLE_MPA = {"z": 24.0, "x": 40.0}


def broken(
    ratios: tuple[float, ...], plates: int, scatter: float = 0.0, seed: int = 0, joint_mpa: float = 12.0, shape: Shape = BEND
) -> Sheet:
    """A sheet of bars whose joints hold joint_mpa, multiplied by a ratio for each factor at its other value; every strength has
    random scatter, and each whole plate half as much."""
    random = np.random.default_rng(seed)
    rows, loads = signs(len(ratios)), [[] for _ in KINDS]
    for _ in range(plates):
        plate = random.normal(0.0, 0.5 * scatter)
        for bar, kind in enumerate(KINDS):
            mpa = WHOLE_MPA.get(kind, joint_mpa)
            if kind == "joint":
                mpa *= np.prod([ratio for ratio, sign in zip(ratios, rows[bar], strict=True) if sign > 0])
            loads[bar].append(float(mpa * np.exp(plate + random.normal(0.0, scatter)) / shape.strength_mpa(1.0)))
    return Sheet(shape, "generic_ac", "pla", "standard", FACTORS[: len(ratios)], tuple(map(tuple, loads)))
