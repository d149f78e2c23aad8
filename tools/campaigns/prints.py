"""The whole program over many models: `python tools/campaigns/prints.py OUT [FOLDER ...] [--varied N] [--every N] [--workers N]`.

Models are those in the folders (npz meshes, vertices in mm and faces, are scaled to 60 mm) and the demos. `tiltprint batch`
exports all with the default settings, then a sample with each of N random sets of settings, determined by a number: machine,
material, nozzle, layers, infill, walls, support, scale. OUT/table.md counts the results and names each model that is not printed,
with the message, and each warning of the dry run. The same command resumes a stopped run. Options after `--` are passed to
`tiltprint batch`.
"""

import csv
import random
import subprocess
from collections import Counter
from collections.abc import Sequence
from math import ceil, log
from pathlib import Path
from shutil import copyfile
from statistics import median
from typing import get_args

import numpy as np

from mdp.formats.readers import READERS
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.save import stl
from profiles.process import Process
from profiles.profile import load
from tools.bench.harness import OURS
from tools.campaigns.harness import counts, options_of, table

DEMOS = ("bracket", "figure", "lattice", "tree")
MESH_MM = 60.0  # longest side of the meshes
MACHINES = ("generic_ac", "gen5x", "linuxcnc_xyzac", "fractal5pro")
HEIGHTS_MM = (0.1, 0.15, 0.2, 0.25, 0.3)
SCALES = (0.2, 2.0)
Row = dict[str, str]


def main() -> None:
    """Prepare the models, export them, write the table."""
    parser = options_of(__doc__, varied=4, every=1, sample=10)
    parser.add_argument("out", type=Path)
    parser.add_argument("folders", type=Path, nargs="*")
    parser.add_argument("--workers", type=int, default=1)
    given, further = parser.parse_known_args()
    models = lay_out(given.folders, given.every, given.out / "models")
    words = ["--workers", str(given.workers), *(word for word in further if word != "--")]
    rows = exported(models, given.out / "default", words)
    for number in range(given.varied):
        own = given.out / f"models-{number}"
        own.mkdir(exist_ok=True)
        among = sorted(models.iterdir())
        for file in random.Random(number).sample(among, min(given.sample, len(among))):
            copyfile(file, own / file.name)
        rows += exported(own, given.out / f"varied-{number}", [*words, *drawn_options(number)])
    (given.out / "table.md").write_text(report(rows) + "\n")
    print(report(rows))


def lay_out(folders: Sequence[Path], every: int, out: Path) -> Path:
    """A folder with the demos and every N-th model of each folder, in formats that the program reads."""
    out.mkdir(parents=True, exist_ok=True)
    for demo in DEMOS:
        copyfile(locate(f"demo:{demo}"), out / f"{demo}.ply")
    for folder in folders:
        for file in sorted(file for file in folder.iterdir() if file.suffix.lower() in (".npz", *READERS))[::every]:
            if file.suffix != ".npz":
                copyfile(file, out / file.name)
                continue
            with np.load(file) as arrays:
                vertices = arrays["vertices"].astype(np.float64)
                mesh = Mesh(vertices * (MESH_MM / np.ptp(vertices, axis=0).max()), arrays["faces"].astype(np.int64))
            (out / f"{file.stem}.stl").write_bytes(stl(mesh))
    return out


def exported(models: Path, out: Path, words: Sequence[str]) -> list[Row]:
    """The rows of `tiltprint batch`, each with the name of its run."""
    subprocess.run([*OURS, "batch", str(models), "-o", str(out), *words], check=False)  # exits with 1 if not all are printed
    with (out / "export.csv").open(newline="", encoding="utf-8", errors="surrogateescape") as file:
        return [row | {"run": out.name} for row in csv.DictReader(file)]


def drawn_options(number: int) -> list[str]:
    """Random command-line options, determined by a number."""
    dice = random.Random(number)
    machine, nozzle_mm = dice.choice(MACHINES), dice.choice((0.25, 0.4, 0.6, 0.8))
    height_mm = dice.choice([height for height in HEIGHTS_MM if height <= 0.75 * nozzle_mm])
    support = dice.choice([*get_args(Process.model_fields["support_style"].annotation), "none"])
    low, high = map(log, SCALES)
    room_mm = min(500.0 * height_mm, 1.3 * load(machine=machine).machine.table.radius_mm)
    settings = {
        "machine.head.nozzle_mm": nozzle_mm,
        "process.line_width_mm": round(1.125 * nozzle_mm, 3),
        "process.layer_height_mm": height_mm,
        "process.first_layer_height_mm": max(height_mm, min(0.2, round(0.7 * nozzle_mm, 3))),
        "process.infill_density": dice.choice((0.0, 0.05, 0.15, 0.3, 0.6, 1.0)),
        "process.walls": dice.randint(1, 6),
        "process.support": "none" if support == "none" else "auto",
        **({} if support == "none" else {"process.support_style": support}),
        "process.scale": round(min(np.exp(dice.uniform(low, high)), room_mm / MESH_MM), 3),
    }
    words = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    as_is = ["--as-is"] if dice.random() < 0.3 else []
    return ["--machine", machine, "--material", dice.choice(("pla", "petg", "tpu")), *as_is, *words]


def report(rows: Sequence[Row]) -> str:
    """Results of the runs, then every model that was not printed, then the warnings."""
    columns = counts(("done", "refused", "failed"), lambda row: row["status"])
    columns |= {"core s: median, 95 %, most": lambda mine: spread([float(row["core_s"] or 0.0) for row in mine])}
    failures = [f"- {row['run']}/{row['model']}: {row['status']}: {row['sentence']}" for row in rows if row["status"] != "done"]
    found = Counter(code for row in rows for code in row["findings"].split())
    warnings = ", ".join(f"{code} {count}" for code, count in found.most_common())
    return "\n".join([table(rows, "run", lambda row: row["run"], columns), "", *failures, "", f"findings: {warnings or 'none'}"])


def spread(values: Sequence[float]) -> str:
    """Median, 95th percentile and maximum."""
    rising = sorted(values)
    return f"{median(rising):.1f}, {rising[ceil(0.95 * len(rising)) - 1]:.1f}, {rising[-1]:.1f}"


if __name__ == "__main__":
    main()
