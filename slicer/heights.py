"""Layer heights: the layers of a part and the heights at which its mesh is cut for them; adaptive layers follow its surface.

A layer of height h leaves steps of depth h |n_z| on a surface with normal n, measured across the surface (Dolenc and Makela 1994,
cusp height). Level surfaces have no steps, but a layer should end at their height.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, floor

import numpy as np

from mdp.decomposition import Part
from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices, Ints, Mesh
from profiles.errors import SliceError
from profiles.messages import key_name
from profiles.process import Process
from profiles.profile import Profile

LEAST_SHARE = 0.25  # share of a neighbour's height: thinner layers print unevenly
SHELL_KEYS = ("top_layers", "top_thickness_mm", "bottom_layers", "bottom_thickness_mm")
SAME_MM = 1e-5  # heights that differ less are equal: STL files round to this, 200 mm up
LEVEL = 1e-9  # tolerance on the cosine between two equal directions
BIN_SHARE = 0.125  # share of the least layer height: height of the bins in which slopes are recorded, by their worst face
FLAT = 0.9998  # cosine of one degree: flatter faces count as level
LEAST_LEVEL_MM2 = 1.0  # a layer need not end at a smaller level face
MOST_BINS = 2_000_000  # 16 MB; a part 300 mm high has 24,000 at a least layer height of 0.1 mm
MOST_LAYERS = 50_000  # ten metres of 0.2 mm; more means a wrong unit or scale


@dataclass(frozen=True, eq=False)
class Heights:
    """Layers, each (n,) mm above the base plane: height of the tip, height of the bead, and plane of the section."""

    tip_mm: Floats
    height_mm: Floats
    cut_mm: Floats

    @cached_property
    def bottom_mm(self) -> Floats:
        """(n,) heights of the layers' lower sides."""
        return self.tip_mm - self.height_mm

    def __getitem__(self, layers: slice | Indices) -> "Heights":
        return Heights(self.tip_mm[layers], self.height_mm[layers], self.cut_mm[layers])

    def __add__(self, above: "Heights") -> "Heights":
        pairs = ((self.tip_mm, above.tip_mm), (self.height_mm, above.height_mm), (self.cut_mm, above.cut_mm))
        return Heights(*(np.concatenate(pair) for pair in pairs))

    def up_to(self, top_mm: float, height_mm: float) -> "Heights":
        """The layers, extended up to a top with layers of one height."""
        count = max(int(np.ceil((top_mm - self.tip_mm[-1]) / height_mm - 1e-9)), 0)
        tips_mm = self.tip_mm[-1] + height_mm * np.arange(1, count + 1)
        return self + Heights(tips_mm, np.full(count, height_mm), tips_mm - 0.5 * height_mm)


def layer_heights(
    mesh: Mesh, profile: Profile, on_plate: bool, pedestal_mm: float = 0.0, limb_planes_mm: Sequence[float] = ()
) -> Heights:
    """The layers of a part's mesh in the part frame, adaptive if process.adaptive_cusp_mm is set.

    A pedestal is sliced separately and ends pedestal_gap_mm below the model. A layer ends at each of limb_planes_mm, the
    ascending heights at which the part continues beside limbs that are printed later, unless that is closer than the least layer
    to the top or to the plane below. Raises SliceError like equal_heights().
    """
    process, nozzle_mm, top_mm = profile.process, profile.machine.head.nozzle_mm, float(mesh.bounds_mm[1, 2])
    first_mm = process.first_layer_height_mm if on_plate else interface_height_mm(process)
    from_mm, heights = 0.0, Heights(*np.zeros((3, 0)))
    roof_mm = pedestal_mm - process.pedestal_gap_mm
    if pedestal_mm < top_mm and roof_mm >= process.least_layer_height_mm:
        heights = equal_heights(roof_mm, process, nozzle_mm, first_mm)
        from_mm = pedestal_mm
    for plane_mm in limb_planes_mm:
        if min(plane_mm - from_mm, top_mm - plane_mm) >= process.least_layer_height_mm:
            heights += _heights_from(mesh, plane_mm, process, nozzle_mm, from_mm, first_mm)
            from_mm, first_mm = plane_mm, process.layer_height_mm
    heights += _heights_from(mesh, top_mm, process, nozzle_mm, from_mm, first_mm)
    # Sections at the height of a corner are taken just below it, otherwise rounding would decide the layer of a ceiling there.
    corners_mm, cuts_mm = np.sort(mesh.vertices[:, 2]), heights.cut_mm
    below, up_to = (np.searchsorted(corners_mm, cuts_mm + by_mm) for by_mm in (-SAME_MM, SAME_MM))
    return replace(heights, cut_mm=np.where(below < up_to, cuts_mm - 2.0 * SAME_MM, cuts_mm))


