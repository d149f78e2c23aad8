"""Plan file: a decomposition as a small TOML file that a person can read, change and use again.

    version = 1
    model = "kitten.off"
    sha256 = "..."                      # of the model as it was cut; another model is refused

    [[part]]                            # in print order; part 1 stands on the platform
    [[part]]
    normal = [0.0, 0.5, 0.8660254]      # printing direction; its base plane: the points p with normal . p = offset_mm
    offset_mm = 31.0

    [[keep]]                            # no plane passes through this box of the workpiece frame
    min_mm = [-5.0, -5.0, 20.0]
    max_mm = [5.0, 5.0, 30.0]

    [[no_seam]]                         # seams here count a hundred times: a box, or the faces of a colour of the model's file
    colour = "#00ff00"

    [[front]]                           # the best decomposition of every other number of parts, for --parts
    planes = [[0.0, 0.0, 1.0, 40.0]]    # normal and offset_mm of part 2, 3, ...

A file of planes by hand needs no sha256, and a part may leave out `normal` or `offset_mm`: the search completes it.
"""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from math import hypot, isfinite
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from mdp.colour import colour_text, parse_colour
from mdp.decomposition import Decomposition, FrontRow
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from mdp.zone import NO_ZONES, Painted, Zone, Zones
from profiles.errors import PlanError
from profiles.machine import Vector

VERSION = 1
MOST_BYTES = 10_000_000
MOST_PARTS, MOST_ZONES = 1000, 1000
LEAST_NORMAL, MOST_NORMAL, MOST_MM = 1e-6, 1e6, 1e5
UNIT = 1e-12  # a normal whose length differs less from 1 is left as it is, so that a plan gives the same bits again
GRID_MM, GRID_SHIFT = 1e-3, 0.3141  # of what a sha256 tells apart; shifted, for coordinates lie on whole and half micrometres
KEYS = ("version", "model", "sha256", "orientation", "part", "keep", "no_seam", "front")
PART_KEYS = ("normal", "offset_mm")
ZONE_KEYS = ("min_mm", "max_mm", "colour")
ROW_KEYS = ("planes", "support_area_mm2", "seam_mm", "cost_mm2")


@dataclass(frozen=True)
class PlannedPart:
    """The base plane of a part, its normal of length 1; None: to be found by the search. remark: a comment for the reader."""

    normal: Vector | None
    offset_mm: float | None
    remark: str = field(default="", compare=False)

    @property
    def plane(self) -> Plane | None:
        """The plane where it is given whole."""
        return None if self.normal is None or self.offset_mm is None else Plane(np.array(self.normal), self.offset_mm)


@dataclass(frozen=True)
class PlannedRow:
    """A decomposition into some other number of parts: its parts from the second on, and what it costs."""

    parts: tuple[PlannedPart, ...]
    support_area_mm2: float = 0.0
    seam_mm: float = 0.0
    cost_mm2: float = 0.0

    @property
    def planes(self) -> tuple[Plane, ...]:
        """The planes in the order of the cuts, which is the reverse of the print order."""
        return tuple(plane for part in reversed(self.parts) if (plane := part.plane) is not None)


@dataclass(frozen=True)
class PlanFile:
    """What a file holds. name: the file's; sha256: of the model it was made of, "": made by hand for any; orientation: rows of
    the rotation that laid the model down before it was cut, None: it stands as in its file; parts: in print order, without
    part 1; front: one row for every number of parts."""

    name: str
    model: str = ""
    sha256: str = ""
    orientation: tuple[Vector, ...] | None = None
    parts: tuple[PlannedPart, ...] = ()
    zones: Zones = NO_ZONES
    front: tuple[PlannedRow, ...] = ()

    def row(self, most_parts: int) -> tuple[PlannedPart, ...]:
        """The parts, from the second on, of the row with the most parts that are at most so many. Raises PlanError."""
        rows = {len(row.parts) + 1: row.parts for row in self.front} | {len(self.parts) + 1: self.parts}
        allowed = [count for count in rows if count <= most_parts]
        if not allowed:
            counts = ", ".join(map(str, sorted(rows)))
            raise PlanError(f"{self.name} holds no decomposition into {most_parts} parts or fewer, only into {counts}")
        return rows[max(allowed)]


