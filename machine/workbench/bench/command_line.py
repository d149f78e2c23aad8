"""Command line: what a person types to get the G-code of what lies on the bench."""

from pathlib import Path
from shlex import join

import numpy as np

from machine.pipeline.output import plain_name
from machine.workbench.bench.bench import Bench
from machine.workbench.bench.part_settings import option
from mdp.pose import turned_further
from profiles.profile import DEFAULTS


def file_stem(bench: Bench) -> str:
    """The model's name for that of a file."""
    name = "" if bench.model is None else Path(bench.model.name.removeprefix("demo:")).stem
    return plain_name(name) or "model"


def export_command(bench: Bench) -> str:
    """The line for a shell; "" without a model. A plan, as the workbench saves it, holds how the model is cut and turned, what is
    marked on it, and what single parts have of their own."""
    if bench.model is None:
        return ""
    given, stem = bench.given, file_stem(bench)
    named = [(kind, getattr(given, kind)) for kind in DEFAULTS if getattr(given, kind) != DEFAULTS[kind]]
    words = ["tiltprint", "export", bench.model.name, *(word for kind, name in named for word in (f"--{kind}", name))]
    settings = list(given.settings)
    if not bench.planned and bench.turned is not None:
        settings = [setting for setting in settings if setting.partition("=")[0].strip() != "process.rotate_deg"]
        settings.append(f"process.rotate_deg=[{', '.join(f'{angle:.12g}' for angle in turns_deg(bench))}]")
    words += [word for setting in settings for word in ("--set", setting)]
    if bench.model.plate is not None:
        words += ["--plate", str(bench.model.plate)]
    if bench.planned:
        words += ["--plan", f"{stem}-plan.toml"]
    else:
        words += ["--parts", "1", "--as-is"]
        for own in bench.profile.parts:
            words += ["--part", option(own)]
    if bench.copies != 1:
        words += ["--copies", str(bench.copies)]
    words += [word for stop in bench.stops for word in stop.option.split()]
    return join([*words, "-o", f"{stem}.gcode"])


def turns_deg(bench: Bench) -> tuple[float, float, float]:
    """The turns about x, then y, then z that `process.rotate_deg` needs for the model to stand as it does on the bench."""
    return turned_further(bench.profile.process.rotate_deg, np.array(bench.rotation))
