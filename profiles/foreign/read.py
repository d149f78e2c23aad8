"""Read: the settings in a file of another slicer, recognised by its content, or in a .3mf that the slicer has saved."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from profiles.errors import ProfileError, first_line, reason
from profiles.files import DAMAGED_ZIP, is_zip
from profiles.foreign import cura, orcaslicer, prusaslicer
from profiles.foreign.config import Config
from profiles.foreign.imported import settings_of_place

MOST_BYTES = 256 << 20  # greatest size of a G-code file; settings are in its last MiB, OrcaSlicer's also in its first
END_BYTES = 1 << 20
ORCA_KEYS = frozenset({"sparse_infill_density", "wall_loops", "nozzle_temperature"})
PRUSA_KEYS = frozenset({"fill_density", "perimeters", "temperature", "layer_height", "filament_diameter", "nozzle_diameter"})
DAMAGED: tuple[type[Exception], ...] = (*DAMAGED_ZIP, ProfileError)
MOST_SETTINGS_BYTES = 16 << 20  # greatest size of a slicer file, whose settings have some 100 kB
OF_PRUSASLICER = ("metadata/slic3r_pe.config", "metadata/slic3r.config", "metadata/superslicer.config")
OF_ORCASLICER = "metadata/project_settings.config"
OBJECTS_OF_ORCASLICER = "metadata/model_settings.config"  # present without the other if a file holds only models
OF_CURA = "cura/"

# The settings of a slicer file by its program's names, and the function that converts them to a configuration.
SlicerSettings = tuple[Mapping[str, str], Callable[[Mapping[str, str]], Config]]


def is_slicer_file(file: Path) -> bool:
    """Whether a file may hold settings of a slicer, by its name and content."""
    return file.suffix.lower() == ".3mf" and is_zip(file)


def read_slicer_settings(file: Path) -> SlicerSettings:
    """The settings of a slicer file; empty if it has none. Raises ProfileError for damaged ones."""
    try:
        with ZipFile(file) as archive:
            entries = {name.lower(): name for name in archive.namelist()}
            prusaslicers = next((entries[name] for name in OF_PRUSASLICER if name in entries), None)
            if prusaslicers is not None:
                return prusaslicer.gcode_settings(_text(archive, prusaslicers)), prusaslicer.of_gcode
            if OF_ORCASLICER in entries:
                document = json.loads(_text(archive, entries[OF_ORCASLICER]))
                if not isinstance(document, dict):
                    raise ValueError("no table of settings")
                return orcaslicer.values_of(document), orcaslicer.of_values
            if OBJECTS_OF_ORCASLICER in entries:
                return {}, orcaslicer.of_values
            if any(name.startswith("metadata/slic3r") for name in entries):
                return {}, prusaslicer.of_gcode
    except OSError as error:
        raise ProfileError(f"profile {file} cannot be read ({reason(error)})") from None
    except DAMAGED as error:
        raise ProfileError(f"profile {file}: the settings inside it are damaged ({first_line(error)})") from None
    has_settings = any(name.startswith(OF_CURA) for name in entries)
    return cura.read_values(file)[0] if has_settings else {}, cura.of_values


def settings_of_volume(settings: SlicerSettings, of_volume: Mapping[str, str]) -> tuple[dict[str, Any], list[str]]:
    """The settings of a volume or an object converted: values by keys of a process, and the names that were not imported."""
    values, of_values = settings
    return settings_of_place(of_values({**values, **of_volume}), of_volume.keys()) if of_volume else ({}, [])


def _text(archive: ZipFile, name: str) -> str:
    """The text of a member. Raises ValueError if it is too large."""
    size = archive.getinfo(name).file_size
    if size > MOST_SETTINGS_BYTES:
        raise ValueError(f"{name} has {size} bytes, {MOST_SETTINGS_BYTES} are allowed")
    return archive.read(name).decode("utf-8-sig", errors="replace")


def read_config(file: Path, presets: Mapping[str, str] | None = None) -> Config:
    """The configuration in a file of another slicer.

    presets: in a bundle, by "process", "material" and "printer". Raises ProfileError for a file that cannot be read, an unknown
    slicer, or presets that are not named.
    """
    try:
        if is_slicer_file(file):
            return _of_slicer_file(file)
        if is_zip(file):
            return cura.read_profile(file)
        content = _ends(file)
    except OSError as error:
        raise ProfileError(f"profile {file} cannot be read ({reason(error)})") from None
    text = content.decode("utf-8-sig", errors="replace")
    if text.lstrip().startswith("{"):
        return orcaslicer.read_preset(file, orcaslicer.read_json(file))
    try:
        commented = prusaslicer.gcode_settings(text)
    except ProfileError as error:
        raise ProfileError(f"profile {file}: {error}") from None
    if ORCA_KEYS & commented.keys():
        return orcaslicer.of_values(commented)
    if PRUSA_KEYS & commented.keys():
        return prusaslicer.of_gcode(commented)
    config = prusaslicer.read_settings(text.split("\n"), presets or {})
    if not PRUSA_KEYS & config.entries.keys():
        raise ProfileError(
            f"profile {file} holds no settings; a config.ini, a bundle or a G-code file of PrusaSlicer or SuperSlicer, a JSON "
            "preset of OrcaSlicer or Bambu Studio, a .curaprofile, or a .3mf that one of these has saved is expected"
        )
    return config


def _of_slicer_file(file: Path) -> Config:
    """The settings inside a slicer file. Raises ProfileError if it has none."""
    values, of_values = read_slicer_settings(file)
    if not values:
        raise ProfileError(f"{file} holds no print settings; a .3mf that a slicer has saved with them is expected")
    return of_values(values)


def _ends(file: Path) -> bytes:
    """The first and last bytes of a file, all of a small one: presets are small, G-code is not."""
    with file.open("rb") as stream:
        length = stream.seek(0, 2)
        stream.seek(0)
        if length <= 2 * END_BYTES or file.suffix.lower() in (".ini", ".json"):
            return stream.read(MOST_BYTES)
        start = stream.read(END_BYTES)
        stream.seek(length - END_BYTES)
        return start + b"\n" + stream.read()
