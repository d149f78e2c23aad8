"""Ship kernels: put compiled kernels beside the packages, so that a first run need not compile for a minute.

    python .ci/ship_kernels.py -o dist      a wheel of this checkout with kernels
    PYTHON .ci/ship_kernels.py              adds kernels to the packages that this PYTHON imports

They fit the Python, numba and llvmlite that run this script, on processors of the same kind (mdp.kernels.cache); with others the
program compiles as without them. Kernels in the folder NUMBA_CACHE_DIR are not compiled again.
"""

import argparse
import os
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[1]
PROJECT = ("profiles", "mdp", "slicer", "machine", "pyproject.toml", "README.md", "LICENSE")
# In addition to the bundles of a first run: runs that call kernels of some models and settings only.
RUNS = (
    "print demo:tree --port sim --set machine.arcs=true",
    "export demo:figure -o a.gcode --set process.adaptive_cusp_mm=0.05 --set process.seam=random --set search.simplify_faces=500"
    " --set process.infill_pattern=lightning",
    "simulate a.gcode --baud 115200",
)


def main() -> None:
    """Make the wheel, or add kernels to the packages that are imported here."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("-o", "--out", type=Path, metavar="FOLDER", help="make a wheel there")
    given = options.parse_args()
    with TemporaryDirectory() as folder:
        if given.out and find_spec("build") is None:
            sys.exit("ship_kernels.py: a wheel needs the package build: pip install -e '.[dev]' brings it")
        if given.out:
            print(_wheel(Path(folder), given.out.resolve()))
        else:
            os.environ.setdefault("NUMBA_CACHE_DIR", folder)
            _compile()
            _ship()


def _wheel(copy: Path, out: Path) -> str:
    """The wheel of a copy of the checkout, which is not changed."""
    for name in PROJECT:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "compiled"))
        else:
            shutil.copy(ROOT / name, copy)
    subprocess.run([sys.executable, __file__], check=True, env=os.environ | {"PYTHONPATH": str(copy)})
    subprocess.run([sys.executable, "-m", "build", "--quiet", "--wheel", "--outdir", str(out), str(copy)], check=True)
    wheel = max(out.glob("tiltprint-*.whl"), key=lambda path: path.stat().st_mtime)
    return f"{wheel}: {wheel.stat().st_size / 2**20:.1f} MiB"


def _compile() -> None:
    """Compile by running everything that calls kernels; cached ones are not compiled again."""
    from machine.cli.cli import main as tiltprint
    from machine.pipeline.compilers import wait_for
    from machine.pipeline.precompile import BUNDLES
    from mdp.kernels.cache import SHIPPED

    shutil.rmtree(SHIPPED, ignore_errors=True)
    wait_for(BUNDLES)  # in processes, which may fail
    for bundle in (*BUNDLES.values(), _fine_model, _limb):
        bundle()
    with TemporaryDirectory() as folder, redirect_stdout(sys.stderr):
        os.environ.update(XDG_STATE_HOME=folder, XDG_CONFIG_HOME=folder)
        os.chdir(folder)
        for run in RUNS:
            if tiltprint(run.split()):
                sys.exit(f"ship_kernels.py: failed: tiltprint {run}")


def _fine_model() -> None:
    """Call the kernels for meshes of more than 20,000 faces."""
    import manifold3d as m3

    from mdp.cost.hidden import hidden_shares
    from mdp.cut import mesh_of

    hidden_shares(mesh_of(m3.Manifold.sphere(10.0, 260)))


def _limb() -> None:
    """Call the kernels for a limb that is cut off while others stand beside it, over which travels pass."""
    import numpy as np

    from mdp.clearance import StandingColumns
    from profiles.profile import load

    StandingColumns.of(np.ones((2, 3)), 0.0, load().machine).least_tip_mm(np.zeros((1, 2)))


def _ship() -> None:
    """Copy the kernels that fit the packages as they are."""
    from mdp.kernels.cache import HAS_KERNELS, PACKAGES, SHIPPED, folder_name, home

    files = [file for package in PROJECT[:4] for file in sorted((PACKAGES / package).rglob("*.py"))]
    files = [file for file in files if HAS_KERNELS in file.read_bytes() and b"\n@kernel\n" in file.read_bytes()]
    missing = [str(file.relative_to(PACKAGES)) for file in files if not (home() / folder_name(file)).exists()]
    if missing:
        sys.exit(f"ship_kernels.py: no kernels were compiled of {', '.join(missing)}: a line of RUNS should call them")
    for file in files:
        shutil.copytree(home() / folder_name(file), SHIPPED / folder_name(file))


if __name__ == "__main__":
    main()