def mesh_sha256(mesh: Mesh) -> str:
    """A word for the faces of a mesh and its vertices to the micrometre, the same on every machine."""
    vertices = np.floor(mesh.vertices / GRID_MM + GRID_SHIFT).astype("<i8")
    return sha256(vertices.tobytes() + mesh.faces.astype("<i4").tobytes()).hexdigest()


def plan_of(decomposition: Decomposition, zones: Zones = NO_ZONES, orientation: Floats | None = None) -> PlanFile:
    """The plan of a decomposition."""
    rows = tuple(_row(row) for row in decomposition.front)
    parts = tuple(
        PlannedPart(
            _vector(part.base.normal),
            float(part.base.offset_mm),
            f"part {part.index}: {part.volume_mm3 / 1000:.2f} cm3, printed at tilt {part.pose.tilt_deg:.2f} and turn "
            f"{part.pose.turn_deg:.2f} deg",
        )
        for part in decomposition.parts[1:]
    )
    turned = None if orientation is None else tuple(_vector(row) for row in orientation)
    sha = mesh_sha256(decomposition.mesh)
    return PlanFile("plan.toml", decomposition.name, sha, turned, parts, zones, rows)


def plan_text(plan: PlanFile) -> str:
    """The content of a plan's file."""
    document = tomlkit.document()
    count = len(plan.parts) + 1
    document.add(tomlkit.comment(f"How a model is cut into {count} part{'s' * (count > 1)}, in print order; use it with --plan."))
    document["version"] = VERSION
    document["model"] = plan.model
    document["sha256"] = plan.sha256
    if plan.orientation is not None:
        document["orientation"] = [list(row) for row in plan.orientation]
    document["part"] = _tables(
        [_part_table(PlannedPart(None, None, "part 1 stands on the platform")), *map(_part_table, plan.parts)]
    )
    for key, zones in (("keep", plan.zones.keep), ("no_seam", plan.zones.no_seam)):
        if zones:
            document[key] = _tables([_table(_zone_values(zone)) for zone in zones])
    if plan.front:
        document["front"] = _tables([_row_table(row) for row in plan.front])
    return tomlkit.dumps(document)


