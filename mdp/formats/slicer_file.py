"""Slicer file: a 3MF saved by a slicer, and the role of each volume in it: printed, subtracted from others, or only a mark.

PrusaSlicer keeps all volumes of an object in one mesh and lists their triangles in Slic3r_PE_model.config; Bambu Studio and
OrcaSlicer have one component per volume and its role in model_settings.config; Cura puts the role into the metadata of objects.
(PrusaSlicer, src/libslic3r/Format/3mf.cpp; BambuStudio, src/libslic3r/Format/bbs_3mf.cpp; libSavitar, SceneNode.cpp.)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from math import isfinite, nan
from xml.etree.ElementTree import Element

from mdp.formats.surface import Surface
from profiles.errors import counted

PART, NEGATIVE, MODIFIER, SUPPORT, NO_SUPPORT = "part", "negative volume", "modifier", "support enforcer", "support blocker"
FOR, AGAINST = 1, 2  # paint values; 0: unpainted
# shares of the area, by the number of sides that are halved
CHILDREN = ((), (0.5, 0.5), (0.25, 0.25, 0.5), (0.25, 0.25, 0.25, 0.25))
LONG = 3  # as a paint: its value is in the next digit
# Kinds of volume that are painted triangles of a part, by the purpose and value of the paint.
PAINT_SUPPORT, PAINT_NO_SUPPORT, PAINT_NO_SEAM = "paint for support", "paint against support", "paint against seams"
PAINTS = {("support", FOR): PAINT_SUPPORT, ("support", AGAINST): PAINT_NO_SUPPORT, ("seams", AGAINST): PAINT_NO_SEAM}
VOLUME_TYPES = {  # PrusaSlicer's, then those of Bambu Studio and OrcaSlicer
    "ModelPart": PART,
    "NegativeVolume": NEGATIVE,
    "ParameterModifier": MODIFIER,
    "SupportEnforcer": SUPPORT,
    "SupportBlocker": NO_SUPPORT,
    "normal_part": PART,
    "negative_part": NEGATIVE,
    "modifier_part": MODIFIER,
    "support_enforcer": SUPPORT,
    "support_blocker": NO_SUPPORT,
}
CURA = "cura:"  # prefix of its settings in metadata
CURA_MESHES = {
    "anti_overhang_mesh": NO_SUPPORT,
    "support_mesh": SUPPORT,
    "infill_mesh": MODIFIER,
    "cutting_mesh": MODIFIER,
}
ON = ("1", "true", "yes")
# Keys among an object's or a volume's settings that only say where it came from.
ABOUT = frozenset({"name", "matrix", "modifier", "volume_type", "part_type", "extruder_nr", "print_order", "drop_to_buildplate"})
ABOUT_PREFIXES = ("source_", "thumbnail_", "cut_", "text_")
# A build plate: its number, its name, and the IDs of its objects, each with an instance number.
Plate = tuple[int, str, frozenset[tuple[str, int]]]
# Settings for ranges of height above an object's lowest point, mm.
Heights = Sequence[tuple[float, float, Mapping[str, str]]]
ONE_EXTRUDER = {"extruder": ("0", "1")}  # settings without meaning for a printer with one extruder


@dataclass(frozen=True)
class Role:
    """The kind of an object's volume, and its own settings under the names of the file's program."""

    kind: str = PART
    name: str = ""
    settings: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class BuildObject:
    """An object on the plate: its volumes, mm, in the file's placement, and the settings for all of them."""

    volumes: Sequence[tuple[Surface, Role]]
    settings: Mapping[str, str] = field(default_factory=dict)
    heights: Heights = ()
    name: str = ""

    def surfaces(self, kind: str) -> list[Surface]:
        """The surfaces of a kind of volume."""
        return [surface for surface, role in self.volumes if role.kind == kind]


@dataclass(frozen=True, eq=False)
class Build:
    """The objects that a file prints, and notes on what is left out. on_plate: z = 0 is the build plate, below which nothing is
    printed; plates: the names of all plates with objects, by number.
    """

    objects: Sequence[BuildObject]
    notes: Sequence[str] = ()
    on_plate: bool = False
    plates: Mapping[int, str] = field(default_factory=dict)


def read_prusaslicer(config: Element) -> tuple[dict[str, Role], dict[str, list[tuple[int, int, Role]]]]:
    """PrusaSlicer's objects by ID, and the volumes of each: their first and last triangle in the object's mesh.

    Raises ValueError if a triangle number is not a number.
    """
    objects, triangles = dict[str, Role](), dict[str, list[tuple[int, int, Role]]]()
    for element in config.iter("object"):
        number = element.get("id", "")
        objects[number] = _role(element)
        triangles[number] = [
            (_integer("firstid", volume.get("firstid")), _integer("lastid", volume.get("lastid")), _role(volume))
            for volume in element.findall("volume")
        ]
    return objects, triangles


