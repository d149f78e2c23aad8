"""Agreement: compares the deposited plastic with the model: the fraction filled, outside and in air, and the shift of each part.

An outer wall runs half its width inside the surface. Its further offset along the surface's normal is a constant (a compensation,
the resolution) plus the component of a shift along that normal: a least-squares fit over walls of all directions separates them
(the point-to-plane step of Chen and Medioni 1992). Walls along cuts belong to no surface and are excluded by their distance; a
shift in a direction that no wall faces is unknown.

The filled fraction is evaluated at lattice points inside the model. A bead counts as a bar of its width and height, in its part's
printing direction; the corners left by round beads are filled by the plastic they push aside.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun
from machine.dryrun.findings import Finding, at_row
from machine.dryrun.interfaces import Lattice, inside_loops
from machine.dryrun.placement import unsupported_mm
from machine.quantities import amount, percent
from mdp.cut import mesh_of, solid_of
from mdp.kernels.arrays import floats, longs
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices, Mesh
from mdp.sweep.rays import TriangleTree, nearest_faces, triangle_tree, windings
from mdp.topology.cross_section import cross_sections, loop_edges
from mdp.zone import Modifier
from profiles.part_settings import process_of_part
from profiles.profile import Profile
from slicer.geometry.polygons import contours, of_contours
from slicer.paths import Kind
from slicer.sectioning import reach_mm

WALLS = (Kind.OUTER_WALL.value, "WALL-OUTER", "Outer wall")
PIECE_MM = 1.0
ASIDE_MM = np.array([3.1e-7, 1.7e-7, 0.0])  # keeps upright rays off the edges of CAD faces
MOST_SHIFT_MM = 0.1
NEAR_MM = 1.5  # walls farther from their nominal place belong to another surface
LEAST_MM = 0.2  # least length of a piece of a wall
PER_PART = 3000  # pieces
FEWEST = 40
INFORMATION = 0.04  # share of the pieces: a shift in a direction that fewer face is unknown
TRIMMED = 3.0  # times the usual deviation
ROUNDS = 4
MOST_OUTSIDE = 0.01  # share of the extruded length outside by more than half a line: seams, brims, thin walls stay far below
LEAST_FILLED = 0.98  # share of the model at 100 % infill
AROUND = (Kind.SKIRT.value, Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value, Kind.PURGE.value)
POINTS = 200_000
CELL_MM = 2.0
ROUND_MM = 0.02  # three rounded coordinates, and beads whose tops meet


@dataclass(frozen=True)
class Agreement:
    """Fractions 0..1. filled: of the model's inside that is in a bead; outside: of the extruded length (without skirt and
    support) more than half a line outside the model, farthest_mm at worst; unsupported: of the extruded length in air without the
    slicer's declaration, reported: with it. shift_mm: of the part with the largest shift."""

    filled: float
    outside: float
    farthest_mm: float
    unsupported: float
    reported: float
    shift_mm: float


def agreement(run: DryRun, mesh: Mesh, profile: Profile, modifiers: Sequence[Modifier] = ()) -> tuple[Agreement, DryRun]:
    """Agreement of a dry run, made without known findings, with the closed model (workpiece frame); and the run with the findings
    added.

    modifiers: where settings differ from the profile's. Findings: outside and shift (errors), unfilled (warning; only at 100 %
    infill, for sparse infill leaves space by design).
    """
    tolerance_mm = 0.5 * profile.process.line_width_mm + reach_mm(profile.process)
    mesh = mesh_of(solid_of(mesh))  # in spatial order, for a fast search of nearest faces
    surface = triangle_tree(mesh)
    beyond_mm, length_mm, rows = pieces_outside(run, surface, tolerance_mm)
    outside = beyond_mm > tolerance_mm
    assert run.contacts is not None
    length, loose, reported = unsupported_mm(run.program, run.deposited, run.contacts)
    whole, shifted = max(length, 1e-9), shifts(run, surface)
    result = Agreement(
        filled=filled_share(run, mesh),
        outside=float(length_mm[outside].sum() / max(length_mm.sum(), 1e-9)),
        farthest_mm=float(beyond_mm.max(initial=0.0)),
        unsupported=loose / whole,
        reported=reported / whole,
        shift_mm=max((float(np.linalg.norm(by_mm)) for _, by_mm in shifted.values()), default=0.0),
    )
    processes = [profile.of_part(int(part)).process for part in set(run.program.part.tolist())]
    processes += [process_of_part(profile.process, modifier.process) for modifier in modifiers]
    solid = all(process.infill_density >= 1.0 for process in processes)
    problems = [*_findings(run, rows[outside], result, solid), *_shift_findings(run, shifted)]
    return result, replace(run, findings=(*run.findings, *problems))


