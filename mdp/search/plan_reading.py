"""Plan reading: the file of a plan with each value checked; an error names the file, the key, the value and what is allowed."""

import os
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from mdp.decomposition import FrontRow
from mdp.mesh import parse_colour
from mdp.plane import Plane, unit_direction
from mdp.read import read_in_place
from mdp.search.plan_file import KEYS, MOST_MM, ROW_FIGURES, VERSION, ZONE_KINDS, PlanFile, PlannedPart, height_range
from mdp.sweep.limbs import MOST_JOINED
from mdp.zone import MOST_GROWN_DEG, AnyZone, Brushed, Grown, MeshVolume, Modifier, Painted, Zone, Zones
from profiles.errors import MeshError, PlanError, reason
from profiles.frozen import Vector
from profiles.part_settings import MOST_PARTS, PartSettings
from profiles.toml_text import read_toml

PART_KEYS = ("normal", "offset_mm", "limbs_mm", "process")
BOX_KEYS = ("min_mm", "max_mm", "axes", "room")
ZONE_KEYS = (*BOX_KEYS, "colour", "faces", "point_mm", "angle_deg")
MESH_ZONES = ("no_support", "support")  # kinds that may also be a mesh
MODIFIER_KEYS = (*BOX_KEYS, "z_mm", "mesh", "process")
ROW_KEYS = ("planes", *ROW_FIGURES)
MOST_BYTES = 10_000_000  # far more than the workbench writes; a larger file is refused unread
MOST_ZONES = 1000  # greatest number of each kind; every face is tested against each
MODIFIER_VOLUMES = {"a box": set(BOX_KEYS), "a height range z_mm": {"z_mm"}, "a mesh": {"mesh"}}
MOST_MODIFIERS = 100  # each adds a pass over the layers


