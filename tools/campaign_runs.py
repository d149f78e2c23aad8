"""The runs of the print campaign: their names, their order, and the settings of those that vary."""

import random
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import get_args

import numpy as np

from mdp.formats.readers import READERS
from mdp.read import read_mesh
from profiles.errors import UserError
from profiles.process import Process
from profiles.profile import load
from tools.print_forms import form, form_names, write_stl

VARIED = "~"  # ends the name of a run whose settings vary
MESH_MM = 60.0  # longest side of the meshes
MACHINES = ("generic_ac", "gen5x", "linuxcnc_xyzac", "fractal5pro")
MATERIALS = ("pla", "petg", "tpu")
NOZZLES_MM = (0.25, 0.4, 0.6, 0.8)
HEIGHTS_MM = (0.1, 0.15, 0.2, 0.25, 0.3)
DENSITIES = (0.0, 0.05, 0.15, 0.3, 0.6, 1.0)
SCALES = (0.2, 4.0)


@dataclass(frozen=True)
class Run:
    """A model of a group (meshes, models, hard, forms), printed by the default settings or by varied ones.

    source: its file, or the name of a form.
    """

    group: str
    model: str
    source: str
    varies: bool = False

    @property
    def name(self) -> str:
        """Stays the same from campaign to campaign."""
        return f"{self.group}/{self.model}{VARIED if self.varies else ''}"

    @property
    def order_key(self) -> str:
        """Sorts runs so that the first n of all are a fair sample of all."""
        return sha256(self.name.encode()).hexdigest()


def all_runs(folders: dict[str, Path], forms: int, varied_share: float) -> list[Run]:
    """Every model of folders (by group) and a number of forms, each by default settings, and a share of them varied, in order."""
    models = [Run(group, file.stem, str(file.resolve())) for group, folder in folders.items() for file in _models(folder)]
    models += [Run("forms", name, name) for name in form_names(forms)]
    return sorted([*models, *_varied(models, varied_share)], key=lambda run: run.order_key)


def _models(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.suffix.lower() in (".npz", *READERS))


def _varied(runs: list[Run], share: float) -> Iterator[Run]:
    for run in (Run(run.group, run.model, run.source, True) for run in runs):
        if int(run.order_key[8:16], 16) < share * 2**32:  # not the digits that order them: these would all come first
            yield run


def model_file(run: Run, folder: Path) -> Path:
    """The model as a file that the program reads, written into the folder where there is none."""
    file, source = folder / f"{run.model}.stl", Path(run.source)
    if run.group == "forms":
        vertices, faces = form(run.source)
    elif source.suffix == ".npz":
        with np.load(source) as mesh:
            vertices, faces = mesh["vertices"].astype(float), mesh["faces"].astype(np.int64)
        vertices = vertices * (MESH_MM / np.ptp(vertices, axis=0).max())
    else:
        return source
    write_stl(file, vertices, faces)
    return file


def longest_side_mm(file: Path) -> float:
    """The longest side of a model; that of any mesh where the model cannot be read, which the run will tell."""
    try:
        return float(np.ptp(read_mesh(file)[0].vertices, axis=0).max())
    except UserError:
        return MESH_MM


def options_of(run: Run, file: Path) -> list[str]:
    """Options of the command line: none of a run by default settings; of one that varies what its name says, by a seed."""
    if not run.varies:
        return []
    dice = random.Random(run.name)
    machine, nozzle_mm = dice.choice(MACHINES), dice.choice(NOZZLES_MM)
    height_mm = dice.choice([height for height in HEIGHTS_MM if height <= 0.75 * nozzle_mm])
    support = dice.choice([*get_args(Process.model_fields["support_style"].annotation), "none"])
    copies = dice.choice([1, 1, 1, 1, 1, 2, 3])
    settings = {
        "machine.head.nozzle_mm": nozzle_mm,
        "process.line_width_mm": round(1.125 * nozzle_mm, 3),
        "process.layer_height_mm": height_mm,
        "process.first_layer_height_mm": max(height_mm, min(0.2, round(0.7 * nozzle_mm, 3))),
        "process.infill_density": dice.choice(DENSITIES),
        "process.walls": dice.randint(1, 6),
        "process.support": "none" if support == "none" else "auto",
        **({} if support == "none" else {"process.support_style": support}),
        "process.scale": round(_scale(dice, longest_side_mm(file), machine, height_mm, copies), 3),
    }
    options = ["--machine", machine, "--material", dice.choice(MATERIALS)]
    options += [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    if copies > 1:
        return [*options, "--parts", "1", "--copies", str(copies)]
    return [*options, "--as-is"] if dice.random() < 0.3 else options


def _scale(dice: random.Random, longest_mm: float, machine: str, height_mm: float, copies: int) -> float:
    """0.2 to 4, evenly by its logarithm, but nothing larger than its plate or of more than some 500 layers."""
    low, high = np.log(SCALES)
    room_mm = 1.3 * load(machine=machine).machine.table.radius_mm
    most_mm = min(500.0 * height_mm, room_mm if copies == 1 else 0.4 * room_mm)
    return min(float(np.exp(dice.uniform(low, high))), most_mm / longest_mm)
