"""Shared by all benches: options, tables, timing, whole commands, PrusaSlicer as the rival, and runs beside an older commit.

Every bench takes `--beside COMMIT`: it runs `--turns` times with this checkout and, in turn, with the packages of that commit.
Compare only runs of one call, for other work on the computer changes all times.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time
from typing import TypeVar

from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.read import read_mesh

ROOT = Path(__file__).resolve().parents[2]
OURS = (sys.executable, "-c", "import sys; from machine.cli.start import main; sys.exit(main())")
# Settings for the same beads from both slicers.
SAME = (
    "process.layer_height_mm=0.2", "process.first_layer_height_mm=0.2", "process.walls=3", "process.top_layers=4",
    "process.bottom_layers=4", "process.infill_density=0.2", "process.infill_pattern=grid", "process.support=none",
    "process.skirt_loops=0", "process.retract_travel_mm=1.5", "process.elephant_foot_mm=0", "process.small_base_brim_mm=0",
    "process.outer_bulge=0", "process.overhang_share=0", "process.least_layer_time_s=0", "machine.purge_mm=0",
)  # fmt: skip
WIDTHS = ("", "external-perimeter-", "perimeter-", "infill-", "solid-infill-", "top-infill-", "first-layer-")
PRUSA_SAME = (
    "--gcode --nozzle-diameter 0.4 --filament-diameter 1.75 --layer-height 0.2 --first-layer-height 0.2 --perimeters 3 "
    "--top-solid-layers 4 --bottom-solid-layers 4 --fill-density 20% --fill-pattern grid --brim-width 0 --retract-length 0.8 "
    "--retract-before-travel 1.5 --only-retract-when-crossing-perimeters --use-relative-e-distances --layer-gcode G92E0 "
    "--skirts 0 --seam-position aligned --elefant-foot-compensation 0 --no-cooling "
) + " ".join(f"--{kind}extrusion-width 0.45" for kind in WIDTHS)
OUR_SUPPORT, PRUSA_SUPPORT = "process.support=auto", ("--support-material", "--support-material-style", "snug")

# Runs a command in a small process of its own, for a child process begins with the resident memory of its parent.
METER = """import resource, subprocess, sys
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(code)"""

Result = TypeVar("Result")


@dataclass(frozen=True, order=True)
class Used:
    """Resources of some work: core seconds (user and system), wall seconds, and greatest resident memory of a process."""

    core_s: float
    wall_s: float
    memory_mb: float


def options_of(doc: str, models: bool = True) -> argparse.ArgumentParser:
    """Options of all benches; models: whether the bench takes models."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if models:
        parser.add_argument("models", nargs="*", default=["demo:figure", "demo:tree", "demo:bracket", "demo:lattice"])
        parser.add_argument("--height", type=float, default=0.0, metavar="MM", help="scale models to this height; 0: as they are")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--runs", type=int, default=3, help="the least of so many warm runs counts")
    parser.add_argument("--beside", metavar="COMMIT", help="run in turns with the packages of an older commit")
    parser.add_argument("--turns", type=int, default=2)
    return parser


def run(parser: argparse.ArgumentParser, bench: Callable[[argparse.Namespace], None]) -> None:
    """Run a bench, or the same command in turns with this checkout and an older one."""
    given = parser.parse_args()
    if given.beside is None:
        bench(given)
        return
    words = (word for word in sys.argv[1:] if word not in ("--beside", given.beside, f"--beside={given.beside}"))
    own_words = [str(Path(word).resolve()) if Path(word).exists() else word for word in words]
    script = Path(sys.argv[0]).resolve().relative_to(ROOT)
    with older_checkout(given.beside) as older:
        for turn in range(given.turns):
            for name, root in (("this checkout", ROOT), (given.beside, older)):
                print(f"\n## {name}, turn {turn + 1}", flush=True)
                environment = os.environ | {"PYTHONPATH": str(root)}
                subprocess.run([sys.executable, str(root / script), *own_words], check=True, env=environment, cwd=root)


@contextmanager
def older_checkout(commit: str) -> Iterator[Path]:
    """A work tree of a commit with the tools of this checkout."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", str(tree), commit], check=True)
        try:
            shutil.rmtree(tree / "tools", ignore_errors=True)
            shutil.copytree(ROOT / "tools", tree / "tools")
            yield tree
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=True)


def heading(*columns: str) -> None:
    """Begin a Markdown table."""
    print(f"\n| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)


def row(*cells: object) -> None:
    """Print a row of the table; numbers have two decimals, None and nan mean not measured."""
    texts = (f"{cell:.2f}" if isinstance(cell, float) else str(cell) for cell in cells)
    texts = ("-" if text in ("None", "nan") else text for text in texts)
    print(f"| {' | '.join(texts)} |", flush=True)


def timed(work: Callable[[], Result]) -> tuple[Result, Used]:
    """Result of a call in this process, and its resources; the memory is the maximum of the process so far."""
    core, wall = process_time(), perf_counter()
    result = work()
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return result, Used(process_time() - core, perf_counter() - wall, memory_mb)


def least(work: Callable[[], object], runs: int) -> Used:
    """Resources of a warm call: the run with the fewest core seconds."""
    work()
    return min(timed(work)[1] for _ in range(runs))


def command(words: Sequence[str | Path]) -> Used:
    """Resources of a whole command in processes of its own. Ends the bench if the command fails."""
    begun = perf_counter()
    done = subprocess.run([sys.executable, "-c", METER, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, words[-6:]))} failed: {(done.stderr or done.stdout).strip()[-300:]}")
    core_s, memory_kib = map(float, done.stdout.split()[-2:])
    return Used(core_s, perf_counter() - begun, memory_kib / 1024)


def in_turns(commands: Sequence[Sequence[str | Path]], runs: int) -> list[Used]:
    """Least resources of each command, run in turns."""
    used = [[command(words) for words in commands] for _ in range(runs)]
    return [min(column) for column in zip(*used, strict=True)]


def standing(model: str, height_mm: float) -> Mesh:
    """A model, scaled to a height unless that is 0."""
    mesh, _ = read_mesh(locate(model))
    return Mesh(mesh.vertices * (height_mm / mesh.bounds_mm[1, 2] if height_mm else 1.0), mesh.faces)


def prusa_command(model: Path, out: Path, support: bool, further: str = "") -> list[str | Path] | None:
    """PrusaSlicer's command for a model with the same settings; None if it is not installed."""
    own = PRUSA_SUPPORT if support else ("--no-overhangs",)
    found = shutil.which("prusa-slicer")
    return found and [found, *PRUSA_SAME.split(), *further.split(), *own, "-o", out, model]
