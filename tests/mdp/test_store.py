"""Where compiled kernels are kept: a program of two files, edited between runs of the interpreter."""

import subprocess
import sys
from pathlib import Path

import pytest

from mdp import store

KERNEL_FILE = (
    "from mdp.kernel import kernel\nfrom mdp.far import PART, far\n\n\n@kernel\ndef near(x):\n    return far(x) + PART\n"
)
PART_FILE = "from mdp.kernel import part\n\nPART = 1.0\n\n\n@part\ndef far(x):\n    return 10.0 * x\n"


@pytest.fixture
def program(tmp_path, monkeypatch):
    """A folder with the packages' kernel page and two files of a program, and a cache of its own."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # Python knows an edited file by its size and the second of its date
    packages = tmp_path / "program" / "mdp"
    packages.mkdir(parents=True)
    for name in ("__init__.py", "kernel.py", "store.py"):
        (packages / name).write_text((store.PACKAGES / "mdp" / name).read_text(encoding="utf-8"), encoding="utf-8")
    (packages / "near.py").write_text(KERNEL_FILE, encoding="utf-8")
    (packages / "far.py").write_text(PART_FILE, encoding="utf-8")
    return packages


def said(program: Path) -> str:
    """What a new interpreter finds for near(2.0), and whether it had to compile."""
    code = "from mdp.near import near; print(near(2.0), sum(near.stats.cache_misses.values()))"
    done = subprocess.run([sys.executable, "-c", code], cwd=program.parent, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_kernel_is_compiled_once_and_again_when_a_part_or_a_constant_in_another_file_changes(program):
    assert [said(program), said(program)] == ["21.0 1", "21.0 0"]
    (program / "far.py").write_text(PART_FILE.replace("10.0", "20.0"), encoding="utf-8")
    assert [said(program), said(program)] == ["41.0 1", "41.0 0"]
    (program / "far.py").write_text(PART_FILE.replace("PART = 1.0", "PART = 2.0"), encoding="utf-8")
    assert said(program) == "22.0 1"


def test_the_sources_of_a_kernel_are_its_file_and_what_its_parts_and_constants_come_from():
    names = {f"{file.parent.name}.{file.stem}" for file in store.sources(store.PACKAGES / "slicer" / "tour.py")}
    assert names == {"slicer.tour", "mdp.kernel", "mdp.mesh"}
    assert store.PACKAGES / "slicer" / "lattice.py" in store.sources(store.PACKAGES / "slicer" / "combing.py")


def test_the_folder_is_the_one_named_or_the_user_s_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "named"))
    assert store.home() == tmp_path / "named"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert store.home() == tmp_path / "tiltprint" / "kernels"


def test_every_kernel_of_the_packages_is_kept_by_the_state_of_its_sources():
    packages = [store.PACKAGES / name for name in ("mdp", "slicer", "machine")]
    files = [file for package in packages for file in package.rglob("*.py") if file.name not in ("kernel.py", "store.py")]
    assert [file.name for file in files if "njit" in file.read_text(encoding="utf-8")] == []
