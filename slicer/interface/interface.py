"""Interface: the surroundings of a part below and beside it, and how parts hold together, in the part frame.

The base plane of a limb, beside which earlier parts stand above it, counts only near the limb.

Grooves are shallow channels left where a later part will stand. The later part's first layer is printed at its ordinary height
with extra flow to fill the grooves, so the tip never dips below the surface; ridges and fillings then also hold each other
sideways.

Pins are blind holes in the face on which a part will stand; the part's first strokes fill them. A weld to cold plastic is the
weakest place of a print; plastic that runs across it in one piece is stronger (Duty and others, "Z-Pinning approach for 3D
printing mechanically isotropic materials", Additive Manufacturing 27, 2019). The tip does not fit into a hole narrow enough to be
filled, so it circles at the mouth while it extrudes the hole's volume. A hole runs along the direction of the part that fills it,
lies entirely in one earlier part, and keeps clear of everything else: the surface, other joints, other pins. For the part below
it is an ordinary hole, with walls around it and a floor.
"""

import atexit
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import compress
from math import ceil

import manifold3d as m3
import numpy as np

from mdp.cut import Solid, mesh_of, solid_of
from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.topology.cross_section import cross_sections
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import interface_process, outer_wall_width_mm
from slicer.geometry.edge_index import index_edges, lie_within
from slicer.geometry.polygons import Polygons, area_mm2, clean, contours, islands, offset, offset_round, union
from slicer.geometry.polyline import near_height
from slicer.heights import Heights, part_heights

SKIN = 0.8  # line widths inside the section from which a tip is off the outer wall, whose centre lies at 0.5
SIDES = 32  # sides of a polygon that approximates a circle around an edge
BELOW_MM = 0.02  # from a base plane to the section that represents its cut face, in the parts on both sides
LEVEL = 1e-9  # a plane whose normal is closer to vertical than this meets a layer nowhere or everywhere
LEAST_COSINE = 0.05  # a steeper plane is treated as having this cosine, so that projections onto it stay finite
AROUND_MM = 5.0  # support of a limb stays within this distance of its projection
COARSE_MM = 0.05  # tolerance to which a projection is simplified
KEPT = 64  # parts whose faces and projections are cached
STRIPE = 2.0  # line widths of grooves and ridges, so that two beads fit
HOLE_SIDES = 24  # sides of the polygon of a hole
MOUTH_MM = 1.0  # holes extend this far beyond the base plane, into empty space, so that no film is left over them
HALVINGS = 20
WIDENED, MOST_WIDENED = 1.1, 60  # factor by which the step of a grid with too many positions grows, and number of tries

Pins = Mapping[int, Floats]  # by the part that fills them: (k, 3) x and y of the mouth's centre, mm, and volume of the hole, mm3


def near_parts(part: Part, others: Sequence[Part], reach_mm: float) -> list[Part]:
    """The parts whose bounding box, in the part's frame, comes within reach_mm of the part's own."""
    low, high = part.in_part_frame().bounds_mm
    boxes = [neighbour.in_frame_of(part).bounds_mm for neighbour in others]
    near = [bool(np.all((box[0] < high + reach_mm) & (box[1] > low - reach_mm))) for box in boxes]
    return [neighbour for neighbour, is_near in zip(others, near, strict=True) if is_near]


def frame_change(part: Part, to: Part) -> tuple[Floats, Floats]:
    """turn (3, 3) and shift (3,) from a part's frame to the frame of another part: turn @ x + shift."""
    turn = to.rotation @ part.rotation.T
    return turn, turn[:, 2] * part.base.offset_mm - np.array([0.0, 0.0, to.base.offset_mm])


@lru_cache(KEPT)
def base_section(part: Part) -> Polygons:
    """The face on the base plane of a part, in its frame."""
    return clean(cross_sections(part.in_part_frame(), np.array([BELOW_MM]))[0])


def sections_of(others: Sequence[Part], part: Part, cuts_mm: Floats) -> list[Polygons]:
    """The united sections of other parts at every height in the part's frame."""
    layers = [[clean(loops) for loops in cross_sections(neighbour.in_frame_of(part), cuts_mm)] for neighbour in others]
    return [union(layer) for layer in zip(*layers, strict=True)] if layers else [Polygons()] * len(cuts_mm)


