"""Heights: where the layers of a part lie and where its mesh is cut for them."""

from dataclasses import dataclass
from math import floor

import numpy as np

from mdp.mesh import Floats
from profiles.errors import SliceError
from profiles.process import Process

LEAST_SHARE = 0.25  # a layer thinner than this share of the layer height does not come out of the nozzle evenly
MOST_LAYERS = 50_000  # ten metres of 0.2 mm; beyond that a unit or the scale is wrong
MOST_SHARE = 0.9  # of the line width: a higher bead does not stick, the bound of the process profile


@dataclass(frozen=True, eq=False)
class Heights:
    """Per layer, each (n,) mm above the base plane: the tip, the bead's height and the plane of the section."""

    tip_mm: Floats
    height_mm: Floats
    cut_mm: Floats


def heights(top_mm: float, process: Process, on_platform: bool) -> Heights:
    """Layers of a part that reaches from its base plane up to top_mm.

    A part on plastic begins pressed into it by the interface overlap: the tip of layer i = 1, 2, ... is at
    i * height - overlap. Each section is taken in the middle of what its layer fills above the base plane. The last
    layer meets the top: it is lower, or the one below is stretched when less than a quarter layer remains.
    Raises SliceError for a part that is too high to be meant.
    """
    overlap = 0.0 if on_platform else process.interface_overlap * process.layer_height_mm
    first = process.first_layer_height_mm if on_platform else process.layer_height_mm
    if top_mm > MOST_LAYERS * process.layer_height_mm:
        raise SliceError(
            f"a part {top_mm:.6g} mm high needs {top_mm / process.layer_height_mm:.0f} layers of process.layer_height_mm "
            f"{process.layer_height_mm:g} mm: at most {MOST_LAYERS} are allowed"
        )
    thick = _thicknesses(top_mm + overlap, first, process.layer_height_mm, MOST_SHARE * process.line_width_mm)
    tip = np.cumsum(thick) - overlap
    bottom = np.maximum(tip - thick, 0.0)
    return Heights(tip, thick, 0.5 * (bottom + np.minimum(tip, top_mm)))


def _thicknesses(total: float, first: float, layer: float, most: float) -> Floats:
    if total <= first:
        return np.array([max(total, LEAST_SHARE * first)])
    count = floor((total - first) / layer + 1e-9)
    thick = [first] + [layer] * count
    rest = total - first - count * layer
    if rest > LEAST_SHARE * layer:
        thick.append(rest)
    elif thick[-1] + rest <= most:
        thick[-1] += rest
    else:
        thick[-1:] = [0.5 * (thick[-1] + rest)] * 2
    return np.array(thick)