def _findings(run: DryRun, outside: Indices, result: Agreement, solid: bool) -> Iterator[Finding]:
    """Findings of outside and unfilled. outside: rows with plastic outside the model; solid: the model should be filled."""
    if result.outside > MOST_OUTSIDE:
        message = (
            f"{percent(result.outside, 1)} % of the extruded length lie outside the model by more than half a line, "
            f"{amount(result.farthest_mm)} mm and more at the worst"
        )
        yield at_row(run.program, int(outside[0]), "error", "outside", message)
    if solid and result.filled < LEAST_FILLED:
        message = (
            f"the beads fill {percent(result.filled, 1)} % of the model, at 100 % infill {100 * LEAST_FILLED:g} % are expected"
        )
        yield Finding("warning", "unfilled", 0, 0, 0, message)


def _shift_findings(run: DryRun, shifted: Mapping[int, tuple[int, Floats]]) -> Iterator[Finding]:
    """An error for every part that is shifted from the model."""
    for part, (row, by_mm) in shifted.items():
        size_mm = float(np.linalg.norm(by_mm))
        if size_mm > MOST_SHIFT_MM:
            by = " ".join(f"{letter}{value:+.2f}" for letter, value in zip("XYZ", by_mm, strict=True))
            message = f"part {part} lies {amount(size_mm)} mm beside the model, by {by}, {MOST_SHIFT_MM:g} mm are allowed"
            yield at_row(run.program, row, "error", "shift", message)


