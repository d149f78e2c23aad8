"""PrusaSlicer's and SuperSlicer's files: config.ini, bundles of presets with inheritance, and the settings at the end of G-code.

The sections of a bundle are [print:NAME], [filament:NAME], [printer:NAME]; with `inherits = A; B`, B overrides A, and names in
asterisks are building blocks that users do not select (PrusaSlicer, src/libslic3r/PresetBundle.cpp). PrusaSlicer 3 writes its
settings into G-code twice: as JSON, and in the older format. The latter contains the default of each setting that has moved from
the printer to the print, such as retraction, so the JSON is used.
"""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from profiles.errors import ProfileError
from profiles.foreign.config import Config, finite, first_filament, width_of_nozzle

KINDS = {"print": "process", "filament": "material", "printer": "printer"}  # section of a bundle -> name of its option
SECTION = re.compile(r"\[(.+)\]")
# SuperSlicer also gives line widths by their distance; its percentages of widths and layers refer to the nozzle, and flows are
# percentages (supermerill/SuperSlicer, src/libslic3r/PrintConfig.cpp, ratio_over).
OF_SUPERSLICER = frozenset({"extrusion_spacing", "perimeter_extrusion_spacing", "external_perimeter_extrusion_spacing"})
WIDTHS = ("extrusion_width", "min_layer_height", "max_layer_height")
FLOWS = ("bridge_flow_ratio", "over_bridge_flow_ratio")
SHOWN = 8  # presets that a message names
JSON_BLOCK = re.compile(r"^; prusaslicer_json_config = begin\r?\n(.*?)^; prusaslicer_json_config = ", re.MULTILINE | re.DOTALL)
BLOCKS = frozenset({"prusaslicer_config", "prusaslicer_json_config"})  # which begin and end like settings
JSON_GROUPS = ("printer_settings", "print_settings", "toolprint_settings", "filament_settings")  # the last has a key's value

Presets = dict[str, dict[str, dict[str, str]]]  # kind, name, key


def read_settings(lines: list[str], chosen: Mapping[str, str]) -> Config:
    """The settings of a config.ini, or of the selected preset of each kind in a bundle. Raises ProfileError."""
    presets = _sections(lines)
    if not any(presets[kind] for kind in KINDS):
        return of_gcode(presets[""].get("", {}))
    names = {kind: _chosen(presets, kind, chosen.get(option, "")) for kind, option in KINDS.items()}
    values: dict[str, str] = {}
    for kind in ("printer", "filament", "print"):
        values |= _inherited(presets[kind], names[kind], ()) if names[kind] else {}
    return _config(values, names["print"], names["filament"])


def gcode_settings(text: str) -> dict[str, str]:
    """The settings at the end of a G-code file: `; key = value`, and those of its JSON; empty if it has none.

    Raises ProfileError for text that is not JSON.
    """
    settings: dict[str, str] = {}
    for line in text.split("\n"):
        match = re.fullmatch(r";\s*([A-Za-z0-9_]+)\s*=\s*(.*)", line.rstrip("\r"))
        if match and match[1] not in BLOCKS:
            settings[match[1]] = match[2].strip()
    block = JSON_BLOCK.search(text)
    return settings if block is None else settings | _json_settings(block[1])


def _json_settings(block: str) -> dict[str, str]:
    """The settings of the first tool in PrusaSlicer 3's JSON, each line of which is a comment. Raises ProfileError."""
    try:
        document = json.loads("\n".join(line.removeprefix(";") for line in block.split("\n")))
        groups = [document["presets"].get(group, {}) for group in JSON_GROUPS]
        *of_print, of_filament = [{key: _json_text(value) for key, value in group.items()} for group in groups]
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise ProfileError(
            f"prusaslicer_json_config is not as PrusaSlicer 3 writes it ({type(error).__name__}: {error})"
        ) from None
    settings: dict[str, str] = {}
    for group in of_print:
        settings |= group
    # A filament has a key of the print only to override it; older versions call that key filament_KEY.
    return settings | {f"filament_{key}" if key in settings else key: text for key, text in of_filament.items()}


