"""Plan writing: the text of a plan file, with comments for the reader."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from mdp.decomposition import FrontRow
from mdp.mesh import colour_text
from mdp.plane import Plane
from mdp.search.plan_file import ROW_FIGURES, VERSION, ZONE_KINDS, PlanFile, PlannedPart, height_range
from mdp.zone import AnyZone, Brushed, Grown, MeshVolume, Modifier, Painted, Zone


def plan_text(plan: PlanFile, folder: Path | None = None) -> str:
    """The content of a plan file. folder: the folder in which it will be; None if unknown, so the files that it names have
    absolute paths.
    """
    document = tomlkit.document()
    count = len(plan.parts) + 1
    document.add(tomlkit.comment(f"How a model is cut into {count} part{'s' * (count > 1)}, in print order; use it with --plan."))
    document["version"] = VERSION
    document["model"] = plan.model
    document["sha256"] = plan.sha256
    if plan.orientation is not None:
        document["orientation"] = [list(row) for row in plan.orientation]
    parts = (PlannedPart(None, None, "part 1 stands on the build plate"), *plan.parts)
    settings = {part.part: part.process for part in plan.settings}
    document["part"] = _tables([_part_table(part, settings.get(k, {})) for k, part in enumerate(parts, start=1)])
    for kind in ZONE_KINDS:
        zones: Sequence[AnyZone] = getattr(plan.zones, kind)
        if zones:
            document[kind] = _tables([_table(_zone_values(zone, folder)) for zone in zones])
    if plan.zones.modifiers:
        document["modifier"] = _tables([_modifier_table(modifier, folder) for modifier in plan.zones.modifiers])
    if plan.front:
        document["front"] = _tables([_row_table(row) for row in plan.front])
    return tomlkit.dumps(document)


def _zone_values(zone: AnyZone, folder: Path | None) -> dict[str, Any]:
    if isinstance(zone, Painted):
        return {"colour": colour_text(zone.colour)}
    if isinstance(zone, Grown):
        return {"point_mm": list(zone.point_mm), "angle_deg": zone.angle_deg}
    if isinstance(zone, Brushed):
        return {"faces": zone.numbers}
    if isinstance(zone, MeshVolume):
        return {"mesh": _path_from(folder, zone.file)}
    assert isinstance(zone, Zone)  # triangles only come from marks in a model's own file
    leaning = {} if zone.axes is None else {"axes": [list(axis) for axis in zone.axes]}
    room = {} if zone.room is None else {"room": _inline(_zone_values(zone.room, folder))}
    return {"min_mm": list(zone.min_mm), "max_mm": list(zone.max_mm), **leaning, **room}


def _modifier_table(modifier: Modifier, folder: Path | None) -> tomlkit.items.Table:
    volume, values = modifier.volume, _zone_values(modifier.volume, folder)
    if isinstance(volume, Zone) and volume == height_range(volume.min_mm[2], volume.max_mm[2]):
        values = {"z_mm": [volume.min_mm[2], volume.max_mm[2]]}
    return _table({**values, "process": _inline(modifier.process)})


def _path_from(folder: Path | None, file: Path) -> str:
    if folder is None or folder.absolute().anchor != file.anchor:
        return file.as_posix()
    return Path(os.path.relpath(file, folder.absolute())).as_posix()


def _inline(values: Mapping[str, Any]) -> tomlkit.items.InlineTable:
    table = tomlkit.inline_table()
    table.update(values)
    return table


def _table(values: dict[str, Any]) -> tomlkit.items.Table:
    table = tomlkit.table()
    table.update(values)
    return table


def _tables(tables: Sequence[tomlkit.items.Table]) -> tomlkit.items.AoT:
    array = tomlkit.aot()
    for table in tables:
        array.append(table)
    return array


def _part_table(part: PlannedPart, process: Mapping[str, Any]) -> tomlkit.items.Table:
    table = tomlkit.table()
    if part.remark:
        table.add(tomlkit.comment(part.remark))
        if part.normal is None and not process:
            table.add(tomlkit.nl())
    if part.normal is not None:
        table["normal"] = list(part.normal)
    if part.offset_mm is not None:
        table["offset_mm"] = part.offset_mm
    if part.limbs_mm:
        table["limbs_mm"] = [list(point) for point in part.limbs_mm]
    if process:
        table["process"] = _inline(process)
    return table


def _numbers(plane: Plane) -> list[float]:
    """A plane in a front row: its normal, its offset, and the points of its limbs."""
    limbs_mm = [] if plane.limbs_mm is None else plane.limbs_mm.ravel().tolist()
    return [*plane.normal.tolist(), plane.offset_mm, *limbs_mm]


def _row_table(row: FrontRow) -> tomlkit.items.Table:
    """A row of the front, each plane on a line of its own."""
    table = tomlkit.table()
    table.add(tomlkit.comment(f"{row.parts} part{'s' * (row.parts > 1)}"))
    planes = tomlkit.array()
    planes.extend([_numbers(plane) for plane in reversed(row.planes)])
    table["planes"] = planes.multiline(row.parts > 2)
    table.update({figure: float(getattr(row, figure)) for figure in ROW_FIGURES})
    return table