def read_plan(path: Path) -> PlanFile:
    """The plan of a file. Raises PlanError with one sentence that names the file, the key, its value and what is allowed."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise PlanError(f"plan {path} has more than {MOST_BYTES} bytes: it is not a plan")
        table = read_toml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise PlanError(f"plan {path} cannot be read: {reason(error)}") from None
    except UnicodeDecodeError as error:
        raise PlanError(f"plan {path} is not text: byte {error.start} is {error.object[error.start]:#04x}") from None
    except ValueError as error:
        raise PlanError(f"plan {path} is not TOML: {error}") from None
    try:
        return _plan(path.name, path.parent, table)
    except PlanError as error:
        raise PlanError(f"plan {path.name}: {error}") from None


def _plan(name: str, folder: Path, table: dict[str, Any]) -> PlanFile:
    _only(table, KEYS, "")
    if type(table.get("version")) is not int or table["version"] != VERSION:
        raise PlanError(f"version is {_show(table.get('version'))}: this program reads version {VERSION}")
    tables = list(enumerate(_list(table, "part", MOST_PARTS), start=1))
    parts = [_part(part, number) for number, part in tables]
    own = {number: _process(part, f"part {number}: ") for number, part in tables if part.get("process")}
    settings = tuple(PartSettings(part=number, process=process) for number, process in own.items())
    if parts and parts[0] != PlannedPart(None, None):
        raise PlanError("part 1 stands on the build plate and has no plane: put an empty [[part]] before the first plane")
    kinds: dict[str, Any] = {
        kind: tuple(_zone(folder, values, kind, f"{kind} {number}: ") for number, values in enumerate(zones, start=1))
        for kind, zones in ((kind, _list(table, kind, MOST_ZONES)) for kind in ZONE_KINDS)
    }
    zones = Zones(**kinds, modifiers=_modifiers(folder, table))
    rows = [_row(row, number) for number, row in enumerate(_list(table, "front", MOST_PARTS), start=1)]
    if len({row.parts for row in rows}) < len(rows):
        raise PlanError("two rows of [[front]] have the same number of planes: one is allowed for each")
    model, sha = _text(table, "model"), _text(table, "sha256")
    turned = None if table.get("orientation") is None else _rotation(table, "orientation")
    return PlanFile(name, model, sha, turned, tuple(parts[1:]), zones, tuple(rows), settings)


def _part(table: dict[str, Any], number: int) -> PlannedPart:
    where = f"part {number}: "
    _only(table, PART_KEYS, where)
    normal = _unit(table["normal"], f"{where}normal") if "normal" in table else None
    offset_mm = _number(table["offset_mm"], f"{where}offset_mm") if "offset_mm" in table else None
    limbs_mm = _points(table["limbs_mm"], f"{where}limbs_mm") if "limbs_mm" in table else ()
    if limbs_mm and (normal is None or offset_mm is None):
        raise PlanError(f"{where}limbs_mm needs both normal and offset_mm: which pieces lie above depends on them")
    return PlannedPart(normal, offset_mm, limbs_mm=limbs_mm)


def _points(value: Any, key: str) -> tuple[Vector, ...]:
    if not isinstance(value, list) or not 1 <= len(value) <= MOST_JOINED:
        raise PlanError(f"{key} is {_show(value)}: a list of 1 to {MOST_JOINED} points is expected, such as [[0, 12, 48]]")
    return tuple(_vector(point, key) for point in value)


def _process(table: dict[str, Any], where: str) -> dict[str, Any]:
    process = table.get("process")
    if not isinstance(process, dict) or not process:
        raise PlanError(f"{where}process is {_show(process)}: keys and values are expected, as {{walls = 4}}")
    return process


def _row(table: dict[str, Any], number: int) -> FrontRow:
    where = f"front {number}: "
    _only(table, ROW_KEYS, where)
    planes = table.get("planes")
    if not isinstance(planes, list) or len(planes) >= MOST_PARTS:
        raise PlanError(f"{where}planes is {_show(planes)}: a list of [x, y, z, offset_mm] is expected")
    cuts = tuple(_row_plane(plane, f"{where}planes") for plane in planes)[::-1]
    support_area_mm2, seam_mm, stairs_mm2, cost_mm2 = (_number(table.get(key, 0.0), where + key, 1e15) for key in ROW_FIGURES)
    return FrontRow(cuts, support_area_mm2, seam_mm, cost_mm2, stairs_mm2=stairs_mm2)


def _row_plane(numbers: Any, key: str) -> Plane:
    """A plane from its four numbers, and three more for each of its limbs."""
    limbs = (len(numbers) - 4) // 3 if isinstance(numbers, list) else 0
    values = _numbers(numbers, key, 4 + 3 * min(max(limbs, 0), MOST_JOINED))
    points = [_vector(values[at : at + 3], key) for at in range(4, len(values), 3)]
    normal = np.array(_unit(values[:3], key))
    return Plane(normal, _number(values[3], key), np.array(points) if points else None)


def _zone(folder: Path, values: dict[str, Any], key: str, where: str) -> AnyZone:
    _only(values, (*ZONE_KEYS, *(("mesh",) if key in MESH_ZONES else ())), where)
    if "mesh" in values:
        if len(values) > 1:
            raise PlanError(f"{where.rstrip(': ')} has a mesh and {', '.join(values.keys() - {'mesh'})}: one of them is allowed")
        return _solid(folder, values, where)
    if "colour" in values:
        return _painted(values, where)
    if "faces" in values:
        return _brushed(values, where)
    return _grown(values, where) if "point_mm" in values or "angle_deg" in values else _box(values, where)


def _box(values: dict[str, Any], where: str) -> Zone:
    low, high = (_vector(values.get(corner), where + corner) for corner in ("min_mm", "max_mm"))
    if not all(least < most for least, most in zip(low, high, strict=True)):
        raise PlanError(f"{where}min_mm is {list(low)} and max_mm {list(high)}: each number of min_mm must be less")
    axes, room = _rotation(values, f"{where}axes") if "axes" in values else None, values.get("room")
    if room is None:
        return Zone(low, high, axes)
    if not isinstance(room, dict):
        expected = "a box is expected, such as {min_mm = [0, 0, 0], max_mm = [9, 9, 9]}"
        raise PlanError(f"{where}room is {_show(room)}: {expected}")
    _only(room, BOX_KEYS, f"{where}room ")
    return Zone(low, high, axes, _box(room, f"{where}room "))


def _modifiers(folder: Path, table: dict[str, Any]) -> tuple[Modifier, ...]:
    modifiers = []
    for number, values in enumerate(_list(table, "modifier", MOST_MODIFIERS), start=1):
        where = f"modifier {number}: "
        _only(values, MODIFIER_KEYS, where)
        kinds = [kind for kind, keys in MODIFIER_VOLUMES.items() if not keys.isdisjoint(values)]
        if len(kinds) != 1:
            given = " and ".join(kinds) or "no volume"
            raise PlanError(f"{where.rstrip(': ')} has {given}: one of {', '.join(MODIFIER_VOLUMES)} is expected")
        modifiers.append(Modifier(_volume(folder, values, where), _process(values, where)))
    return tuple(modifiers)


def _volume(folder: Path, values: dict[str, Any], where: str) -> Zone | MeshVolume:
    if "mesh" in values:
        return _solid(folder, values, where)
    if "z_mm" not in values:
        return _box(values, where)
    low, high = (_number(z, f"{where}z_mm") for z in _numbers(values["z_mm"], f"{where}z_mm", 2))
    if low >= high:
        raise PlanError(f"{where}z_mm is {[low, high]}: the first number must be less")
    return height_range(low, high)


def _solid(folder: Path, values: dict[str, Any], where: str) -> MeshVolume:
    if not _text(values, "mesh"):
        raise PlanError(f"{where}mesh is {_show(values['mesh'])}: the name of a model's file is expected")
    file = folder / values["mesh"]
    try:
        return MeshVolume(Path(os.path.abspath(file)), read_in_place(file))
    except MeshError as error:
        raise PlanError(f"{where}mesh {error}") from None


def _grown(values: dict[str, Any], where: str) -> Grown:
    if not set(values) <= {"point_mm", "angle_deg"}:
        raise PlanError(f"{where.rstrip(': ')} has a point and a box: one of them is allowed")
    point_mm = _vector(values.get("point_mm"), f"{where}point_mm")
    angle_deg = _number(values.get("angle_deg"), f"{where}angle_deg")
    if not 0.0 <= angle_deg <= MOST_GROWN_DEG:
        raise PlanError(f"{where}angle_deg is {angle_deg:g}: 0 to {MOST_GROWN_DEG:g} is allowed")
    return Grown(point_mm, angle_deg)


def _painted(values: dict[str, Any], where: str) -> Painted:
    if len(values) > 1:
        beside = "a point" if set(values) & {"point_mm", "angle_deg"} else "a box"
        raise PlanError(f"{where.rstrip(': ')} has a colour and {beside}: one of them is allowed")
    text = values["colour"]
    colour = parse_colour(text) if isinstance(text, str) else None
    if colour is None:
        raise PlanError(f'{where}colour is {_show(text)}: # and six hexadecimal digits are expected, as "#ff0000"')
    return Painted(colour)


def _brushed(values: dict[str, Any], where: str) -> Brushed:
    if len(values) > 1:
        raise PlanError(f"{where.rstrip(': ')} has faces and {', '.join(values.keys() - {'faces'})}: one of them is allowed")
    try:
        return Brushed(_text(values, "faces"))
    except ValueError as error:
        raise PlanError(f"{where}faces is {_show(values['faces'])}: {error}") from None


def _rotation(table: dict[str, Any], key: str) -> tuple[Vector, Vector, Vector]:
    """The rows of a rotation. key: name for messages, whose last word is the table's key."""
    given = table[key.split()[-1]]
    rows = tuple(_vector(row, key) for row in (given if isinstance(given, list) else [given]))
    matrix = np.array(rows)
    turns = matrix.shape == (3, 3) and np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6) and np.linalg.det(matrix) > 0
    if not turns:
        raise PlanError(f"{key} is {_show(given)}: a rotation is expected, three rows of three numbers")
    return rows[0], rows[1], rows[2]