def plane_in_frame_of(part: Part, normal: Floats, offset_mm: float) -> Floats:
    """(4,) normal and offset, in the frame of a part, of a plane of the workpiece frame."""
    turned = part.rotation @ normal
    return np.array([*turned, offset_mm - turned[2] * part.base.offset_mm])


def limb_planes(part: Part, later: Sequence[Part], heights: Heights, beside_mm: float) -> dict[int, "BasePlane"]:
    """The base planes of later limbs by part index, each limited to a distance beside its limb."""
    limbs = [upper for upper in later if upper.base.limbs_mm is not None]
    far_mm = 2.0 * float(np.linalg.norm(part.in_part_frame().vertices, axis=1).max()) if limbs else 0.0
    places = {limb.index: offset(shadow_of(limb), beside_mm) for limb in limbs}
    return {limb.index: BasePlane(*frame_change(part, limb), heights, far_mm, places[limb.index]) for limb in limbs}


@lru_cache(KEPT)
def shadow_of(limb: Part) -> Polygons:
    """The projection of a limb along its direction, in its frame."""
    return solid_of(limb.in_part_frame()).project().simplify(COARSE_MM)


@lru_cache(KEPT)
def room_of(limb: Part) -> Polygons:
    """The area of a limb's base plane over which the limb and its support are printed."""
    return offset_round(shadow_of(limb), AROUND_MM)


# otherwise polygons left when Python ends would make manifold3d print a list of leaks
for _cached in (base_section, shadow_of, room_of):
    atexit.register(_cached.cache_clear)


@dataclass(frozen=True, eq=False)
class BasePlane:
    """The base plane of a later part in the frame of an earlier one. turn (3, 3), shift (3,): from the earlier frame to the
    later: turn @ x + shift.

    heights: layers of the earlier part; a layer is represented by its side nearer to the plane. far_mm: greatest distance of its
    layers from the origin of the earlier frame. places: the area of the plane that counts, if the later part is a limb; None for
    the whole plane.
    """

    turn: Floats
    shift: Floats
    heights: Heights
    far_mm: float
    places: Polygons | None = None

    @classmethod
    def of(cls, earlier: Part, later: Part, heights: Heights, far_mm: float) -> "BasePlane":
        """The base plane of a later part, limited to the area over which the part or its support is printed."""
        places = None if later.base.limbs_mm is None else room_of(later)
        return cls(*frame_change(earlier, later), heights, far_mm, places)

    def z_mm(self, layer: int) -> float:
        """The height that represents a layer, mm."""
        return float((self.heights.tip_mm if self.turn[2, 2] >= 0.0 else self.heights.bottom_mm)[layer])

    def points_mm(self, places: Floats) -> Floats:
        """(n, 3) points of the earlier frame for (n, 2) positions on the plane."""
        on_plane = np.column_stack([places, np.zeros(len(places))])
        points: Floats = (on_plane - self.shift) @ self.turn
        return points

    def layers_near(self, places: Polygons, deep_mm: float) -> range:
        """The layers that come within deep_mm below an area of the plane."""
        if places.is_empty():
            return range(0)
        on_plane: Floats = self.points_mm(np.concatenate(contours(places)))[:, 2]
        deeper = on_plane - deep_mm * self.turn[2, 2]
        low, high = min(on_plane.min(), deeper.min()), max(on_plane.max(), deeper.max())
        return range(int(np.searchsorted(self.heights.tip_mm, low)), int(np.searchsorted(self.heights.bottom_mm, high)))

    def band(self, layer: int, low_mm: float, high_mm: float) -> Polygons:
        """The part of a layer between low_mm and high_mm above the plane (negative: below), within the projection of the area
        that counts.
        """
        normal, at_mm, far_mm = self.turn[2, :2], float(self.turn[2, 2] * self.z_mm(layer) + self.shift[2]), self.far_mm
        across = float(np.hypot(*normal))
        if across < LEVEL:
            whole = Polygons.square((2.0 * far_mm, 2.0 * far_mm), True) if low_mm <= at_mm <= high_mm else Polygons()
        else:
            near, far = np.clip((np.array([low_mm, high_mm]) - at_mm) / across, -far_mm, far_mm)
            along, aside = normal / across, np.array([-normal[1], normal[0]]) / across * far_mm
            corners = np.array([near * along - aside, far * along - aside, far * along + aside, near * along + aside])
            whole = Polygons([corners]) if far > near else Polygons()
        if self.places is None or whole.is_empty():
            return whole
        narrow_mm = max(LEAST_COSINE - abs(self.turn[2, 2]), 0.0) * far_mm  # possible error of the projection of a steep plane
        return whole ^ self.shadow(offset_round(self.places, narrow_mm) if narrow_mm else self.places, layer)

    def project(self, places: Polygons, layer: int) -> Polygons:
        """An area of a layer projected vertically onto the plane, in the later part's frame."""
        turn, shift = self._onto_plane(self.z_mm(layer))
        return places.transform(np.column_stack([turn, shift]))

    def shadow(self, places: Polygons, layer: int) -> Polygons:
        """The part of a layer vertically over or under an area of the plane."""
        turn, shift = self._onto_plane(self.z_mm(layer))
        back = np.linalg.inv(turn)
        return places.transform(np.column_stack([back, -back @ shift]))

    def _onto_plane(self, z_mm: float) -> tuple[Floats, Floats]:
        """(2, 2) and (2,) projection of a height onto the plane, exact where the height meets the plane."""
        u, s, vt = np.linalg.svd(self.turn[:2, :2])
        turn: Floats = u @ np.diag(np.maximum(s, LEAST_COSINE)) @ vt
        normal, at = self.turn[2, :2], float(self.turn[2, 2] * z_mm + self.shift[2])
        meets = -at * normal / max(float(normal @ normal), LEVEL) if np.hypot(*normal) > LEVEL else np.zeros(2)
        shift: Floats = (self.turn[:2, :2] - turn) @ meets + self.turn[:2, 2] * z_mm + self.shift[:2]
        return turn, shift


