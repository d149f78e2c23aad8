"""Project file: a model that another slicer has saved with the settings to print it by."""

from pathlib import Path

from machine.app.requests import Given
from machine.app.terminal.progress import say
from profiles.errors import ProfileError
from profiles.foreign.imported import KINDS, imported
from profiles.foreign.project import is_project
from profiles.foreign.read import read_config


def given_by(model: str) -> Given:
    """The nearest shipped material and the settings that print a project as it was saved; a note on stderr says how many
    there are. Raises ProfileError for a model that keeps no settings."""
    if not model:
        raise ProfileError("--settings-of-file goes with one model, not with a folder of them")
    file = Path(model)
    if not is_project(file):
        raise ProfileError(f"--settings-of-file: {model} is no project of a slicer (.3mf), which keeps its settings inside")
    config = read_config(file)
    found = {kind: imported(config, kind, nameless=file.stem) for kind in KINDS}
    counts = [f"{sum(row.taken for row in profile.rows)} of {len(profile.rows)} of the {kind}" for kind, profile in found.items()]
    say(f"{file.name}: takes its own settings, of {config.program}: {', '.join(counts)}; profiles import tells which")
    settings = tuple(setting for profile in found.values() for setting in profile.settings)
    return Given(material=found["material"].base, settings=settings)
