"""OrcaSlicer's and Bambu Studio's files: JSON presets that inherit from neighbouring files, and the settings in a G-code file.

Keys and the base of percentages: OrcaSlicer, src/libslic3r/PrintConfig.cpp. Line widths in percent refer to the nozzle,
PrusaSlicer's to the layer height.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from profiles.errors import ProfileError, reason
from profiles.foreign.config import ORCASLICERS, Config, Entry, first_filament, width_of_nozzle, without_still_fan

PROGRAM = "OrcaSlicer"
TYPES = {"process": "process", "filament": "material", "machine": "printer"}
ABOUT = (
    *("type", "name", "from", "inherits", "instantiation", "setting_id", "filament_id", "version", "is_custom_defined"),
    *("compatible_printers", "compatible_prints", "compatible_printers_condition", "compatible_prints_condition"),
)
WORDS = {  # values with other names
    "fill_pattern": {"zig-zag": "rectilinear", "tri-hexagon": "stars"},
    "top_fill_pattern": {"zig-zag": "rectilinear"},
    "bottom_fill_pattern": {"zig-zag": "rectilinear"},
    "complete_objects": {"by layer": "0", "by object": "1"},
    "seam_position": {"back": "rear", "aligned_back": "rear"},
    "support_material_pattern": {"default": "rectilinear"},
}
PLATES = {  # the heated bed's temperature depends on the plate on it
    "Cool Plate": "cool_plate_temp",
    "Engineering Plate": "eng_plate_temp",
    "High Temp Plate": "hot_plate_temp",
    "Textured PEI Plate": "textured_plate_temp",
}


def read_preset(file: Path, document: Mapping[str, Any]) -> Config:
    """A JSON preset with all it inherits from neighbouring files. Raises ProfileError."""
    values, missing = _inherited(file, document, ())
    values.setdefault("nozzle_diameter", _nozzle(file, document))
    name, kind = str(document.get("name", file.stem)), TYPES.get(str(document.get("type", "")), "")
    config = of_values(values, name if kind == "process" else "", name if kind == "material" else "")
    return config if not missing else replace(config, unknown=(*config.unknown, missing), process=name, material=name)


def of_values(values: Mapping[str, str], process: str = "", material: str = "") -> Config:
    """Settings given by OrcaSlicer's names."""
    entries, own = dict[str, Entry](), dict[str, tuple[str, str]]()
    for name, text in values.items():
        key = ORCASLICERS.get(name, name)
        if name in ORCASLICERS and key.endswith("extrusion_width"):
            theirs, how = width_of_nozzle(text, values.get("nozzle_diameter", ""))
        else:
            theirs, how = WORDS.get(key, {}).get(text, text), ""
        entries[key] = name, theirs
        own |= {key: (text, how)} if theirs != text else {}
    plate = PLATES.get(values.get("curr_bed_type", ""), "hot_plate_temp")
    if plate in entries:
        entries["bed_temperature"] = entries.pop(plate)
    process, material = process or values.get("print_settings_id", ""), material or first_filament(values)
    return Config(PROGRAM, without_still_fan(entries), (), process, material, own)


def values_of(document: Mapping[str, Any]) -> dict[str, str]:
    """The settings of a preset or a slicer file as texts."""
    return {key: _text(value) for key, value in document.items() if key not in ABOUT}


def _inherited(file: Path, document: Mapping[str, Any], below: tuple[Path, ...]) -> tuple[dict[str, str], str]:
    """All settings of a preset, and the name of a parent without a neighbouring file (whose settings are unknown)."""
    own = values_of(document)
    parent = str(document.get("inherits", "") or "")
    if not parent:
        return own, ""
    beside = next((path for path in _beside(file) if path.stem == parent), None)
    if beside is None:
        return own, f"inherits {parent}"
    if beside in (file, *below):
        raise ProfileError(f"profile {file} inherits itself through {parent}")
    values, missing = _inherited(beside, read_json(beside), (*below, file))
    return values | own, missing


def _nozzle(file: Path, document: Mapping[str, Any]) -> str:
    """The nozzle of the printers of a preset, according to their neighbouring files; "" if there are none or they differ."""
    printers, beside = document.get("compatible_printers"), {path.stem: path for path in reversed(_beside(file))}
    found = [beside[name] for name in printers if name in beside] if isinstance(printers, list) else []
    nozzles = {_inherited(printer, read_json(printer), ())[0].get("nozzle_diameter", "") for printer in found}
    return nozzles.pop() if len(nozzles) == 1 else ""


def _beside(file: Path) -> list[Path]:
    """The files that may hold a parent or a printer: in the preset's folder, in folders beside and above it that hold profiles,
    and for a user's preset in user/NAME/process the vendors' in system/NAME/process.
    """
    above = file.parent.parent
    return [
        *sorted(file.parent.glob("*.json")),
        *sorted(above.glob("*/*.json")),
        *sorted(above.glob("*.json")),
        *(sorted((above.parent.parent / "system").glob("*/*/*.json")) if above.parent.name == "user" else ()),
    ]


def read_json(file: Path) -> Mapping[str, Any]:
    """The table in a JSON file. Raises ProfileError."""
    try:
        document = json.loads(file.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ProfileError(f"profile {file} cannot be read ({reason(error)})") from None
    except (ValueError, RecursionError) as error:
        raise ProfileError(f"profile {file} is not JSON ({error})") from None
    if not isinstance(document, dict):
        raise ProfileError(f"profile {file} is not a table of settings")
    return document


def _text(value: object) -> str:
    """A value of a preset: a text, or a list with one text per extruder."""
    if isinstance(value, list):
        return ",".join(str(item) for item in value)
    return str(value)
