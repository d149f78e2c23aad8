"""Model file: the file that a MODEL argument names, and a quick check that it can be a model; imports nothing slow."""

import os
from importlib import resources
from pathlib import Path

from mdp.formats.readers import READERS
from profiles.errors import MeshError

DEMO = "demo:"


def locate(model: str) -> Path:
    """The file of a MODEL argument: `demo:NAME` is a model that ships with the program, anything else a path.

    Raises MeshError for an empty name, and for an unknown demo, listing the available ones.
    """
    if not model.strip():
        raise MeshError(f"the model's name is empty: a {', '.join(READERS)} file or {DEMO}NAME is expected")
    if not model.startswith(DEMO):
        return Path(model)
    name = model.removeprefix(DEMO)
    folder = resources.files("mdp").joinpath("demos")
    demos = (
        {entry.name.removesuffix(".ply"): entry for entry in folder.iterdir() if entry.name.endswith(".ply")}
        if folder.is_dir()
        else {}
    )
    if name not in demos:
        known = ", ".join(f"{DEMO}{demo}" for demo in sorted(demos))
        raise MeshError(f"there is no demo model {name!r}; allowed are {known or 'none: none is installed'}")
    return Path(str(demos[name]))


def plan_beside(model: str) -> Path | None:
    """The plan that ships with a demo model; None for demos without a plan and for other models. Raises MeshError."""
    plan = locate(model).with_suffix(".toml") if model.startswith(DEMO) else None
    return plan if plan is not None and plan.exists() else None


def check_file(path: Path) -> None:
    """Refuse a path that cannot be a model file before any work is done. Raises MeshError."""
    if os.path.isdir(path):  # unlike pathlib's, false for a name that is too long to exist
        raise MeshError(f"{path} is a folder, not a model file")
    if not os.path.exists(path):
        raise MeshError(f"{path}: there is no such file")
    if path.suffix.lower() not in READERS:
        raise MeshError(f"{path}: the kind of file {path.suffix!r} is not read; allowed are {', '.join(READERS)}")
