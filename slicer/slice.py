"""Slicing: from the parts of a decomposition to layers of paths, in the part frames.

A straight chain of values: a part's sections (slicer.sectioning), their overhangs (slicer.overhangs), their support
(slicer.support), the shells of every layer and its beads (slicer.shells), and the ordered strokes with speed and flow
(slicer.strokes).

First the support of all parts is planned together, since the base of one part's support may be printed with another part. After
that, a part's paths depend only on the plan and the profile, so the result is identical for any number of processes. If one part
makes up most of the print, its layers are computed in parallel instead.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, pi
from mmap import mmap

import numpy as np

from mdp.decomposition import Part
from mdp.kernels.processes import parallel_map
from mdp.mesh import Floats
from profiles.errors import SliceError
from profiles.messages import key_name, phrase
from profiles.profile import Profile
from slicer.bead import BEFORE_WALLS, FILL, LAST, OUTSIDE, Bead
from slicer.fill.ends import CARRYING, Plastic, cut_anchors, hold_ends, plastic_of
from slicer.geometry.polygons import Polygons, offset
from slicer.geometry.polyline import length_mm
from slicer.heights import shell_layers
from slicer.interface.interface import pin_width_mm, visible_wall_beside
from slicer.overhangs import Overhang, find_overhangs
from slicer.paths import KINDS, ON_PLATE_MM, SKINS, Kind, Layer, SlicedPart, bead_area_mm2
from slicer.raft import raft_layers
from slicer.sectioning import Sections, section_part, section_parts
from slicer.shells import FEWEST_LAYERS, Shells, build_shells, interface_mm3, lay_beads
from slicer.strokes.order import order_beads
from slicer.strokes.seam import NO_SEAMS, Surroundings, place_seams
from slicer.strokes.seam_plan import plan_seams, rear_of, seam_limits
from slicer.strokes.speed import first_layer_speeds, kinds_apart, layer_of, rising_fan, timed
from slicer.strokes.strokes import Strokes, split, split_overhangs
from slicer.strokes.vase import vase_layers
from slicer.support.from_earlier_part import plan_supports
from slicer.support.support import Supports, explain, own_supports
from slicer.walls.walls import fuzzy_walls

FEWEST_IN_ALL = 250  # layers; fewer are sliced faster than processes can be forked and their paths returned
LARGEST_SHARE = 0.6  # share of all layers: if a part has more of them, the other parts end long before it
PIN_RANK = OUTSIDE - 1  # pins come before everything else in a layer
PIN_CHORDS = 12  # chords of the circle that the tip describes at a pin
# cross-section of a pin's stroke, in squares of the nozzle diameter: Klipper refuses 4 (max_extrude_cross_section)
PIN_MOST_AREA = 3.0


@dataclass(frozen=True, eq=False)
class SlicingProgress:
    """Progress of slicing by part, in print order: completed layers, expected layers, and the sliced parts."""

    layers: tuple[int, ...]
    expected: tuple[int, ...]
    ready: tuple[SlicedPart | None, ...]

    @property
    def begun(self) -> int:
        """The number of parts that are sliced or being sliced."""
        return sum(count > 0 for count in self.layers)

    @property
    def share(self) -> float:
        """Monotone progress estimate over all layers, 0 to 1; a part may end with fewer layers than expected."""
        pieces = zip(self.layers, self.expected, self.ready, strict=True)
        return sum(of if piece else min(count, of) for count, of, piece in pieces) / max(sum(self.expected), 1)


def slice_parts(
    parts: Sequence[Part], profile: Profile, on_progress: Callable[[SlicingProgress], None] | None = None
) -> tuple[SlicedPart, ...]:
    """Slice all parts. on_progress: called periodically.

    Raises SliceError like slice_part, for the first part in print order that fails.
    """
    if not parts:
        return ()
    models = sum(part.on_plate for part in parts)
    if profile.process.spiral_vase and models > 1:
        raise SliceError(f"{key_name('process.spiral_vase')} climbs round one model, {models} are on the plate")
    if profile.process.spiral_vase and len(parts) > 1:
        raise SliceError(
            f"{key_name('process.spiral_vase')} climbs round a model in one part, this one is in {len(parts)}: "
            f"{phrase('one part', '--parts 1 prints it in one piece')}"
        )
    sections = section_parts(parts, profile)
    overhangs = [find_overhangs(layers) for layers in sections]
    supports = plan_supports([own_supports(*pair) for pair in zip(sections, overhangs, strict=True)])
    expected = [len(support.areas) for support in supports]
    layers = np.frombuffer(mmap(-1, 4 * len(parts)), np.int32)  # numbers of completed layers, shared with other processes
    ready: list[SlicedPart | None] = [None] * len(parts)
    errors: dict[int, SliceError] = {}
    largest_first = sorted(range(len(parts)), key=lambda k: (-expected[k], k))  # so that no large one is left for the end
    here = os.getpid()

    def show() -> None:
        if on_progress is not None and os.getpid() == here:
            on_progress(SlicingProgress(tuple(layers.tolist()), tuple(expected), tuple(ready)))

    def sliced(place: int) -> SlicedPart | SliceError:
        k = largest_first[place]

        def on_layer(done: int) -> None:
            layers[k] = done
            show()

        try:
            return slice_supported(supports[k], overhangs[k], on_layer)
        except SliceError as error:
            return error

    by_layers = max(expected) > LARGEST_SHARE * sum(expected) or sum(expected) < FEWEST_IN_ALL
    count = len(parts)
    results = map(sliced, range(count)) if by_layers else parallel_map(sliced, count, helps=False, on_wait=show)
    for k, result in zip(largest_first, results, strict=True):
        if isinstance(result, SliceError):
            errors[k] = result
        else:
            ready[k] = result
            layers[k] = len(result.layers)
            show()
    if errors:
        raise errors[min(errors)]
    return tuple(piece for piece in ready if piece is not None)


def slice_part(part: Part, profile: Profile, earlier: Sequence[Part] = (), later: Sequence[Part] = ()) -> SlicedPart:
    """The part's layers from its base plane upward.

    earlier, later: the parts printed before and after this one; the part with index 1 stands on the build plate. Support is the
    part's own (slice_parts also plans support on earlier parts). Equal input gives equal paths. Raises SliceError if the part
    gives no bead at all.

    >>> from manifold3d import Manifold
    >>> from mdp.cut import mesh_of
    >>> from mdp.plane import PLATFORM
    >>> from mdp.pose import level, rotation
    >>> from profiles.profile import load
    >>> profile, plate = load(), mesh_of(Manifold.cube((20.0, 20.0, 1.0)))
    >>> pose = level(profile.machine)
    >>> part = Part(1, plate, PLATFORM, pose, rotation(profile.machine, pose), plate.volume_mm3, 0.0)
    >>> [round(layer.z_mm, 3) for layer in slice_part(part, profile).layers]
    [0.2, 0.4, 0.6, 0.8, 1.0]
    """
    sections = section_part(part, profile, earlier, later)
    overhangs = find_overhangs(sections)
    return slice_supported(own_supports(sections, overhangs), overhangs)


def slice_supported(
    supports: Supports, overhangs: Sequence[Overhang], on_layer: Callable[[int], None] = lambda done: None
) -> SlicedPart:
    """The layers of a part with its planned support, like slice_part. on_layer: called with the number of completed layers."""
    shells = build_shells(supports, overhangs)
    sections, process = supports.sections, supports.sections.process
    rear, edges = rear_of(sections.mesh.bounds_mm), sections.joints
    rows = zip(sections.no_seam, sections.heights.cut_mm, strict=True)
    limits = [seam_limits(edges, unwanted, z_mm, process) for unwanted, z_mm in rows]
    aligned = process.seam == "aligned" and process.walls > 0
    planned = plan_seams(sections, limits) if aligned else [NO_SEAMS] * len(limits)
    layers, raft = list[Layer](), [layer for layer in raft_layers(supports) if len(layer)]
    below: list[Plastic | None] = []
    bare: list[int] = []  # layers with material of which nothing is printed
    tip, seams, last, count = raft[-1].points[-1] if raft else rear, np.zeros((0, 2)), 0, len(sections.outlines)
    usual = min(max(1, shell_layers(process)[1]), count) if process.spiral_vase else count
    for i, (own, auxiliary) in enumerate(parallel_map(partial(lay_beads, shells), usual, FEWEST_LAYERS)):
        if own:
            last = i
        elif process.walls and (i in sections.too_thin or not sections.own[i].is_empty()):
            bare.append(i)
        around = Surroundings(rear, seams, tip, limits[i], i, planned[i])
        beads, seams = place_seams([*own, *auxiliary], process, around)
        if i:
            beads = hold_ends(beads, below[0], sections.own[i], sections.own[i - 1], process.line_width_mm)
            beads = cut_anchors(beads, below)
        below = [plastic_of([*beads, *shells.layers[i].ending]), *below][:CARRYING]
        if i and process.fuzzy_skin != "none":
            beads = fuzzy_walls(beads, process, _joints_near(sections, i), (sections.part.index, i))
        skin = visible_wall_beside(edges, sections.outlines[i], float(sections.heights.cut_mm[i]), shells.layers[i].process)
        layer = _ordered([*beads, *shells.layers[i].ending], shells, i, tip if layers or raft else None, skin)
        if len(layer):
            tip = layer.points[-1]
            layers.append(layer)
        on_layer(i + 1)
    if usual < count:
        turns = vase_layers(sections, supports.areas, usual, tip)
        layers += turns
        bare, last = [*range(usual + len(turns), count)], count
    _check_printed(sections, layers)
    too_thin = [i for i in bare if i < last]
    layers = [*raft, *layers]
    return SlicedPart(
        sections.part.index,
        tuple(layers),
        explain(supports, np.array([layer.z_mm for layer in layers])),
        interface_mm3(shells),
        len(too_thin),
        float((sections.heights.tip_mm if usual == count else sections.heights.bottom_mm)[too_thin[0]]) if too_thin else 0.0,
        len(sections.pins),
    )


def _joints_near(sections: Sections, layer: int) -> list[Polygons]:
    """The areas of other parts in a layer and in its neighbours."""
    near = [*sections.beside, *sections.above[:1]][max(layer - 1, 0) : layer + 2]
    return [area for area in (*near, *sections.standing[layer : layer + 1]) if not area.is_empty()]


def _ordered(beads: list[Bead], shells: Shells, index: int, tip: Floats | None, skin: Polygons) -> Layer:
    """The layer of some beads in order, with speeds, flow, fan and temperature, see order_layer."""
    sections = shells.sections
    profile, process, material, heights = sections.profile, sections.process, sections.profile.material, sections.heights
    strokes, speeds, flow = order_layer(beads, shells, index, tip, skin)
    fan, add_c = 1.0, 0.0
    if sections.on_plate:
        fan = rising_fan(material, index + process.raft_layers)
        add_c = material.first_layer_nozzle_c - material.nozzle_c if index == 0 and not sections.on_raft else 0.0
    elif index < process.interface_layers:
        fan = process.interface_fan if index else process.interface_first_layer_fan
        add_c = process.interface_temperature_add_c
    z_mm, height_mm = float(heights.tip_mm[index]), float(heights.height_mm[index])
    return layer_of(strokes, speeds, profile, z_mm=z_mm, height_mm=height_mm, flow=flow, fan=fan, add_c=add_c, skin=skin)


def order_layer(
    beads: list[Bead], shells: Shells, index: int, tip: Floats | None, skin: Polygons
) -> tuple[Strokes, Floats, float]:
    """The beads of a layer in order, with their (k,) speeds and the common flow.

    tip: end of the layer below; skin: visible wall beside joints.
    """
    sections, own, height_mm = shells.sections, shells.layers[index].process, float(shells.sections.heights.height_mm[index])
    profile, process, outline = sections.profile, sections.process, sections.outlines[index]
    if index == 0 and not sections.on_plate:
        beads = [*fill_pins(sections.pins, profile, height_mm), *begin_inside(beads)]
    first_flow, kind_mm_s = (1.0, None) if index else _first_layer(sections)
    strokes = order_beads(beads, outline, own, tip, shells.supports.areas[index], skin, kind_mm_s)
    below = sections.below(index)
    if below is not None and own.fuzzy_skin != "none":
        below = offset(below, own.fuzzy_skin_thickness_mm)  # rough walls lie on rough walls
    strokes = split_overhangs(strokes, outline, below, own, shells.supports.right_under(index))
    if index == 0 and not sections.grooves.is_empty():
        strokes, within = split(strokes, sections.grooves, strokes.is_of(*SKINS), process.line_width_mm)
        richer = 1.0 + process.interlock_mm / height_mm  # extra flow to fill the grooves
        strokes = replace(strokes, flow=np.where(within, strokes.flow * richer, strokes.flow))
    places = sections.speed_places if index else []  # first layers have their own speeds
    of_places = [place.over(process) for place in places]
    kinds = kinds_apart([process, *of_places])
    for number, place in enumerate(places, start=1):
        if kinds and not place.areas[index].is_empty():
            strokes, within = split(strokes, place.areas[index], strokes.is_of(*kinds), process.line_width_mm)
            strokes = replace(strokes, place=np.where(within, number, strokes.place).astype(np.int16))
    flow = profile.material.flow * first_flow
    return *timed(strokes, profile, height_mm, kind_mm_s, flow, of_places), flow


def _first_layer(sections: Sections) -> tuple[float, Floats]:
    """The flow of a part's first layer and its speeds by kind, on the plate, on a raft or on plastic."""
    process = sections.process
    if sections.on_raft:
        return 1.0, np.full(len(KINDS), process.first_layer_speed_over_raft_mm_s)
    if sections.on_plate:
        return process.first_layer_flow, first_layer_speeds(process)
    return process.interface_flow, np.full(len(KINDS), process.interface_speed_mm_s)


