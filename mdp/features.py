"""Features: the six metrics M1..M6 of a candidate as the 2020 paper defines them, one definition for search and training.

M1 reduced risky area, M2 the same accumulated over the cuts so far, M3 volume of the part, M4 distance of the plane from the
platform, M5 distance to fragile regions, M6 accumulated residual risky area. Areas are shares of the model's risky area, the
volume a share of the model's, distances shares of the radius of its bounding sphere, cut to 0..1.
"""

from dataclasses import dataclass

import numpy as np

from mdp.candidates import Candidates
from mdp.mesh import Floats


@dataclass(frozen=True)
class Model:
    """What the features are measured against."""

    risky_mm2: float
    volume_mm3: float
    radius_mm: float


def features(candidates: Candidates, model: Model, saved_mm2: float, residual_mm2: float) -> Floats:
    """(n, 6) rows M1..M6; saved_mm2 and residual_mm2 are what the cuts so far have made safe and left risky."""
    m1 = candidates.gain_mm2 / model.risky_mm2
    m4 = np.clip(candidates.above_platform_mm / model.radius_mm, 0.0, 1.0)
    m5 = np.clip(candidates.fragile_mm / model.radius_mm, 0.0, 1.0)
    m6 = (residual_mm2 + candidates.residual_mm2) / model.risky_mm2
    return np.stack([m1, m1 + saved_mm2 / model.risky_mm2, candidates.volume_mm3 / model.volume_mm3, m4, m5, m6], axis=1)
