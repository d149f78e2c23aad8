"""Cura's .curaprofile: a zip of ini files, one for the print and one per extruder, with the differences from the definition of a
printer.

Values that the user has not changed are in Cura's own definitions, not in the file (Cura, plugins/CuraProfileReader). A project
(.3mf) contains stacks of such files, one for the print and one for each extruder, the user's own on top (Cura,
cura/Settings/CuraContainerStack.py). Names: Cura, resources/definitions/fdmprinter.def.json.
"""

import configparser
import re
from collections.abc import Collection, Iterator, Mapping
from itertools import zip_longest
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

from profiles.errors import ProfileError, first_line, reason
from profiles.files import DAMAGED_ZIP
from profiles.foreign.config import CURAS, Config, Entry, finite, without_still_fan
from profiles.foreign.cura_formulas import USUAL, evaluated, inputs

PROGRAM = "Cura"
SLICER_FILE = re.compile(r"Cura/(.*)\.inst\.cfg$")  # members of a slicer file that have settings
STACK = re.compile(r"Cura/.*\.(global|extruder)\.cfg$")
MATERIAL = re.compile(r"Cura/(.*)\.xml\.fdm_material$")
PROPERTIES = {  # in a file of a material
    "material_type": "{*}metadata/{*}name/{*}material",
    "material_diameter": "{*}properties/{*}diameter",
    "material_density": "{*}properties/{*}density",
}
OF_MATERIAL = {
    "print temperature": "default_material_print_temperature",
    "heated bed temperature": "default_material_bed_temperature",
    "print cooling": "cool_fan_speed",
    "retraction amount": "retraction_amount",
    "retraction speed": "retraction_speed",
}
HOLDS = {  # settings that hold only if another has a value, and their value otherwise; None: not set
    "retraction_hop": ("retraction_hop_enabled", "true", "0"),
    "retraction_amount": ("retraction_enable", "true", "0"),
    "cool_fan_speed_max": ("cool_fan_enabled", "true", "0"),
    "cool_fan_speed_min": ("cool_fan_enabled", "true", "0"),
    "brim_width": ("adhesion_type", "brim", "0"),
    "skirt_line_count": ("adhesion_type", "skirt", "0"),
    "bridge_skin_speed": ("bridge_settings_enabled", "true", None),
    "acceleration_print": ("acceleration_enabled", "true", None),
    "acceleration_wall_0": ("acceleration_enabled", "true", None),
    "acceleration_infill": ("acceleration_enabled", "true", None),
    "acceleration_travel": ("acceleration_enabled", "true", None),
    "acceleration_layer_0": ("acceleration_enabled", "true", None),
}
DAMAGED: tuple[type[Exception], ...] = (*DAMAGED_ZIP, configparser.Error, ElementTree.ParseError)
MOST_BYTES = 4 << 20  # for a member: a profile has a few kB
PERCENT = frozenset({"fill_density", "ironing_flowrate"})  # without the sign in Cura
RAFT_LAYERS = {"raft_base_layers": 1, "raft_interface_layers": 1, "raft_surface_layers": 2}  # with Cura's default numbers
BESIDE_OTHERS = frozenset({*RAFT_LAYERS, "layer_0_z_overlap"})  # read by _raft
WORDS = {
    "fill_pattern": {
        "lines": "rectilinear",
        "zigzag": "rectilinear",
        "trihexagon": "stars",
        "cubicsubdiv": "adaptivecubic",
    },
    "complete_objects": {"all_at_once": "0", "one_at_a_time": "1"},
    "seam_position": {"back": "rear", "shortest": "nearest", "sharpest_corner": "aligned"},
    "external_perimeters_first": {"outside_in": "1", "inside_out": "0"},
    "support_material_style": {"normal": "grid", "tree": "organic"},
    "support_material_buildplate_only": {"buildplate": "1", "everywhere": "0"},
}


def read_profile(file: Path) -> Config:
    """The settings of a .curaprofile. Raises ProfileError."""
    return of_values(*read_values(file))


def of_values(values: Mapping[str, str], name: str = "") -> Config:
    """Settings given by Cura's names, with formulas computed where possible."""
    entries, hows, known = dict[str, Entry](), dict[str, str](), evaluated(values)
    unknown, read = list[str](), set[str]()
    for theirs, text in known.items():
        switch, word, off = HOLDS.get(theirs, ("", "", None))
        key, how = CURAS.get(theirs, theirs), ""
        if text.startswith("="):
            unknown.append(f"{theirs} (a formula)")
            continue
        if (said := known.get(switch, word)).lower() != word and not said.startswith("="):
            how = f"{switch} is {said}"
            if off is None:
                unknown += [f"{theirs} ({how})"] if theirs in values else []
                read.add(switch)
                continue
            entries[key] = theirs, off
        elif (theirs in values or theirs in CURAS) and theirs not in BESIDE_OTHERS:
            entries[key] = theirs, _to_prusaslicer(key, text)
            if theirs not in values:
                how = f"Cura's own formula: {USUAL[theirs]}"
            elif values[theirs] != text:
                how = f"that is {text}"
        else:
            continue
        hows[key] = how
        read |= {switch} | inputs(theirs, values)
    if (angle_deg := finite(known.get("support_angle", ""))) is not None:
        entries["support_material_threshold"] = "support_angle", f"{90.0 - angle_deg:g}"
        worked = "" if values.get("support_angle") == known["support_angle"] else f"that is {angle_deg:g} "
        hows["support_material_threshold"] = f"{worked}from the vertical, as here"
    for key, theirs, text, how in _raft(known):
        entries[key], hows[key] = (theirs, text), how
    changed = {key: values.get(theirs, text) for key, (theirs, text) in entries.items() if values.get(theirs) != text}
    own = {key: (text, hows.get(key, "")) for key, text in changed.items()}
    return Config(PROGRAM, without_still_fan(entries), tuple(unknown), name, name, own, frozenset(read))