def fill_pins(pins: Floats, profile: Profile, height_mm: float) -> list[Bead]:
    """The strokes that fill a part's pins: circles in the mouth, enough of them to keep the cross-section below the limit of
    every firmware.
    """
    process, nozzle_mm = profile.process, profile.machine.head.nozzle_mm
    radius = 0.5 * (pin_width_mm(profile) - nozzle_mm)
    beads = []
    for x, y, mm3 in pins.tolist():
        rounds = max(ceil(mm3 / (PIN_MOST_AREA * nozzle_mm**2 * 2.0 * pi * radius)), 1)
        turn = 2.0 * pi * np.arange(rounds * PIN_CHORDS + 1) / PIN_CHORDS
        ring = radius * np.column_stack([np.cos(turn), np.sin(turn)])
        points = np.vstack([np.zeros((1, 2)), ring]) + np.array([x, y])
        bead_mm3 = length_mm(points) * bead_area_mm2(process.line_width_mm, height_mm) * process.interface_flow
        beads.append(Bead(Kind.GAP, points, process.line_width_mm, PIN_RANK, mm3 / bead_mm3))
    return beads


def begin_inside(beads: Sequence[Bead]) -> list[Bead]:
    """Order the beads of a first layer on plastic with the inside before the walls: outer walls are laid last, against existing
    beads. The longest bead of its infill or skin comes first if it has no support: it makes up for what oozed while the table
    turned, away from a wall's seam.
    """
    inside = [replace(bead, rank=BEFORE_WALLS) if FILL <= bead.rank <= LAST else bead for bead in beads]
    if any(bead.rank <= OUTSIDE for bead in inside):
        return inside
    for kind in (Kind.INFILL, Kind.SKIN):
        longest = max((bead for bead in inside if bead.kind is kind), key=lambda bead: bead.length_mm, default=None)
        if longest is not None:
            return [replace(longest, rank=OUTSIDE), *(bead for bead in inside if bead is not longest)]
    return inside