def plastic_below(part: Part, earlier: Sequence[Part], section: Polygons) -> Polygons | None:
    """Plastic just below the base plane; None on the build plate. Without earlier parts it is assumed to fill the section."""
    if part.on_plate:
        return None
    return sections_of(earlier, part, np.array([-BELOW_MM]))[0] if earlier else section


def joints(part: Part, later: Sequence[Part], section: Polygons, below: Polygons | None) -> Floats:
    """(n, 6) segments, in the part frame, of the lines on the surface where the part meets earlier and later parts.

    section: of its first layer; below: the plastic under it, None on the build plate.
    """
    rims = [] if below is None else [np.insert(loop, 2, 0.0, axis=1) for loop in contours(section ^ below)]
    for upper in later:
        for loop in contours(base_section(upper)):
            placed = np.insert(loop, 2, upper.base.offset_mm, axis=1) @ upper.rotation
            rims.append(placed @ part.rotation.T - np.array([0.0, 0.0, part.base.offset_mm]))
    segments = [np.hstack([rim, np.roll(rim, -1, axis=0)]) for rim in rims]
    return np.concatenate(segments) if segments else np.zeros((0, 6))


def visible_wall_beside(edges: Floats, section: Polygons, z_mm: float, process: Process) -> Polygons:
    """Visible wall beside joints: the outer walls of a section near the edges of interfaces, (n, 6) segments in space, where
    marks of a travel or wipe would show.
    """
    reach_mm = process.interface_seam_mm
    near = near_height(edges, z_mm, reach_mm)
    if not len(near):
        return Polygons()
    rise = near[:, 5] - near[:, 2]
    level = np.abs(rise) < 1e-9
    at = (z_mm - near[:, 2] + reach_mm * np.array([[-1.0], [1.0]])) / np.where(level, 1.0, rise)
    shares: Floats = np.where(level, [[0.0], [1.0]], np.sort(at, axis=0).clip(0.0, 1.0))  # ascending, and within the segments
    begin, end = (near[:, :3] + share[:, None] * (near[:, 3:] - near[:, :3]) for share in shares)
    heights = np.array([begin[:, 2], end[:, 2]]) - z_mm
    least = np.where(heights.prod(axis=0) < 0.0, 0.0, np.abs(heights).min(axis=0))
    discs = [Polygons.circle(reach, SIDES) for reach in np.sqrt(np.maximum(reach_mm**2 - least**2, 0.0)).tolist()]
    rows = zip(discs, begin[:, :2].tolist(), end[:, :2].tolist(), strict=True)
    around = union([Polygons.batch_hull([disc.translate(a), disc.translate(b)]) for disc, a, b in rows])
    width_mm = min(process.line_width_mm, outer_wall_width_mm(process))
    return around ^ (section - offset(section, -SKIN * width_mm))


