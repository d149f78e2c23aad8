"""Marks of the nozzle at the seams of joints: wipes, primes and travels on the rim.

    python tools/checks/seams.py MODEL|FILE.gcode ... [--list] [--set KEY=VALUE ...]

A joint is where a part's first layer meets earlier parts; its rim is the outline of that layer in the plane of the cut. One row
per joint. Marks are counted when the tip is at the height of a layer, of this part or of earlier ones, on that layer's outline
(its centre at most ON_RIM of the outer wall's width inside, or up to NEAR_MM outside) and at most NEAR_MM from the rim in space:
wipes that end there, or run there for more than a line width; primes: filament pushed forward, at standstill or by a stroke of an
outer wall that gets more than similar ones; travels that begin, end or pass there. "below": marks in earlier parts' layers. In
brackets: unavoidable marks: where no place within NEAR_MM is DEEP inside, where an open bead begins or ends, or over support,
which is broken off. --list: the place of each, X and Y of the machine. tools/checks/plastic.py measures how well the walls meet.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from machine.dryrun.dryrun import DryRun
from machine.dryrun.interfaces import AT_THE_EDGE, NO_PART
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from machine.kinematics.table import shift, workpiece_points
from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.requests import ModelRequest
from mdp.mesh import Floats, Indices
from mdp.pose import Pose, rotation
from profiles.machine import Machine
from profiles.profile import Profile, load
from tools.checks.harness import files, options_of, played, table

HEAD = ("model", "part", "rim mm", "wipes", "below", "primes", "below", "travels", "below")
ON_RIM = 0.75  # of the outer wall's width, whose own centre is half of it inside
NEAR_MM = 0.9  # walls do not begin within process.interface_seam_mm of it, 1 mm, measured at the centre of their layer
DEEP = 1.25  # of the outer wall's width: without any place as far inside there is no other wall to be above
LOW_MM = 0.05  # below this height over its layer a tip touches plastic
STEP_MM = 0.05  # between samples along moves
STILL_MM = 0.01
RICHER = 1.15  # ratio to the median of similar strokes, for a stroke that replaces ooze
LEAST_MM3 = 0.002  # the filament of a shorter stroke is too inaccurate
CLOSED_MM = 0.3  # gaps between the beads of a layer that are not an outline


@dataclass(frozen=True)
class Mark:
    """A mark on a rim. what: wipe, prime or travel; why: narrow, line or support, "" if avoidable."""

    part: int
    what: str
    line: int
    place: Floats
    why: str

    def __str__(self) -> str:
        x_mm, y_mm = self.place
        return f"line {self.line}: part {self.part} {self.what} at {x_mm:.2f} {y_mm:.2f} {self.why}".rstrip()


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint. rim: the outline of a part's first layer, machine X Y in the part's pose; plane_mm: its base plane's machine Z.

    covered: the area inside the rim, where marks are invisible.
    """

    machine: Machine
    part: int
    pose: Pose
    rim: shapely.Geometry
    covered: shapely.Geometry
    plane_mm: float

    def near(self, points: Floats, pose: Pose) -> np.ndarray:
        """(n,) whether (n, 3) machine points in a pose are near the rim in space, and not below the part."""
        points = points if pose == self.pose else self._at_own_pose(points, pose)
        places = shapely.points(points[:, :2])
        away = np.hypot(shapely.distance(self.rim, places), points[:, 2] - self.plane_mm)
        return (away <= NEAR_MM) & ~shapely.contains(self.covered, places)

    def _at_own_pose(self, points: Floats, pose: Pose) -> Floats:
        turned: Floats = workpiece_points(self.machine, pose, points) @ rotation(self.machine, self.pose).T
        return turned + shift(self.machine, self.pose)


@dataclass(frozen=True, eq=False)
class Outline:
    """The outline of a layer, machine X Y in its part's pose.

    inner: the area inside it; deep: the area far enough inside for another wall; support: adjacent support; low: rows in which
    the tip is no higher than the layer.
    """

    joint: Joint
    part: int
    pose: Pose
    z_mm: float
    section: shapely.Geometry
    inner: shapely.Geometry
    deep: shapely.Geometry
    support: shapely.Geometry
    width_mm: float
    low: np.ndarray

    def on(self, points: Floats) -> np.ndarray:
        """(n,) whether (n, 2) points are on it near the joint's rim."""
        places = shapely.points(points)
        beside = ~shapely.contains(self.inner, places) & (shapely.distance(self.section, places) <= NEAR_MM)
        if beside.any():
            at = np.column_stack([points[beside], np.full(beside.sum(), self.z_mm)])
            beside[beside] = self.joint.near(at, self.pose)
        return beside

    def why(self, place: Floats) -> str:
        """Why a mark at a place of it is unavoidable, or ""."""
        point = shapely.Point(place)
        if self.support.distance(point) < self.section.distance(point):
            return "support"
        return "narrow" if self.deep.is_empty or self.deep.distance(point) > NEAR_MM else ""