def _check_printed(sections: Sections, layers: Sequence[Layer]) -> None:
    """Raises SliceError for a part without any bead, or one that would begin in air above the plate."""
    part, process = sections.part, sections.process
    if all(layer.is_of(Kind.SKIRT, Kind.SUPPORT, Kind.SUPPORT_INTERFACE).all() for layer in layers):
        low, high = sections.mesh.bounds_mm
        x, y, z = high - low
        if process.walls == 0 and process.infill_density == 0:
            raise SliceError(
                f"part {part.index} gives no path at all: {key_name('process.walls')} and "
                f"{key_name('process.infill_density')} are 0, and "
                f"{process.bottom_layers} bottom and {process.top_layers} top layers give no skin"
            )
        raise SliceError(
            f"part {part.index} gives no path at all: it measures {x:.3g} x {y:.3g} x {z:.3g} mm and no place of it is wider "
            f"than half of {key_name('process.line_width_mm')} ({0.5 * process.line_width_mm:g} mm is the least): "
            f"a larger {key_name('process.scale')} or a finer nozzle prints it"
        )
    first = next(layer for layer in layers if not layer.is_of(Kind.SKIRT).all())
    if sections.on_plate and process.walls and first.z_mm - first.height_mm > ON_PLATE_MM:
        support = "" if process.support == "auto" else f", or {key_name('process.support')} = auto"
        raise SliceError(
            f"part {part.index} would begin in air, {first.z_mm - first.height_mm:.2f} mm above the plate: what lies below is "
            f"too thin for lines of {process.line_width_mm:g} mm: a larger {key_name('process.scale')} or a finer "
            f"nozzle prints it{support}"
        )
