"""A program of two files, a kernel and its helper, with a copy of mdp.kernels, run by new interpreters."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from mdp.kernels import cache

KERNEL_FILE = (
    "from mdp.kernels.kernel import kernel\nfrom mdp.far import PART, far\n\n\n@kernel\ndef near(x):\n    return far(x) + PART\n"
)
PART_FILE = "from mdp.kernels.kernel import helper\n\nPART = 1.0\n\n\n@helper\ndef far(x):\n    return 10.0 * x\n"


def write_program(folder: Path) -> Path:
    """Write the program; returns the package that contains its two files, near.py and far.py."""
    package = folder / "mdp"
    package.mkdir(parents=True)
    shutil.copytree(
        cache.PACKAGES / "mdp" / "kernels", package / "kernels", ignore=shutil.ignore_patterns("__pycache__", "compiled")
    )
    profiles = folder / "profiles"
    profiles.mkdir()
    for name in ("__init__.py", "errors.py", "folders.py", "messages.py"):
        shutil.copy(cache.PACKAGES / "profiles" / name, profiles)
    (package / "__init__.py").touch()
    (package / "near.py").write_text(KERNEL_FILE, encoding="utf-8")
    (package / "far.py").write_text(PART_FILE, encoding="utf-8")
    return package


def output_of(program: Path, code: str, **environment: str) -> str:
    """The output of a new interpreter."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=program.parent,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


def result_and_compilations(program: Path, before: str = "", **environment: str) -> str:
    """The result of near(2.0) in a new interpreter, and its number of compilations; before: code that it runs first."""
    code = f"{before}; from mdp.near import near; print(near(2.0), sum(near.stats.cache_misses.values()))".removeprefix("; ")
    return output_of(program, code, **environment)