def read_plan(path: Path) -> PlanFile:
    """The plan of a file. Raises PlanError with one sentence that names the file, the key, its value and what is allowed."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise PlanError(f"plan {path} has more than {MOST_BYTES} bytes: it is no plan")
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise PlanError(f"plan {path} cannot be read: {(error.strerror or str(error)).lower()}") from None
    except UnicodeDecodeError as error:
        raise PlanError(f"plan {path} is not text: byte {error.start} is {error.object[error.start]:#04x}") from None
    except (ValueError, RecursionError) as error:  # tomllib's own errors are ValueErrors
        raise PlanError(f"plan {path} is no TOML: {' '.join(str(error).split())[:200]}") from None
    return _Reader(path.name).plan(table)


@dataclass(frozen=True)
class _Reader:
    """Checks the values of one file."""

    name: str

    def plan(self, table: dict[str, Any]) -> PlanFile:
        self._only(table, KEYS, "")
        if type(table.get("version")) is not int or table["version"] != VERSION:
            raise self._error(f"version is {_show(table.get('version'))}: this program reads version {VERSION}")
        parts = [self._part(part, number) for number, part in enumerate(self._list(table, "part", MOST_PARTS), start=1)]
        if parts and parts[0] != PlannedPart(None, None):
            raise self._error("part 1 stands on the platform and has no plane: put an empty [[part]] before the first plane")
        keep, no_seam = (self._zones(table, key) for key in ("keep", "no_seam"))
        rows = [self._row(row, number) for number, row in enumerate(self._list(table, "front", MOST_PARTS), start=1)]
        if len({len(row.parts) for row in rows}) < len(rows):
            raise self._error("two rows of [[front]] have the same number of planes: one is allowed for each")
        model, sha = self._text(table, "model"), self._text(table, "sha256")
        return PlanFile(self.name, model, sha, self._orientation(table), tuple(parts[1:]), Zones(keep, no_seam), tuple(rows))

    def _part(self, table: dict[str, Any], number: int) -> PlannedPart:
        where = f"part {number}: "
        self._only(table, PART_KEYS, where)
        normal = self._unit(table["normal"], f"{where}normal") if "normal" in table else None
        offset_mm = self._number(table["offset_mm"], f"{where}offset_mm") if "offset_mm" in table else None
        return PlannedPart(normal, offset_mm)

    def _row(self, table: dict[str, Any], number: int) -> PlannedRow:
        where = f"front {number}: "
        self._only(table, ROW_KEYS, where)
        planes = table.get("planes")
        if not isinstance(planes, list) or len(planes) >= MOST_PARTS:
            raise self._error(f"{where}planes is {_show(planes)}: a list of [x, y, z, offset_mm] is expected")
        parts = []
        for plane in planes:
            values = self._numbers(plane, f"{where}planes", 4)
            parts.append(PlannedPart(self._unit(values[:3], f"{where}planes"), self._number(values[3], f"{where}planes")))
        support, seam, cost = (self._number(table.get(key, 0.0), where + key, 1e15) for key in ROW_KEYS[1:])
        return PlannedRow(tuple(parts), support, seam, cost)

    def _zones(self, table: dict[str, Any], key: str) -> tuple[Zone | Painted, ...]:
        zones: list[Zone | Painted] = []
        for number, values in enumerate(self._list(table, key, MOST_ZONES), start=1):
            where = f"{key} {number}: "
            self._only(values, ZONE_KEYS, where)
            if "colour" in values:
                zones.append(self._painted(values, where))
                continue
            low, high = (self._vector(values.get(corner), where + corner) for corner in ZONE_KEYS[:2])
            if not all(least < most for least, most in zip(low, high, strict=True)):
                raise self._error(f"{where}min_mm is {list(low)} and max_mm {list(high)}: each number of min_mm must be less")
            zones.append(Zone(low, high))
        return tuple(zones)

    def _painted(self, values: dict[str, Any], where: str) -> Painted:
        if len(values) > 1:
            raise self._error(f"{where}has a colour and a box: one of them is allowed")
        text = values["colour"]
        colour = parse_colour(text) if isinstance(text, str) else None
        if colour is None:
            raise self._error(f'{where}colour is {_show(text)}: # and six hexadecimal digits are expected, as "#ff0000"')
        return Painted(colour)

    def _orientation(self, table: dict[str, Any]) -> tuple[Vector, ...] | None:
        given = table.get("orientation")
        if given is None:
            return None
        rows = tuple(self._vector(row, "orientation") for row in (given if isinstance(given, list) else [given]))
        matrix = np.array(rows)
        turns = matrix.shape == (3, 3) and np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6) and np.linalg.det(matrix) > 0
        if not turns:
            raise self._error(f"orientation is {_show(given)}: a rotation is expected, three rows of three numbers")
        return rows

    def _list(self, table: dict[str, Any], key: str, most: int) -> list[dict[str, Any]]:
        tables = table.get(key, [])
        if not isinstance(tables, list) or not all(isinstance(each, dict) for each in tables):
            raise self._error(f"{key} is {_show(tables)}: [[{key}]] tables are expected")
        if len(tables) > most:
            raise self._error(f"there are {len(tables)} [[{key}]] tables: up to {most} are allowed")
        return tables

    def _only(self, table: dict[str, Any], allowed: Sequence[str], where: str) -> None:
        for key in table:
            if key not in allowed:
                raise self._error(f"{where}{_show(key)} is no key of a plan: {', '.join(allowed)} are allowed")

    def _text(self, table: dict[str, Any], key: str) -> str:
        value = table.get(key, "")
        if not isinstance(value, str):
            raise self._error(f"{key} is {_show(value)}: a text is expected")
        return value

    def _unit(self, value: Any, key: str) -> Vector:
        x, y, z = self._numbers(value, key, 3)
        length = hypot(x, y, z)
        if not LEAST_NORMAL <= length <= MOST_NORMAL:
            raise self._error(f"{key} is {_show(value)}: a direction of a length of about 1 is expected")
        return (x, y, z) if abs(x * x + y * y + z * z - 1.0) <= UNIT else (x / length, y / length, z / length)

    def _vector(self, value: Any, key: str) -> Vector:
        x, y, z = (self._number(each, key) for each in self._numbers(value, key, 3))
        return x, y, z

    def _number(self, value: Any, key: str, most: float = MOST_MM) -> float:
        if not _is_number(value):
            raise self._error(f"{key} is {_show(value)}: a number is expected")
        if abs(value) > most:
            raise self._error(f"{key} is {_show(value)}: {-most:g} to {most:g} is allowed")
        return float(value)

    def _numbers(self, value: Any, key: str, count: int) -> list[float]:
        if not isinstance(value, list) or len(value) != count or not all(map(_is_number, value)):
            raise self._error(f"{key} is {_show(value)}: {count} numbers in brackets are expected")
        return [float(each) for each in value]

    def _error(self, text: str) -> PlanError:
        return PlanError(f"plan {self.name}: {text}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300 and isfinite(value)


def _show(value: Any) -> str:
    """A value as it may stand in a message: short, on one line."""
    try:
        text = "missing" if value is None else repr(value)
    except ValueError:  # Python writes no number of thousands of digits
        return "a number of thousands of digits"
    return text if len(text) <= 60 else text[:60] + "..."


def _row(row: FrontRow) -> PlannedRow:
    parts = tuple(PlannedPart(_vector(plane.normal), float(plane.offset_mm)) for plane in reversed(row.planes))
    return PlannedRow(parts, float(row.support_area_mm2), float(row.seam_mm), float(row.cost_mm2))


def _vector(values: Floats) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _zone_values(zone: Zone | Painted) -> dict[str, Any]:
    if isinstance(zone, Painted):
        return {"colour": colour_text(zone.colour)}
    return {"min_mm": list(zone.min_mm), "max_mm": list(zone.max_mm)}


def _table(values: dict[str, Any]) -> tomlkit.items.Table:
    table = tomlkit.table()
    table.update(values)
    return table


def _tables(tables: Sequence[tomlkit.items.Table]) -> tomlkit.items.AoT:
    array = tomlkit.aot()
    for table in tables:
        array.append(table)
    return array


def _part_table(part: PlannedPart) -> tomlkit.items.Table:
    table = tomlkit.table()
    if part.remark:
        table.add(tomlkit.comment(part.remark))
        if part.normal is None:
            table.add(tomlkit.nl())
    if part.normal is not None:
        table["normal"] = list(part.normal)
    if part.offset_mm is not None:
        table["offset_mm"] = part.offset_mm
    return table


def _row_table(row: PlannedRow) -> tomlkit.items.Table:
    """A row of the front, each plane on a line of its own."""
    table = tomlkit.table()
    count = len(row.parts) + 1
    table.add(tomlkit.comment(f"{count} part{'s' * (count > 1)}"))
    planes = tomlkit.array()
    planes.extend([[*plane.normal.tolist(), plane.offset_mm] for part in row.parts if (plane := part.plane) is not None])
    table["planes"] = planes.multiline(len(row.parts) > 1)
    values = (row.support_area_mm2, row.seam_mm, row.cost_mm2)
    table.update(dict(zip(ROW_KEYS[1:], values, strict=True)))
    return table
