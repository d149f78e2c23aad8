"""Read: a file of another slicer, told by what is in it."""

from collections.abc import Mapping
from pathlib import Path

from profiles.errors import ProfileError, reason
from profiles.files import is_zip
from profiles.foreign import cura, orcaslicer, prusaslicer
from profiles.foreign.config import Config
from profiles.foreign.slicer_file import is_slicer_file, read_slicer_settings

MOST_BYTES = 256 << 20  # of a G-code file; settings stand in its last MiB, OrcaSlicer's in its first as well
END_BYTES = 1 << 20
ORCA_KEYS = frozenset({"sparse_infill_density", "wall_loops", "nozzle_temperature"})
PRUSA_KEYS = frozenset({"fill_density", "perimeters", "temperature", "layer_height", "filament_diameter", "nozzle_diameter"})


def read_config(file: Path, presets: Mapping[str, str] | None = None) -> Config:
    """The configuration in a file.

    presets: of a bundle, by "process", "material" and "printer". Raises ProfileError for a file that cannot be read, that is of
    no slicer known here, or whose presets are not named.
    """
    try:
        if is_slicer_file(file):
            return _of_slicer_file(file)
        if is_zip(file):
            return cura.read_profile(file)
        content = _ends(file)
    except OSError as error:
        raise ProfileError(f"profile {file}: cannot be read ({reason(error)})") from None
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
    config = prusaslicer.read_settings(text.split("\n"), "PrusaSlicer", presets or {})
    if not PRUSA_KEYS & config.entries.keys():
        raise ProfileError(
            f"profile {file}: holds no settings; a config.ini, a bundle or a G-code file of PrusaSlicer or SuperSlicer, a JSON "
            "preset of OrcaSlicer or Bambu Studio, a .curaprofile, or a .3mf that one of these has saved is expected"
        )
    return config


def _of_slicer_file(file: Path) -> Config:
    """The settings inside a slicer file. Raises ProfileError where it keeps none."""
    settings = read_slicer_settings(file)
    if not settings.values:
        raise ProfileError(f"{file}: keeps no print settings; a .3mf that a slicer has saved with them is expected")
    return settings.config


def _ends(file: Path) -> bytes:
    """A file's first and last bytes, all of a small one: presets are small, G-code is not."""
    with file.open("rb") as stream:
        length = stream.seek(0, 2)
        stream.seek(0)
        if length <= 2 * END_BYTES or file.suffix.lower() in (".ini", ".json"):
            return stream.read(MOST_BYTES)
        start = stream.read(END_BYTES)
        stream.seek(length - END_BYTES)
        return start + b"\n" + stream.read()