def _json_text(value: Any) -> str:
    """A value of PrusaSlicer 3's JSON as in config.ini; of a list, the first."""
    if isinstance(value, list):
        return _json_text(value[0]) if value else ""
    if isinstance(value, dict):
        return f"{value['value']:g}{'%' if value['is_percent'] else ''}"
    if value is None:
        return "nil"
    return str(int(value)) if isinstance(value, bool) else f"{value:.10g}" if isinstance(value, float) else str(value)


def of_gcode(settings: Mapping[str, str]) -> Config:
    """The settings of a G-code file written by PrusaSlicer or SuperSlicer."""
    return _config(settings, settings.get("print_settings_id", ""), first_filament(settings))


def _sections(lines: list[str]) -> Presets:
    presets: Presets = {kind: {} for kind in ("", "presets", *KINDS)}
    here = presets[""].setdefault("", {})
    for line in lines:
        section, (key, equals, value) = SECTION.fullmatch(line.strip()), line.partition("=")
        if section:
            kind, _, name = section[1].partition(":")
            here = presets.setdefault(kind, {}).setdefault(name.strip(), {})
        elif equals and not line.lstrip().startswith(("#", ";")):
            here[key.strip()] = value.strip()
    return presets


def _chosen(presets: Presets, kind: str, wanted: str) -> str:
    """The preset of a kind that was requested, that is active in the bundle, or that is its only one."""
    names = [name for name in presets[kind] if not name.startswith("*")]
    if wanted:
        if wanted not in presets[kind]:
            raise ProfileError(f"{KINDS[kind]} preset {wanted!r}: the file has no such preset; {_preset_names(names, wanted)}")
        return wanted
    active = presets["presets"].get("", {}).get(kind, "").split(";")[0].strip()
    if active in presets[kind]:
        return active
    if len(names) > 1 and kind != "printer":
        raise ProfileError(f"--{KINDS[kind]}-preset is missing: the file has {len(names)}; {_preset_names(names, '')}")
    return names[0] if len(names) == 1 else ""


def _preset_names(names: list[str], wanted: str) -> str:
    """A few of the names, those that share a word with the requested one first."""
    words = [word for word in re.split(r"\W+", wanted.lower()) if word]
    near = sorted(names, key=lambda name: -sum(word in name.lower() for word in words))
    return f"among them {', '.join(repr(name) for name in near[:SHOWN])}" if names else "it has none of this kind"


def _inherited(presets: Mapping[str, Mapping[str, str]], name: str, below: tuple[str, ...]) -> dict[str, str]:
    """The settings of a preset, with inherited ones."""
    if name in below:
        raise ProfileError(f"preset {name!r} inherits itself")
    if name not in presets:
        raise ProfileError(f"preset {below[-1]!r} inherits {name!r}, which the file does not have")
    values: dict[str, str] = {}
    for parent in _parents(presets[name].get("inherits", "")):
        values |= _inherited(presets, parent, (*below, name))
    return values | {key: value for key, value in presets[name].items() if key != "inherits"}


def _parents(text: str) -> Iterator[str]:
    yield from (name.strip().strip('"') for name in text.split(";") if name.strip())


def _config(values: Mapping[str, str], process: str, material: str) -> Config:
    if not OF_SUPERSLICER & values.keys():
        return Config("PrusaSlicer", {key: (key, value) for key, value in values.items()}, (), process, material)
    said = {key: _to_prusaslicer(key, value, values.get("nozzle_diameter", "")) for key, value in values.items()}
    own = {key: (values[key], how) for key, (text, how) in said.items() if text != values[key]}
    return Config("SuperSlicer", {key: (key, text) for key, (text, _) in said.items()}, (), process, material, own)


def _to_prusaslicer(key: str, text: str, nozzle: str) -> tuple[str, str]:
    """A value of SuperSlicer as PrusaSlicer would write it, and how it was computed."""
    if key.endswith(WIDTHS):
        return width_of_nozzle(text, nozzle)
    percent = finite(text[:-1]) if key in FLOWS and text.endswith("%") else None
    return (text, "") if percent is None else (f"{percent / 100.0:g}", "percent as a share")