def joints(program: ParsedProgram, machine: Machine) -> Iterator[tuple[Joint, list[Outline]]]:
    """The joint of every part that stands on others, and the outlines of layers near its rim."""
    strokes = (program.kind == MoveKind.EXTRUDE) & (program.part > 0)
    own = strokes & ~program.rows_of_types(*NO_PART)
    walls = np.flatnonzero(own & program.rows_of_types(*AT_THE_EDGE))
    for part in sorted(set(program.part[own].tolist()))[1:]:
        mine = np.flatnonzero(own & (program.part == part))
        first = mine[program.layer[mine] == program.layer[mine].min()]
        plane_mm = float(np.median(program.end[first, 2] - program.height_mm[first]))
        edge = walls[np.isin(walls, first)]
        section = _section(program, first, edge)
        width_mm = float(np.median(program.width_mm[edge if len(edge) else first]))
        rim, covered = section.boundary, section.buffer(-ON_RIM * width_mm)
        shapely.prepare(rim)
        shapely.prepare(covered)
        joint = Joint(machine, part, _pose(program, int(first[0])), rim, covered, plane_mm)
        near = set[tuple[int, int]]()
        for other in range(1, part + 1):
            theirs = walls[program.part[walls] == other]
            if len(theirs):
                beside = joint.near(program.end[theirs, :3], _pose(program, int(theirs[0])))
                near |= {(other, layer) for layer in program.layer[theirs[beside]].tolist()}
        yield joint, [_outline(program, strokes, own, joint, where) for where in sorted(near)]


def _pose(program: ParsedProgram, row: int) -> Pose:
    return Pose(*program.end[row, 3:].tolist())


def _outline(program: ParsedProgram, strokes: np.ndarray, own: np.ndarray, joint: Joint, where: tuple[int, int]) -> Outline:
    """The outline of a layer; where: part and layer."""
    here = (program.part == where[0]) & (program.layer == where[1])
    mine, walls = np.flatnonzero(own & here), np.flatnonzero(own & here & program.rows_of_types(*AT_THE_EDGE))
    section = _section(program, mine, walls)
    width_mm = float(np.median(program.width_mm[walls]))
    z_mm = float(np.median(program.end[mine, 2]))
    levels = np.stack([program.start[:, 2], program.end[:, 2]])
    # including the wipe after it
    about = (program.part == where[0]) & ((program.layer == where[1]) | (program.layer == where[1] + 1))
    low = about & (np.abs(levels - z_mm) < LOW_MM).all(axis=0)
    inner = section.buffer(-ON_RIM * width_mm)
    deep = section.buffer(-DEEP * width_mm)
    shapely.prepare(inner)
    shapely.prepare(section)
    support = _beads(program, np.flatnonzero(strokes & ~own & here))
    return Outline(joint, where[0], _pose(program, int(mine[0])), z_mm, section, inner, deep, support, width_mm, low)


def _section(program: ParsedProgram, beads: Indices, walls: Indices) -> shapely.Geometry:
    """The area that beads cover, and that their outer walls enclose."""
    enclosed = _outlines(program, walls)
    outlines = shapely.symmetric_difference_all(enclosed) if enclosed else shapely.Polygon()
    return shapely.union_all([outlines, _beads(program, beads)]).buffer(CLOSED_MM).buffer(-CLOSED_MM)


def _beads(program: ParsedProgram, rows: Indices) -> shapely.Geometry:
    lines = shapely.linestrings(np.stack([program.start[rows, :2], program.end[rows, :2]], axis=1))
    return shapely.union_all(shapely.buffer(lines, 0.5 * program.width_mm[rows]))


def _outlines(program: ParsedProgram, walls: Indices) -> list[shapely.Geometry]:
    """The areas that closed outer walls enclose."""
    apart = (np.diff(walls) != 1) | (np.abs(program.start[walls[1:], :2] - program.end[walls[:-1], :2]).max(axis=1) > STILL_MM)
    enclosed: list[shapely.Geometry] = []
    for way in np.split(walls, np.flatnonzero(apart) + 1):
        points = np.vstack([program.start[way[:1], :2], program.end[way, :2]])
        if len(way) > 2 and np.hypot(*(points[-1] - points[0])) <= 2.0 * program.width_mm[way[0]]:
            enclosed.append(shapely.make_valid(shapely.Polygon(points)).buffer(0.0))
    return enclosed