def plan_pins(parts: Sequence[Part], profile: Profile) -> Pins:
    """The pins of all given parts of a print, in print order; {} if no part has pins.

    profile: of the whole print; the settings of the part that fills a pin apply.
    """
    wanted = [part.index for part in parts if not part.on_plate and profile.of_part(part.index).process.interlock == "pins"]
    planned: dict[int, Floats] = {}
    for part in parts if wanted else ():
        planned[part.index] = _pins_of(part, parts, planned, profile) if part.index in wanted else np.zeros((0, 3))
    return planned


def _pins_of(part: Part, parts: Sequence[Part], planned: Pins, profile: Profile) -> Floats:
    """The pins of one part. planned: those of the parts before it."""
    own = profile.of_part(part.index)
    process, wide_mm, pins = own.process, pin_width_mm(own), np.zeros((0, 3))
    for lower in near_parts(part, [other for other in parts if other.index < part.index], BELOW_MM):
        below = profile.of_part(lower.index)
        keep_mm, change = room_around_mm(below.process), frame_change(part, lower)
        looks = ceil((process.pin_depth_mm + keep_mm) / process.layer_height_mm) + 1  # about the number of layers
        depths_mm = -np.linspace(process.pin_depth_mm + keep_mm, BELOW_MM, looks)
        meshes = [lower.in_frame_of(part), *pin_holes(part, parts, planned, profile)]
        room = offset_round(base_section(part), -keep_mm - 0.5 * wide_mm)
        for solid, *holes in zip(*(cross_sections(mesh, depths_mm) for mesh in meshes), strict=True):
            if room.is_empty():
                break
            free = clean(solid) - union([Polygons(loops) for loops in holes if loops])
            room = room ^ offset_round(free, -keep_mm - 0.5 * wide_mm)
        heights: Heights | None = None
        least_mm = wide_mm + 2.0 * process.line_width_mm  # two walls between holes
        for x, y in _places(room, process):
            if not len(pins) or np.hypot(*(pins[:, :2] - (x, y)).T).min() >= least_mm:
                heights = heights or part_heights(lower, [other for other in parts if other.index > lower.index], below)
                hole = mesh_of(_hole(x, y, wide_mm, -process.pin_depth_mm, 0.0)).transform(*change)
                pins = np.vstack([pins, [x, y, _taken_mm3(hole, heights)]])
    return pins


def pin_width_mm(profile: Profile) -> float:
    """Diameter of a hole, mm."""
    return profile.process.pin_width_nozzles * profile.machine.head.nozzle_mm


def room_around_mm(process: Process) -> float:
    """Least distance between a hole and everything else, mm: the shell's walls and one wall of the hole."""
    return (process.walls + 1) * process.line_width_mm


def pin_holes(part: Part, uppers: Sequence[Part], pins: Pins, profile: Profile) -> list[Mesh]:
    """The holes of other parts, cut out of the parts below them, in the frame of a part."""
    holes = []
    for upper in uppers:
        if len(pins.get(upper.index, ())):
            own = profile.of_part(upper.index)
            wide_mm, depth_mm = pin_width_mm(own), own.process.pin_depth_mm
            several = [_hole(x, y, wide_mm, -depth_mm, MOUTH_MM) for x, y in pins[upper.index][:, :2].tolist()]
            holes.append(mesh_of(m3.Manifold.compose(several)).transform(*frame_change(upper, part)))
    return holes


def _hole(x: float, y: float, wide_mm: float, bottom_mm: float, top_mm: float) -> Solid:
    return m3.Manifold.extrude(Polygons.circle(0.5 * wide_mm, HOLE_SIDES), top_mm - bottom_mm).translate((x, y, bottom_mm))


