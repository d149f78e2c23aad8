"""Project file: a model that another slicer has saved with the settings to print it by."""

from collections.abc import Mapping
from pathlib import Path

from machine.app.terminal.progress import say
from profiles.errors import ProfileError
from profiles.foreign.imported import KINDS, imported
from profiles.foreign.project import is_project
from profiles.foreign.read import read_config
from profiles.profile import DEFAULTS


def settings_of(model: str, names: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
    """The names of machine, material and process, and the settings over them, that print a project as it was saved; a person is
    told how many there are. names: those asked for; the default material gives way to that of the project's kind.

    Raises ProfileError for a model that keeps no settings.
    """
    if not model:
        raise ProfileError("--settings-of-file goes with one model, not with a folder of them")
    file = Path(model)
    if not is_project(file):
        raise ProfileError(f"--settings-of-file: {model} is no project of a slicer (.3mf), which keeps its settings inside")
    config, named = read_config(file), dict(names)
    found = {kind: imported(config, kind, nameless=file.stem) for kind in KINDS}
    if named["material"] == DEFAULTS["material"]:
        named["material"] = found["material"].base
    counts = [f"{sum(row.taken for row in profile.rows)} of {len(profile.rows)} of the {kind}" for kind, profile in found.items()]
    say(f"{file.name}: takes its own settings, of {config.program}: {', '.join(counts)}; profiles import tells which")
    return named, [setting for profile in found.values() for setting in profile.settings]