def part_heights(part: Part, later: Sequence[Part], profile: Profile) -> Heights:
    """The layers of a part printed before `later` parts, with the planes of limbs that are level in its frame. profile: the
    part's own.
    """
    limbs = [limb.base for limb in later if limb.base.limbs_mm is not None]
    planes_mm = {base.offset_mm - part.base.offset_mm for base in limbs if float(base.normal @ part.base.normal) > 1.0 - LEVEL}
    pedestal_mm = profile.search.pedestal_mm if part.on_plate else 0.0
    return layer_heights(part.in_part_frame(), profile, part.on_plate, pedestal_mm, sorted(planes_mm))


def shell_layers(process: Process) -> tuple[int, int]:
    """Numbers of solid layers below a top and above a bottom: the configured ones, more if layers are thin; 0 stays 0."""
    counts = (process.top_layers, process.top_thickness_mm), (process.bottom_layers, process.bottom_thickness_mm)
    top, bottom = (max(count, ceil(mm / process.layer_height_mm - 1e-6)) if count else 0 for count, mm in counts)
    return top, bottom


def equal_heights(top_mm: float, process: Process, nozzle_mm: float, first_mm: float, from_mm: float = 0.0) -> Heights:
    """Equal layers above a first layer of another height, up to top_mm above the base plane.

    Each section is taken in the middle of its layer. The last layer meets the top: it is lower, or, if that would make it lower
    than least_layer_height_mm or a quarter layer, the last few share the remainder. A part lower than the least layer becomes one
    layer of that height. Raises SliceError for an implausibly high part.

    >>> equal_heights(0.9, Process(name="example"), 0.4, 0.3).tip_mm.round(6).tolist()
    [0.3, 0.5, 0.7, 0.9]
    """
    _check(top_mm, process)
    layer, total, most = process.layer_height_mm, top_mm - from_mm, min(process.highest_layer_mm, nozzle_mm)
    count = max(floor((total - first_mm) / layer + 1e-9), 0)
    rest = total - first_mm - count * layer
    least = min(max(process.least_layer_height_mm, LEAST_SHARE * layer), layer)
    thick = [layer] * count
    if rest <= 0.0 and not count:
        first_mm = max(total, min(process.least_layer_height_mm, first_mm))
    elif rest >= least - 1e-9:
        thick.append(rest)
    elif count:
        thick = _spread(thick, rest, least, most)
    else:
        first_mm, *thick = _spread([first_mm], rest, least, most)
    return _stack_layers([first_mm, *thick], from_mm, top_mm)


def interface_height_mm(process: Process) -> float:
    """Height of a first layer on plastic, mm: a layer less the overlap, no lower than the least layer.

    >>> interface_height_mm(Process(name="example", layer_height_mm=0.2, interface_overlap=0.5))
    0.1
    """
    least = min(process.least_layer_height_mm, process.layer_height_mm)
    return max((1.0 - process.interface_overlap) * process.layer_height_mm, least)


def _heights_from(mesh: Mesh, top: float, process: Process, nozzle_mm: float, from_mm: float, first_mm: float) -> Heights:
    """Layers from one height up to a top, with a separate height of the first one."""
    least = process.least_layer_height_mm
    _check(top, process)
    adaptive = process.adaptive_cusp_mm > 0.0 and top - from_mm > first_mm + least
    thick = adaptive_heights(mesh, process, from_mm + first_mm, top) if adaptive else []
    if not thick:
        return equal_heights(top, process, nozzle_mm, first_mm, from_mm)
    rest = top - from_mm - first_mm - sum(thick)
    if rest > 1e-6:
        thick = _spread(thick, rest, least, process.most_layer_height_mm)
    return _stack_layers([first_mm, *thick], from_mm, top)


def _stack_layers(thick_mm: list[float], from_mm: float, top_mm: float) -> Heights:
    """Stack layers of given heights; each is cut in the middle of its part below the top."""
    thick, tip = np.array(thick_mm), from_mm + np.cumsum(thick_mm)
    return Heights(tip, thick, 0.5 * (tip - thick + np.minimum(tip, top_mm)))