def read_bambu(config: Element) -> tuple[dict[str, Role], dict[tuple[str, str], Role], list[Plate]]:
    """Bambu Studio's objects by ID, its parts by the IDs of object and component, and its plates.

    Raises ValueError for text that is not a number.
    """
    objects, parts = dict[str, Role](), dict[tuple[str, str], Role]()
    for element in config.findall("object"):
        number = element.get("id", "")
        objects[number] = _role(element)
        for part in element.findall("part"):
            parts[number, part.get("id", "")] = _role(part)
    plates = list[Plate]()
    for place, element in enumerate(config.findall("plate"), start=1):
        values = _values(element)
        instances = [_values(instance) for instance in element.findall("model_instance")]
        standing = frozenset(
            (instance.get("object_id", ""), _integer("instance_id", instance.get("instance_id", "0"))) for instance in instances
        )
        plates.append((_integer("plater_id", values.get("plater_id", str(place))), values.get("plater_name", ""), standing))
    return objects, parts, plates


def read_heights(config: Element) -> dict[str, list[tuple[float, float, Mapping[str, str]]]]:
    """Settings of height ranges, by the object's position among all objects (PrusaSlicer: among those with a mesh), from 1.

    Raises ValueError for a height that is not a finite number.
    """
    heights: dict[str, list[tuple[float, float, Mapping[str, str]]]] = {}
    for element in config.iter("object"):
        for between in element.findall("range"):
            settings = {option.get("opt_key", ""): (option.text or "").strip() for option in between.findall("option")}
            low, high = (_height_mm(between, name) for name in ("min_z", "max_z"))
            heights.setdefault(element.get("id", ""), []).append((low, high, _settings(settings)))
    return heights


def _integer(name: str, text: str | None) -> int:
    if text is None or not text.strip().isascii() or not text.strip().removeprefix("-").isdigit():
        raise ValueError(f"{name} is {text!r}: a whole number is expected")
    return int(text)


def _height_mm(between: Element, name: str) -> float:
    text = between.get(name, "")
    try:
        height_mm = float(text)
    except ValueError:
        height_mm = nan
    if not isfinite(height_mm):
        raise ValueError(f"{name} of a height range is {text!r}: a number is expected")
    return height_mm


def read_cura(element: Element) -> Role:
    """The role that Cura gives an object, from its metadata or, in older files, from its settings."""
    values = {child.get("setting_key", ""): child.text or "" for child in element.findall("{*}settings/{*}setting")}
    for child in element.findall("{*}metadatagroup/{*}metadata"):
        name = child.get("name", "")
        if name.startswith(CURA):
            values[name.removeprefix(CURA)] = child.text or ""
    values = {key: text.strip() for key, text in values.items()}
    kind = next((kind for key, kind in CURA_MESHES.items() if values.get(key, "").lower() in ON), PART)
    settings = {key: text for key, text in _settings(values).items() if key not in CURA_MESHES}
    return Role(kind, element.get("name", ""), settings)


def _values(element: Element) -> dict[str, str]:
    return {entry.get("key", ""): entry.get("value", "") for entry in element.findall("metadata")}


def _role(element: Element) -> Role:
    """The role of an object, a volume or a part, from its element in a config."""
    values = _values(element)
    kind_name = element.get("subtype") or values.get("volume_type") or values.get("part_type", "")
    if kind_name and kind_name not in VOLUME_TYPES:
        raise ValueError(
            f"the kind of {values.get('name') or 'a volume'} is {kind_name!r}: one of {', '.join(VOLUME_TYPES)} is expected"
        )
    kind = VOLUME_TYPES.get(kind_name) or (MODIFIER if values.get("modifier") == "1" else PART)
    return Role(kind, values.get("name", ""), _settings(values))


def _settings(values: Mapping[str, str]) -> dict[str, str]:
    return {
        key: text
        for key, text in values.items()
        if key and key not in ABOUT and not key.startswith(ABOUT_PREFIXES) and text not in ONE_EXTRUDER.get(key, ())
    }


@lru_cache(maxsize=4096)  # most triangles have one paint
def painted_shares(digits: str) -> Mapping[int, float]:
    """Shares of a triangle's area by paint value, for a triangle that a brush covers in part.

    Hexadecimal digits, read from the last, walk a tree of triangles. A digit's lower two bits give the number of halved sides. If
    none is halved, the upper two bits are the paint, where 3 means 3 plus the next digit. Children follow, last one first
    (PrusaSlicer, src/libslic3r/TriangleSelector.cpp, Model.cpp: FacetsAnnotation). Raises ValueError for digits that do not form
    such a tree.
    """
    shares, pending, codes = dict[int, float](), [1.0], [int(digit, 16) for digit in digits]
    while pending:
        share, code = pending.pop(), _next(codes)
        sides, paint = code & 3, code >> 2
        if sides:
            pending += [share * part for part in CHILDREN[sides]]
        else:
            paint = LONG + _next(codes) if paint == LONG else paint
            shares[paint] = shares.get(paint, 0.0) + share
    if codes:
        raise ValueError(f"{counted(len(codes), 'digit')} left over")
    return shares


def _next(codes: list[int]) -> int:
    """Remove and return the last remaining digit."""
    if not codes:
        raise ValueError("digits are missing")
    return codes.pop()