def marks(program: ParsedProgram, rim: Outline) -> list[Mark]:
    """The marks of a part's moves on its rim."""
    across = np.hypot(*(program.end - program.start)[:, :2].T) > STILL_MM
    stroke = program.kind == MoveKind.EXTRUDE
    strokes = np.flatnonzero(stroke)
    left: list[Mark] = []

    def before(row: int) -> int:
        return int(strokes[np.searchsorted(strokes, row) - 1])

    def after(row: int) -> int:
        return int(strokes[min(np.searchsorted(strokes, row), len(strokes) - 1)])

    def mark(what: str, row: int, place: Floats, *beside: int) -> None:
        why = rim.why(place) or ("line" if any(_is_line(program, rim, stroke_row) for stroke_row in beside) else "")
        left.append(Mark(rim.part, what, int(program.line[row]), place, why))

    for run in _runs(rim.low & across & (program.e_mm < 0.0)):
        places = _places(program, run)
        on = rim.on(places)
        if on[-1] or on.sum() * STEP_MM > rim.width_mm:
            mark("wipe", run[-1], places[np.flatnonzero(on)[-1]], before(run[0]))
    for row in np.flatnonzero(rim.low & ~across & (program.e_mm > 0.0)):
        if rim.on(program.end[[row], :2])[0]:
            mark("prime", row, program.end[row, :2], after(row))
    for run in _runs(_richer(program, rim.low & across & stroke)):
        mark("prime", run[0], program.start[run[0], :2], run[0])
    for run in _runs(rim.low & across & ~stroke & (program.e_mm == 0.0)):
        places = _places(program, run)
        on = rim.on(places)
        if on.any():
            beside = [*([before(run[0])] if on[0] else []), *([after(run[-1])] if on[-1] else [])]
            mark("travel", run[0], places[on.argmax()], *beside)
    return left


def _is_line(program: ParsedProgram, rim: Outline, row: int) -> bool:
    """Whether a stroke belongs to an open bead with an end on the rim, which explains its mark."""
    first = last = row
    while first and program.kind[first - 1] == MoveKind.EXTRUDE:
        first -= 1
    while last + 1 < len(program.kind) and program.kind[last + 1] == MoveKind.EXTRUDE:
        last += 1
    begin, end = program.start[first, :2], program.end[last, :2]
    return bool(np.hypot(*(end - begin)) > 2.0 * rim.width_mm and rim.on(np.array([begin, end])).any())


def _richer(program: ParsedProgram, rows: np.ndarray) -> np.ndarray:
    """Mask of strokes of outer walls that get more filament than similar ones."""
    rows = rows & program.rows_of_types(*AT_THE_EDGE)
    if not rows.any():
        return rows
    wide, high = program.width_mm, program.height_mm
    mm3 = ((wide - high) * high + 0.25 * np.pi * high**2) * np.linalg.norm((program.end - program.start)[:, :3], axis=1)
    flow = program.e_mm / np.maximum(mm3, 1e-9)
    return rows & (mm3 > LEAST_MM3) & (flow > RICHER * np.median(flow[rows]))


def _runs(rows: np.ndarray) -> list[Indices]:
    """Runs of consecutive marked rows."""
    at = np.flatnonzero(rows)
    return [run for run in np.split(at, np.flatnonzero(np.diff(at) != 1) + 1) if len(run)]


def _places(program: ParsedProgram, run: Indices) -> Floats:
    """(n, 2) places STEP_MM apart along consecutive moves, the last one at their end."""
    way = shapely.linestrings(np.vstack([program.start[run[:1], :2], program.end[run, :2]]))
    along = np.append(np.arange(0.0, way.length, STEP_MM), way.length)
    return shapely.get_coordinates(shapely.line_interpolate_point(way, along))


def printed(model: Path, settings: Sequence[str]) -> tuple[DryRun, Profile]:
    """A model, printed like `export` does."""
    decomposed = decompose_model(ModelRequest(str(model), load(settings=settings)), to_build=True)
    return build(decomposed.decomposition, decomposed.profile).run, decomposed.profile


def rows(model: Path, settings: Sequence[str], listed: list[str]) -> Iterator[Sequence[object]]:
    """The cells of a model's joints; appends the place of each mark to the list."""
    run, profile = played(model) if model.suffix == ".gcode" else printed(model, settings)
    for joint, outlines in joints(run.program, profile.machine):
        left = [mark for outline in outlines for mark in marks(run.program, outline)]
        cells = [joint.part, f"{joint.rim.length:.0f}"]
        for what in ("wipe", "prime", "travel"):
            mine = [mark for mark in left if mark.what == what]
            cells += [_count([mark for mark in mine if (mark.part == joint.part) == above]) for above in (True, False)]
        yield cells
        listed += [f"{model.name} {mark}" for mark in left]


def _count(left: list[Mark]) -> str:
    must = sum(bool(mark.why) for mark in left)
    return f"{len(left)} ({must})" if must else str(len(left))


def main() -> None:
    """Read the options, print the table."""
    parser = options_of(__doc__)
    parser.add_argument("--list", action="store_true")
    given = parser.parse_args()
    listed: list[str] = []
    table(HEAD, files(given.models, given.every), lambda model: rows(model, given.set, listed))
    print("\n".join(listed if given.list else []))


if __name__ == "__main__":
    main()
