"""Slicer file: the settings inside a .3mf saved by PrusaSlicer, Bambu Studio, OrcaSlicer or Cura."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from profiles.errors import ProfileError, first_line, reason
from profiles.files import DAMAGED_ZIP, is_zip
from profiles.foreign import cura, orcaslicer, prusaslicer
from profiles.foreign.config import Config
from profiles.foreign.imported import settings_of_place

DAMAGED: tuple[type[Exception], ...] = (*DAMAGED_ZIP, ProfileError)
MOST_BYTES = 16 << 20  # of the settings, which have some 100 kB
OF_PRUSASLICER = ("metadata/slic3r_pe.config", "metadata/slic3r.config", "metadata/superslicer.config")
OF_ORCASLICER = "metadata/project_settings.config"
OBJECTS_OF_ORCASLICER = "metadata/model_settings.config"  # there without the other where a file holds models alone
OF_CURA = "cura/"


@dataclass(frozen=True)
class SlicerSettings:
    """The settings of a slicer file under its program's names. of_values: makes a configuration of such."""

    values: Mapping[str, str]
    of_values: Callable[[Mapping[str, str]], Config]

    @property
    def config(self) -> Config:
        """Those of the print."""
        return self.of_values(self.values)

    def of_place(self, of_volume: Mapping[str, str]) -> tuple[dict[str, Any], list[str]]:
        """What settings of a volume or an object become: values by keys of a process, and the names of those that are left."""
        return settings_of_place(self.of_values({**self.values, **of_volume}), of_volume.keys()) if of_volume else ({}, [])


def is_slicer_file(file: Path) -> bool:
    """Whether a file may be one, by its name and kind."""
    return file.suffix.lower() == ".3mf" and is_zip(file)


def read_slicer_settings(file: Path) -> SlicerSettings:
    """The settings of a slicer file, none where it keeps none. Raises ProfileError for such that are damaged."""
    try:
        with ZipFile(file) as archive:
            entries = {name.lower(): name for name in archive.namelist()}
            prusaslicers = next((entries[name] for name in OF_PRUSASLICER if name in entries), None)
            if prusaslicers is not None:
                return SlicerSettings(prusaslicer.gcode_settings(_text(archive, prusaslicers)), prusaslicer.of_gcode)
            if OF_ORCASLICER in entries:
                document = json.loads(_text(archive, entries[OF_ORCASLICER]))
                if not isinstance(document, dict):
                    raise ValueError("no table of settings")
                return SlicerSettings(orcaslicer.values_of(document), orcaslicer.of_values)
            if OBJECTS_OF_ORCASLICER in entries:
                return SlicerSettings({}, orcaslicer.of_values)
            if any(name.startswith("metadata/slic3r") for name in entries):
                return SlicerSettings({}, prusaslicer.of_gcode)
    except OSError as error:
        raise ProfileError(f"profile {file}: cannot be read ({reason(error)})") from None
    except DAMAGED as error:
        raise ProfileError(f"profile {file}: the settings inside it are damaged ({first_line(error)})") from None
    has_settings = any(name.startswith(OF_CURA) for name in entries)
    return SlicerSettings(cura.read_values(file)[0] if has_settings else {}, cura.of_values)


def _text(archive: ZipFile, name: str) -> str:
    """The text of a member. Raises ValueError for one that is too large."""
    size = archive.getinfo(name).file_size
    if size > MOST_BYTES:
        raise ValueError(f"{name} has {size} bytes, {MOST_BYTES} are allowed")
    return archive.read(name).decode("utf-8-sig", errors="replace")