def _check(top_mm: float, process: Process) -> None:
    name = "least_layer_height_mm" if process.adaptive_cusp_mm > 0.0 else "layer_height_mm"
    layer = getattr(process, name)
    if top_mm > MOST_LAYERS * layer:
        raise SliceError(
            f"a part {top_mm:.6g} mm high needs {top_mm / layer:.0f} layers of {key_name(f'process.{name}')} "
            f"{layer:g} mm: at most {MOST_LAYERS} are allowed"
        )


def _spread(thick: list[float], rest: float, least: float, most: float) -> list[float]:
    """Spread a remainder over the last few layers, made equal: as few as stay between least and most and are not much higher than
    before; over all of them, none above most, if there are too few.
    """
    total = rest
    for tail, last in enumerate(reversed(thick), 1):
        total += last
        highest = min(most, (1.0 + LEAST_SHARE) * max(thick[-tail:]))
        count = ceil(total / highest - 1e-9)
        if total / count >= least - 1e-9:
            return [*thick[:-tail], *[total / count] * count]
    count = ceil(total / most - 1e-9)
    return [total / count] * count


@kernel
def _worst(z: Floats, faces: Ints, leaning: Floats, bin_mm: float, bins: int) -> Floats:
    """(bins,) greatest |n_z| of the faces that extend into each bin."""
    worst: Floats = floats(bins, 0.0)
    for f in range(len(faces)):
        a, b, c = z[faces[f, 0]], z[faces[f, 1]], z[faces[f, 2]]
        first = max(int(np.floor(min(a, b, c) / bin_mm)), 0)
        last = min(int(np.floor(max(a, b, c) / bin_mm)), bins - 1)
        for k in range(first, last + 1):
            worst[k] = max(worst[k], leaning[f])
    return worst


def adaptive_heights(mesh: Mesh, process: Process, from_mm: float, top_mm: float) -> list[float]:
    """Heights of layers from one height up towards another, each as high as the surface beside it allows. mesh: in the part
    frame.

    Layers end at level surfaces and at the top, none lower than least_layer_height_mm or higher than most_layer_height_mm: a
    remainder under a level of less than two least layers becomes one layer, or the level is skipped if that layer would be too
    high. Such a remainder under the top is left to the caller.
    """
    least_mm, highest_mm = process.least_layer_height_mm, float(mesh.bounds_mm[1, 2])
    leaning = np.abs(mesh.normals[:, 2])
    level, bin_mm = leaning > FLAT, max(BIN_SHARE * least_mm, highest_mm / MOST_BINS)
    steepest = _worst(mesh.vertices[:, 2], mesh.faces[~level], leaning[~level], bin_mm, int(highest_mm / bin_mm) + 1)
    most_mm = np.clip(process.adaptive_cusp_mm / np.maximum(steepest, 1e-9), least_mm, process.most_layer_height_mm)
    levels_mm, which = np.unique(np.round(mesh.vertices[mesh.faces[level, 0], 2], 6), return_inverse=True)
    wide = np.bincount(which, mesh.areas_mm2[level], len(levels_mm)) >= LEAST_LEVEL_MM2
    stops = [stop for stop in levels_mm[wide].tolist() if from_mm < stop < top_mm - least_mm] + [top_mm]
    thick: list[float] = []
    z = from_mm
    for stop in stops:
        if stop - z < least_mm and stop < top_mm:
            continue
        while stop - z > 1e-9:
            height, left = _highest(most_mm, bin_mm, z), stop - z
            if process.most_layer_height_mm + 1e-9 < left < 2.0 * least_mm:
                break
            if left <= height + 1e-9 or left < 2.0 * least_mm:
                height = left
            elif left < height + least_mm:
                height = 0.5 * left
            thick.append(height)
            z += height
    return thick


def _highest(most_mm: Floats, bin_mm: float, z_mm: float) -> float:
    """Greatest height of a layer from a given height that every bin it touches allows."""
    k = min(int(z_mm / bin_mm), len(most_mm) - 1)
    height = float(most_mm[k])
    while k + 1 < len(most_mm) and (k + 1) * bin_mm < z_mm + height:
        k += 1
        height = min(height, max(float(most_mm[k]), k * bin_mm - z_mm))
    return height