def _places(room: Polygons, process: Process) -> list[tuple[float, float]]:
    """Centres of holes: a grid in the free area, wide enough for at most the configured number."""
    for widened in range(MOST_WIDENED + 1):
        places = _grid(room, process.pin_spacing_mm * WIDENED**widened)
        if len(places) <= process.most_pins:
            break
    return places[: process.most_pins]


def _grid(room: Polygons, step_mm: float) -> list[tuple[float, float]]:
    """A square grid about the centre of every piece of an area, or the piece's deepest point if the grid misses it."""
    places: list[tuple[float, float]] = []
    for island in sorted(islands(room), key=lambda piece: piece.bounds()):
        x0, y0, x1, y1 = island.bounds()
        grid = [(x, y) for y in _row(y0, y1, step_mm) for x in _row(x0, x1, step_mm)]
        places += list(compress(grid, lie_within(index_edges(island), np.array(grid)))) or [_deepest(island)]
    return places


def _row(low: float, high: float, step: float) -> list[float]:
    count = int((high - low) / step) + 1
    return [0.5 * (low + high) + step * (k - 0.5 * (count - 1)) for k in range(count)]


def _deepest(island: Polygons) -> tuple[float, float]:
    """The point of a piece farthest from its border."""
    x0, y0, x1, y1 = island.bounds()
    low, high, core = 0.0, min(x1 - x0, y1 - y0), island
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        smaller = offset(island, -middle)
        if smaller.is_empty():
            high = middle
        else:
            low, core = middle, smaller
    x0, y0, x1, y1 = islands(core)[0].bounds()
    return 0.5 * (x0 + x1), 0.5 * (y0 + y1)


def _taken_mm3(hole: Mesh, heights: Heights) -> float:
    """Volume that a hole, in the frame of the part below, takes from its layers, mm3."""
    # a section contains what lies below its plane
    first, last = np.searchsorted(heights.cut_mm, hole.bounds_mm[:, 2], side="right")
    sections = cross_sections(hole, heights.cut_mm[first:last])
    areas = [sum(area_mm2(loop) for loop in loops) for loops in sections]
    return float(np.dot(areas, heights.height_mm[first:last]))


def cut_out(outlines: Sequence[Polygons], cutters: Sequence[Mesh], cuts_mm: Floats) -> list[Polygons]:
    """Outlines at given heights, minus the sections of some solids."""
    left = list(outlines)
    for cutter in cutters:
        left = [area - Polygons(cut) if cut else area for area, cut in zip(left, cross_sections(cutter, cuts_mm), strict=True)]
    return left


def cut_grooves(
    outlines: Sequence[Polygons], part: Part, later: Sequence[Part], cuts_mm: Floats, profile: Profile
) -> list[Polygons]:
    """The part's outlines minus the grooves of the parts that will stand on it. profile: of the whole print."""
    cutters = []
    for upper in later:
        process = profile.of_part(upper.index).process
        area = grooves(upper, process) if process.interlock == "grooves" else Polygons()
        if not area.is_empty():
            solid = m3.Manifold.extrude(area, 2.0 * process.interlock_mm).translate((0.0, 0.0, -process.interlock_mm))
            cutters.append(mesh_of(solid).transform(*frame_change(upper, part)))
    return cut_out(outlines, cutters, cuts_mm)


def grooves(part: Part, process: Process) -> Polygons:
    """Grooves under a part's base, in its frame: stripes along x that end before the walls, so that none is visible."""
    first = interface_process(process)
    inside = offset(base_section(part), -(first.walls + 1) * first.line_width_mm)
    if inside.is_empty():
        return inside
    x0, y0, x1, y1 = inside.bounds()
    wide = STRIPE * process.line_width_mm
    stripe = Polygons.square((x1 - x0 + 2.0, wide))
    rows = np.arange(np.floor(y0 / (2.0 * wide)), np.ceil(y1 / (2.0 * wide)) + 1)
    return inside ^ Polygons.compose([stripe.translate((x0 - 1.0, 2.0 * wide * row)) for row in rows])
