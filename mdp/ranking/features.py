"""Features: the six metrics M1..M6 of a candidate as the 2020 paper defines them, one definition for search and training.

M1 reduced risky area, M2 the same accumulated over the cuts so far, M3 volume of the part, M4 distance of the plane from the
platform, M5 distance to fragile regions (what the plane would cut into slivers, thin walls and rods, on either side of it), M6
accumulated residual risky area. Areas are shares of the model's risky area, the volume a share of the model's, distances shares
of the radius of its bounding sphere, cut to 0..1.
"""

from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats

COLUMNS = ("M1", "M2", "M3", "M4", "M5", "M6")


@dataclass(frozen=True)
class Model:
    """What the features are measured against."""

    risky_mm2: float
    volume_mm3: float
    radius_mm: float


@dataclass(frozen=True)
class Measures:
    """One candidate in numbers: its own gain, residual, volume and distances, and what the cuts before it saved and left."""

    gain_mm2: float
    residual_mm2: float
    volume_mm3: float
    above_platform_mm: float
    fragile_mm: float
    saved_before_mm2: float
    residual_before_mm2: float


def features(measures: list[Measures], model: Model) -> Floats:
    """(n, 6) rows M1..M6."""
    rows = [
        (
            one.gain_mm2 / model.risky_mm2,
            (one.saved_before_mm2 + one.gain_mm2) / model.risky_mm2,
            one.volume_mm3 / model.volume_mm3,
            min(max(one.above_platform_mm / model.radius_mm, 0.0), 1.0),
            min(max(one.fragile_mm / model.radius_mm, 0.0), 1.0),
            (one.residual_before_mm2 + one.residual_mm2) / model.risky_mm2,
        )
        for one in measures
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 6)
