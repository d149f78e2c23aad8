"""File settings: the material and the process that a slicer file holds beside its models."""

from collections.abc import Iterable
from pathlib import Path

from machine.pipeline.requests import Given
from profiles.errors import ProfileError
from profiles.foreign.imported import KINDS, imported
from profiles.foreign.read import is_slicer_file, read_config, read_slicer_settings


def has_settings(file: Path) -> bool:
    """Whether a model's file is one of another slicer that keeps print settings, damaged ones included."""
    if not is_slicer_file(file):
        return False
    try:
        return bool(read_slicer_settings(file)[0])
    except ProfileError:
        return True


def settings_inside(file: Path, name: str, kinds: Iterable[str] = KINDS) -> tuple[Given, str]:
    """The nearest shipped material with the settings inside a slicer file, and a note on how many of them are used.

    name: of the file as its user knows it; kinds: the profiles to make of them, material, process or both. Raises
    ProfileError for a file that keeps none, or damaged ones.
    """
    if not is_slicer_file(file):
        raise ProfileError(f"{file} is no .3mf that a slicer has saved with its settings inside")
    config = read_config(file)
    found = {kind: imported(config, kind, nameless=Path(name).stem) for kind in kinds}
    counts = [f"{sum(row.taken for row in profile.rows)} of {len(profile.rows)} of the {kind}" for kind, profile in found.items()]
    settings = tuple(setting for profile in found.values() for setting in profile.settings)
    note = f"{name}: uses the settings of {config.program} inside: {', '.join(counts)}; profiles import lists them"
    return Given(material=found["material"].base if "material" in found else Given.material, settings=settings), note