def _raft(values: Mapping[str, str]) -> Iterator[tuple[str, str, str, str]]:
    """The number of raft layers and the gap above the raft, reduced by how far the first layer sinks into it. Each with its key,
    name in the file, text, and how it was computed.

    A value that the file does not give as a number is Cura's default: the first layer sinks by half of the gap.
    """
    if (kind := values.get("adhesion_type", "")) and not kind.startswith("="):
        counts = [_number(values.get(key, ""), usual) for key, usual in RAFT_LAYERS.items()] if kind == "raft" else []
        how = " + ".join(f"{count:g}" for count in counts) + " layers" if counts else "no raft"
        yield "raft_layers", "adhesion_type", f"{sum(counts):g}", how
    if (gap_mm := finite(values.get("raft_airgap", ""))) is not None:
        into_mm = _number(values.get("layer_0_z_overlap", ""), 0.5 * gap_mm)
        less = f"{gap_mm:g} less {into_mm:g} (layer_0_z_overlap)"
        yield "raft_contact_distance", "raft_airgap", f"{max(gap_mm - into_mm, 0.0):g}", less


def _number(text: str, usual: float) -> float:
    number = finite(text)
    return usual if number is None else number


def read_values(file: Path) -> tuple[Mapping[str, str], str]:
    """The settings of a profile or a slicer file, where the first extruder's override the print's, and its name. Raises
    ProfileError.
    """
    try:
        with ZipFile(file) as archive:
            if file.suffix.lower() == ".3mf":
                return _of_slicer_file(archive), file.stem
            values, name = dict[str, str](), file.stem
            for member in sorted(archive.namelist(), key=lambda member: "extruder" in member):
                ini = _ini(archive, member)
                name = ini.get("general", "name", fallback=name)
                values |= _values(ini) if _position(ini) in ("", "0") else {}
            return values, name
    except OSError as error:
        raise ProfileError(f"profile {file} cannot be read ({reason(error)})") from None
    except DAMAGED as error:
        raise ProfileError(f"profile {file} is not a Cura profile ({first_line(error)})") from None


def _of_slicer_file(archive: ZipFile) -> dict[str, str]:
    """The settings of the stacks of the print and of its first enabled extruder, level by level."""
    layers = {match[1]: member for member in archive.namelist() if (match := SLICER_FILE.match(member) or MATERIAL.match(member))}
    stacks = [_ini(archive, member) for member in archive.namelist() if STACK.match(member)]
    prints = [stack for stack in stacks if not _position(stack)]
    extruders = [stack for stack in stacks if _position(stack) and stack.get("metadata", "enabled", fallback="") != "False"]
    first = sorted(extruders, key=lambda stack: int(_position(stack)) if _position(stack).isdecimal() else 0)[:1]
    values = dict[str, str]()
    levels = [list(dict(stack["containers"]).values())[::-1] for stack in (*prints, *first) if stack.has_section("containers")]
    for containers in zip_longest(*levels, fillvalue=""):
        for container in containers:
            member = layers.get(container) or layers.get(_material_of(container, layers), "")
            if MATERIAL.match(member):
                values |= _of_material(ElementTree.fromstring(_content(archive, member)))
            elif member:
                values |= _values(_ini(archive, member))
    return values


def _material_of(container: str, layers: Collection[str]) -> str:
    """The file of a material, whose name a container's name begins with, before the names of printer and nozzle."""
    return max((name for name in layers if container.startswith(f"{name}_")), key=len, default="")


def _of_material(material: ElementTree.Element) -> dict[str, str]:
    """The settings of a material's file that hold for all printers."""
    texts = {key: material.findtext(path, "") for key, path in PROPERTIES.items()}
    for setting in material.findall("{*}settings/{*}setting"):
        texts[OF_MATERIAL.get(setting.get("key", ""), "")] = setting.text or ""
    return {key: text.strip() for key, text in texts.items() if key and text.strip()}


def _content(archive: ZipFile, member: str) -> str:
    """The text of a member. Raises ProfileError if it is too large."""
    size = archive.getinfo(member).file_size
    if size > MOST_BYTES:
        raise ProfileError(f"profile {archive.filename}: {member} has {size} bytes, {MOST_BYTES} are allowed")
    return archive.read(member).decode("utf-8-sig")


def _ini(archive: ZipFile, member: str) -> configparser.ConfigParser:
    ini = configparser.ConfigParser(interpolation=None)
    ini.read_string(_content(archive, member))
    return ini


def _values(ini: configparser.ConfigParser) -> dict[str, str]:
    return dict(ini["values"]) if ini.has_section("values") else {}


def _position(ini: configparser.ConfigParser) -> str:
    """The number of its extruder, from 0; empty for the print."""
    return ini.get("metadata", "position", fallback="")


def _to_prusaslicer(key: str, text: str) -> str:
    """A value as PrusaSlicer would write it."""
    if key in PERCENT and not text.endswith("%"):
        return f"{text}%"
    if key == "extrusion_multiplier" and (percent := finite(text)) is not None:
        return f"{percent / 100.0:g}"
    return WORDS.get(key, {}).get(text, text)