def pieces_outside(run: DryRun, surface: TriangleTree, tolerance_mm: float) -> tuple[Floats, Floats, Indices]:
    """The strokes, skirt and support aside, in k pieces of at most 1 mm: (k,) distances of their midpoints from the solid, 0
    inside it, up to four tolerances and at least 1 mm; (k,) lengths and rows. surface: that of the closed model in the workpiece
    frame."""
    which = of_model(run)
    segments, length_mm = run.deposited.segments(which), run.deposited.length_mm[which]
    counts = np.maximum(np.ceil(length_mm / PIECE_MM), 1).astype(np.int64)
    piece = np.repeat(np.arange(len(which)), counts)
    share = (np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[piece]
    middles = segments[piece, 0] + share[:, None] * (segments[:, 1] - segments[:, 0])[piece]
    return outside_mm(middles, surface, max(4.0 * tolerance_mm, 1.0)), (length_mm / counts)[piece], run.segment_row[which][piece]


def outside_mm(points: Floats, surface: TriangleTree, most_mm: float) -> Floats:
    """(n,) distances of (n, 3) points from a closed surface's solid: 0 inside, at most most_mm (farther is not looked for)."""
    distances, out = np.zeros(len(points)), np.flatnonzero(~inside(points, surface))
    distances[out] = nearest_faces(surface, points[out], most_mm)[0]
    return distances


def inside(points: Floats, surface: TriangleTree) -> NDArray[np.bool_]:
    """(n,) whether (n, 3) points lie in a closed surface's solid, also where it intersects itself."""
    within: NDArray[np.bool_] = windings(surface, points + ASIDE_MM) > 0
    return within


def shifts(run: DryRun, surface: TriangleTree) -> dict[int, tuple[int, Floats]]:
    """For every part with enough outer walls the row of its first one, and (3,) mm, workpiece frame, by which it lies beside the
    closed model, given by its surface."""
    walls = np.flatnonzero(run.program.rows_of_types(*WALLS)[run.segment_row])
    walls = walls[run.deposited.length_mm[walls] > LEAST_MM]
    part, shifted = run.program.part[run.segment_row[walls]], dict[int, tuple[int, Floats]]()
    for index in np.unique(part).tolist():
        pieces = _evenly(walls[part == index])
        ups = run.deposited.directions(pieces)
        width, height = run.deposited.sizes[run.deposited.size[pieces]].T
        points = run.deposited.segments(pieces).mean(axis=1) - 0.5 * height[:, None] * ups
        distance, face = nearest_faces(surface, points, NEAR_MM)
        normals = surface.normals[face]
        lateral = np.sqrt(np.maximum(0.0, 1.0 - (normals * ups).sum(axis=1) ** 2))
        beside = np.where(inside(points, surface), -distance, distance) + 0.5 * width * lateral
        use = (distance < NEAR_MM) & (np.abs(beside) < NEAR_MM) & (lateral > 0.5)
        by_mm = fit_shift(normals[use], beside[use])
        if by_mm is not None:
            shifted[index] = (int(run.segment_row[pieces[0]]), by_mm)
    return shifted


def _evenly(which: NDArray[np.int64]) -> NDArray[np.int64]:
    return which if len(which) <= PER_PART else which[np.linspace(0, len(which) - 1, PER_PART).astype(np.int64)]


def fit_shift(normals: Floats, beside: Floats) -> Floats | None:
    """(3,) shift that best explains the outward offsets of (n,) walls along (n, 3) normals, plus a constant; None: too few
    walls."""
    keep = np.ones(len(beside), dtype=np.bool_)
    shift = np.zeros(3)
    for _ in range(ROUNDS):
        if keep.sum() < FEWEST:
            return None
        facing = normals[keep] - normals[keep].mean(axis=0)
        value, axis = np.linalg.eigh(facing.T @ facing / keep.sum())
        axes = axis[:, value > INFORMATION]
        along, *_ = np.linalg.lstsq(facing @ axes, beside[keep] - beside[keep].mean(), rcond=None)
        shift = axes @ along
        left = beside - normals @ shift
        left -= np.median(left[keep])
        usual = 1.4826 * float(np.median(np.abs(left[keep]))) + 1e-3
        keep = np.abs(left) < TRIMMED * usual + 0.02
    return shift


def of_model(run: DryRun) -> Indices:
    """The segments of the model, without its support or skirt."""
    return np.flatnonzero(~run.program.rows_of_types(*AROUND)[run.segment_row])


def filled_share(run: DryRun, mesh: Mesh, points: int = POINTS) -> float:
    """Fraction 0 to 1 of the closed model, in the workpiece frame, that its beads fill (without support and skirt); 1 if it has
    no inside. points: approximate number of lattice points."""
    step_mm = float(np.cbrt(max(mesh.volume_mm3, 1e-9) / points))
    low, high = mesh.bounds_mm
    filled, which = np.zeros(np.ceil((high - low) / step_mm - 0.5).astype(np.int64), np.bool_), of_model(run)
    sizes_mm = run.deposited.sizes[run.deposited.size[which]]
    fill(filled, low + 0.5 * step_mm, step_mm, run.deposited.segments(which), run.deposited.directions(which), sizes_mm)
    columns, within = Lattice(low[:2], step_mm, np.array(filled.shape[:2])), np.zeros_like(filled)
    for k, loops in enumerate(cross_sections(mesh, low[2] + step_mm * (np.arange(filled.shape[2]) + 0.5))):
        within[:, :, k] = inside_loops(loop_edges(contours(of_contours(loops))), columns)
    return float(filled[within].mean()) if within.any() else 1.0


@kernel
def fill(filled: NDArray[np.bool_], origin: Floats, step: float, segments: Floats, ups: Floats, sizes: Floats) -> None:
    """Mark the points of a lattice, with its lowest corner at the origin, inside bars whose tops are (m, 2, 3) segments. ups: (m,
    3) printing directions; sizes: (m, 2) widths and heights."""
    d, low, high = floats(3, 0.0), longs(3, 0), longs(3, 0)
    for i in range(len(segments)):
        a, b, up, half, height = segments[i, 0], segments[i, 1], ups[i], 0.5 * sizes[i, 0], sizes[i, 1]
        for axis in range(3):
            d[axis] = b[axis] - a[axis]
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        if length <= 0.0:
            continue
        for axis in range(3):
            d[axis] /= length
        # a corner of a bar is sqrt(2) * half from its segment's end
        reach, pieces = 1.5 * half + height + ROUND_MM, int(length / CELL_MM) + 1
        for k in range(pieces):
            for axis in range(3):
                u, v = a[axis] + d[axis] * length * k / pieces, a[axis] + d[axis] * length * (k + 1) / pieces
                low[axis] = max(int(np.ceil((min(u, v) - reach - origin[axis]) / step)), 0)
                high[axis] = min(int(np.floor((max(u, v) + reach - origin[axis]) / step)), filled.shape[axis] - 1)
            for p in range(low[0], high[0] + 1):
                x = origin[0] + p * step - a[0]
                for q in range(low[1], high[1] + 1):
                    y = origin[1] + q * step - a[1]
                    for r in range(low[2], high[2] + 1):
                        z = origin[2] + r * step - a[2]
                        below = -(x * up[0] + y * up[1] + z * up[2])
                        if filled[p, q, r] or below < -ROUND_MM or below > height + ROUND_MM:
                            continue
                        along = x * d[0] + y * d[1] + z * d[2]
                        beside = x * x + y * y + z * z - along * along - below * below
                        if -half <= along <= length + half and beside <= (half + ROUND_MM) ** 2:
                            filled[p, q, r] = True
