"""Heights: where the layers of a part lie and where its mesh is cut for them."""

from dataclasses import dataclass
from math import floor

import numpy as np

from mdp.mesh import Floats, Mesh
from profiles.errors import SliceError
from profiles.process import Process
from slicer.adaptive_heights import adaptive_heights

LEAST_SHARE = 0.25  # a layer thinner than this share of the layer height does not come out of the nozzle evenly
MOST_LAYERS = 50_000  # ten metres of 0.2 mm; beyond that a unit or the scale is wrong
MOST_SHARE = 0.9  # of the line width: a higher bead does not stick, the bound of the process profile


@dataclass(frozen=True, eq=False)
class Heights:
    """Per layer, each (n,) mm above the base plane: the tip, the bead's height and the plane of the section."""

    tip_mm: Floats
    height_mm: Floats
    cut_mm: Floats

    @property
    def bottom_mm(self) -> Floats:
        """(n,) lower sides of the layers."""
        return self.tip_mm - self.height_mm


def layer_heights(mesh: Mesh, process: Process, on_platform: bool, pedestal_mm: float = 0.0) -> Heights:
    """Layers of a part's mesh in its own frame, adaptive where process.adaptive_cusp_mm asks for it.

    A pedestal is sliced for itself and ends pedestal_gap_mm below the model. Raises SliceError as equal_heights().
    """
    top = float(mesh.bounds_mm[1, 2])
    if process.pedestal_gap_mm < pedestal_mm < top:
        low, high = (
            equal_heights(pedestal_mm - process.pedestal_gap_mm, process, True),
            _heights_on_pedestal(mesh, process, pedestal_mm, process.first_layer_height_mm),
        )
        both = ((low.tip_mm, high.tip_mm), (low.height_mm, high.height_mm), (low.cut_mm, high.cut_mm))
        return Heights(*(np.concatenate(two) for two in both))
    if process.adaptive_cusp_mm <= 0.0:
        return equal_heights(top, process, on_platform)
    _check(top, process)
    overlap, first = _first(process, on_platform)
    if top + overlap <= first + process.least_layer_height_mm:
        return equal_heights(top, process, on_platform)
    thick = [first, *adaptive_heights(mesh, process, first - overlap, top)]
    return _stack_layers(np.array(thick), -overlap, 0.0, top)


def equal_heights(top_mm: float, process: Process, on_platform: bool) -> Heights:
    """Equal layers of a part that reaches from its base plane up to top_mm.

    A part on plastic begins pressed into it by the interface overlap: the tip of layer i = 1, 2, ... is at
    i * height - overlap. Each section is taken in the middle of what its layer fills above the base plane. The last
    layer meets the top: it is lower, or the one below is stretched when less than a quarter layer remains.
    Raises SliceError for a part that is too high to be meant.
    """
    _check(top_mm, process)
    overlap, first = _first(process, on_platform)
    thick = _thicknesses(top_mm + overlap, first, process.layer_height_mm, MOST_SHARE * process.line_width_mm)
    return _stack_layers(thick, -overlap, 0.0, top_mm)


def _heights_on_pedestal(mesh: Mesh, process: Process, from_mm: float, first_mm: float) -> Heights:
    """Layers of what stands on a pedestal."""
    top = float(mesh.bounds_mm[1, 2])
    _check(top, process)
    if process.adaptive_cusp_mm > 0.0 and top - from_mm > first_mm + process.least_layer_height_mm:
        thick = [first_mm, *adaptive_heights(mesh, process, from_mm + first_mm, top)]
        return _stack_layers(np.array(thick), from_mm, from_mm, top)
    most = MOST_SHARE * process.line_width_mm
    return _stack_layers(_thicknesses(top - from_mm, first_mm, process.layer_height_mm, most), from_mm, from_mm, top)


def _first(process: Process, on_platform: bool) -> tuple[float, float]:
    """How deep the first layer is pressed in, and its height."""
    if on_platform:
        return 0.0, process.first_layer_height_mm
    return process.interface_overlap * process.layer_height_mm, process.layer_height_mm


def _stack_layers(thick: Floats, from_mm: float, base_mm: float, top_mm: float) -> Heights:
    """Layers of those heights on each other, cut in the middle of what they fill between base and top."""
    tip = from_mm + np.cumsum(thick)
    return Heights(tip, thick, 0.5 * (np.maximum(tip - thick, base_mm) + np.minimum(tip, top_mm)))


def _check(top_mm: float, process: Process) -> None:
    layer = process.least_layer_height_mm if process.adaptive_cusp_mm > 0.0 else process.layer_height_mm
    if top_mm > MOST_LAYERS * layer:
        name = "least_layer_height_mm" if process.adaptive_cusp_mm > 0.0 else "layer_height_mm"
        raise SliceError(
            f"a part {top_mm:.6g} mm high needs {top_mm / layer:.0f} layers of process.{name} "
            f"{layer:g} mm: at most {MOST_LAYERS} are allowed"
        )


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