def _list(table: dict[str, Any], key: str, most: int) -> list[dict[str, Any]]:
    tables = table.get(key, [])
    if not isinstance(tables, list) or not all(isinstance(entry, dict) for entry in tables):
        raise PlanError(f"{key} is {_show(tables)}: [[{key}]] tables are expected")
    if len(tables) > most:
        raise PlanError(f"there are {len(tables)} [[{key}]] tables: up to {most} are allowed")
    return tables


def _only(table: dict[str, Any], allowed: Sequence[str], where: str) -> None:
    for key in table:
        if key not in allowed:
            raise PlanError(f"{where}{_show(key)} is not a key of a plan: {', '.join(allowed)} are allowed")


def _text(table: dict[str, Any], key: str) -> str:
    value = table.get(key, "")
    if not isinstance(value, str):
        raise PlanError(f"{key} is {_show(value)}: a text is expected")
    return value


def _unit(value: Any, key: str) -> Vector:
    direction = unit_direction(*_numbers(value, key, 3))
    if direction is None:
        raise PlanError(f"{key} is {_show(value)}: a direction of a length of about 1 is expected")
    return direction


def _vector(value: Any, key: str) -> Vector:
    x, y, z = (_number(entry, key) for entry in _numbers(value, key, 3))
    return x, y, z


def _number(value: Any, key: str, most: float = MOST_MM) -> float:
    if not _is_number(value):
        raise PlanError(f"{key} is {_show(value)}: a number is expected")
    if abs(value) > most:
        raise PlanError(f"{key} is {_show(value)}: {-most:g} to {most:g} is allowed")
    return float(value)


def _numbers(value: Any, key: str, count: int) -> list[float]:
    if not isinstance(value, list) or len(value) != count or not all(map(_is_number, value)):
        raise PlanError(f"{key} is {_show(value)}: {count} numbers in brackets are expected")
    return [float(entry) for entry in value]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300 and isfinite(value)


def _show(value: Any) -> str:
    """A value in a form for messages: short, on one line."""
    try:
        text = "missing" if value is None else repr(value)
    except ValueError:  # Python refuses to write a number of thousands of digits
        return "a number of thousands of digits"
    return text if len(text) <= 60 else text[:60] + "..."
