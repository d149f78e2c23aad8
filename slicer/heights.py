"""Heights: where the layers of a part lie and where its mesh is cut for them; adaptive layers follow its surface.

A layer of height h leaves steps of depth h |n_z| on a surface with normal n, measured across the surface (Dolenc and Makela
1994, cusp height). Level surfaces have no steps but a height of their own, where a layer should end.
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

LEAST_SHARE = 0.25  # by which a layer may differ from its neighbours: thinner than this share of them it comes out unevenly
SHELL_KEYS = ("top_layers", "top_thickness_mm", "bottom_layers", "bottom_thickness_mm")
SAME_MM = 1e-5  # heights nearer than this are one: what STL files round to, 200 mm up
LEVEL = 1e-9  # of the cosine between two directions that are the same
BIN_SHARE = 0.125  # of the least layer height: slopes are known in bins of this height, each by its worst face
FLAT = 0.9998  # cosine of one degree: flatter faces count as level
LEAST_LEVEL_MM2 = 1.0  # a smaller level face is no surface that a layer should end at
MOST_BINS = 2_000_000  # 16 MB; a part 300 mm high has 24,000 at a least layer height of 0.1 mm
MOST_LAYERS = 50_000  # ten metres of 0.2 mm; beyond that a unit or the scale is wrong


@dataclass(frozen=True, eq=False)
class Heights:
    """Per layer, each (n,) mm above the base plane: the tip, the bead's height and the plane of the section."""

    tip_mm: Floats
    height_mm: Floats
    cut_mm: Floats

    @cached_property
    def bottom_mm(self) -> Floats:
        """(n,) lower sides of the layers."""
        return self.tip_mm - self.height_mm

    def __getitem__(self, layers: slice | Indices) -> "Heights":
        return Heights(self.tip_mm[layers], self.height_mm[layers], self.cut_mm[layers])

    def __add__(self, above: "Heights") -> "Heights":
        pairs = ((self.tip_mm, above.tip_mm), (self.height_mm, above.height_mm), (self.cut_mm, above.cut_mm))
        return Heights(*(np.concatenate(pair) for pair in pairs))

    def up_to(self, top_mm: float, height_mm: float) -> "Heights":
        """The layers with more of one height on top as far as that."""
        count = max(int(np.ceil((top_mm - self.tip_mm[-1]) / height_mm - 1e-9)), 0)
        tips_mm = self.tip_mm[-1] + height_mm * np.arange(1, count + 1)
        return self + Heights(tips_mm, np.full(count, height_mm), tips_mm - 0.5 * height_mm)


def layer_heights(
    mesh: Mesh, profile: Profile, on_platform: bool, pedestal_mm: float = 0.0, limb_planes_mm: Sequence[float] = ()
) -> Heights:
    """Layers of a part's mesh in its own frame, adaptive where process.adaptive_cusp_mm asks for it.

    A pedestal is sliced for itself and ends pedestal_gap_mm below the model. A layer ends in each of the limb planes: heights,
    lowest first, at which the part goes on beside limbs that are printed later; but for planes less than the least layer
    from the top or from the one below. Raises SliceError as equal_heights().
    """
    process, nozzle_mm, top_mm = profile.process, profile.machine.head.nozzle_mm, float(mesh.bounds_mm[1, 2])
    first_mm = process.first_layer_height_mm if on_platform else interface_height_mm(process)
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
    # Sections at the height of a corner lie just below it, or rounding would tell to which layer a ceiling there belongs.
    corners_mm, cuts_mm = np.sort(mesh.vertices[:, 2]), heights.cut_mm
    below, up_to = (np.searchsorted(corners_mm, cuts_mm + by_mm) for by_mm in (-SAME_MM, SAME_MM))
    return replace(heights, cut_mm=np.where(below < up_to, cuts_mm - 2.0 * SAME_MM, cuts_mm))


def part_heights(part: Part, later: Sequence[Part], profile: Profile) -> Heights:
    """The layers of a part printed before `later` ones, with the planes of limbs that are level there; profile: its own."""
    limbs = [limb.base for limb in later if limb.base.limbs_mm is not None]
    planes_mm = {base.offset_mm - part.base.offset_mm for base in limbs if float(base.normal @ part.base.normal) > 1.0 - LEVEL}
    pedestal_mm = profile.search.pedestal_mm if part.on_platform else 0.0
    return layer_heights(part.in_part_frame(), profile, part.on_platform, pedestal_mm, sorted(planes_mm))


def shell_layers(process: Process) -> tuple[int, int]:
    """Solid layers under and over a surface: as many as asked for, more where layers are thin; 0 stays 0."""
    counts = (process.top_layers, process.top_thickness_mm), (process.bottom_layers, process.bottom_thickness_mm)
    top, bottom = (max(count, ceil(mm / process.layer_height_mm - 1e-6)) if count else 0 for count, mm in counts)
    return top, bottom


def equal_heights(top_mm: float, process: Process, nozzle_mm: float, first_mm: float, from_mm: float = 0.0) -> Heights:
    """Equal layers above the first one, which has a height of its own, up to top_mm above the base plane.

    Each section is taken in the middle of its layer. The last layer meets the top: it is lower, or, where that would make it
    lower than least_layer_height_mm or a quarter layer, the last few share what remains. A part lower than the least layer is
    one of that height. Raises SliceError for a part that is too high to be meant.

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
    """Height of a first layer on plastic: a layer's less the overlap, no lower than the least layer.

    >>> interface_height_mm(Process(name="example", layer_height_mm=0.2, interface_overlap=0.5))
    0.1
    """
    least = min(process.least_layer_height_mm, process.layer_height_mm)
    return max((1.0 - process.interface_overlap) * process.layer_height_mm, least)


def _heights_from(mesh: Mesh, top: float, process: Process, nozzle_mm: float, from_mm: float, first_mm: float) -> Heights:
    """Layers from one height up to a top, the first of a height of its own."""
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
    """Layers of those heights on each other, cut in the middle of what they fill below the top."""
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
    """Layers with the last few made alike, so that they take a rest too: as few as stay between least and most and are not much
    higher than they were. All of them, none above most, where there are too few."""
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
    """(bins,) greatest |n_z| of the faces that reach into each bin."""
    worst: Floats = floats(bins, 0.0)
    for f in range(len(faces)):
        a, b, c = z[faces[f, 0]], z[faces[f, 1]], z[faces[f, 2]]
        first = max(int(np.floor(min(a, b, c) / bin_mm)), 0)
        last = min(int(np.floor(max(a, b, c) / bin_mm)), bins - 1)
        for k in range(first, last + 1):
            worst[k] = max(worst[k], leaning[f])
    return worst


def adaptive_heights(mesh: Mesh, process: Process, from_mm: float, top_mm: float) -> list[float]:
    """Heights of layers from one height up towards another, each as high as the surface beside it allows; mesh: part frame.

    Layers end at level surfaces and at the top, none is lower than least_layer_height_mm or higher than most_layer_height_mm:
    where what is left under a level is less than two of the least, one layer takes all of it, or the level is passed over where
    that one would be too high. What is left so under the top is not taken.
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
    """The highest layer from a height up that every bin it touches allows."""
    k = min(int(z_mm / bin_mm), len(most_mm) - 1)
    height = float(most_mm[k])
    while k + 1 < len(most_mm) and (k + 1) * bin_mm < z_mm + height:
        k += 1
        height = min(height, max(float(most_mm[k]), k * bin_mm - z_mm))
    return height
