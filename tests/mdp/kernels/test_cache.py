"""The cache of compiled kernels: a program of two files, edited between runs of the interpreter.

Modules that are not needed to load cached kernels, and kernels compiled on top of them.
"""

import subprocess
import sys
from pathlib import Path

import pytest

from mdp.kernels import cache
from tests.mdp.kernels.small_program import PART_FILE, output_of, result_and_compilations


def test_a_kernel_is_compiled_once_and_again_when_a_part_or_a_constant_in_another_file_changes(program: Path) -> None:
    assert [result_and_compilations(program), result_and_compilations(program)] == ["21.0 1", "21.0 0"]
    (program / "far.py").write_text(PART_FILE.replace("10.0", "20.0"), encoding="utf-8")
    assert [result_and_compilations(program), result_and_compilations(program)] == ["41.0 1", "41.0 0"]
    (program / "far.py").write_text(PART_FILE.replace("PART = 1.0", "PART = 2.0"), encoding="utf-8")
    assert result_and_compilations(program) == "22.0 1"


def test_a_kernel_with_a_truncated_file_is_compiled_again(program: Path) -> None:
    result_and_compilations(program)
    [file] = (program.parent.parent / "cached").rglob("*.nbc")
    file.write_bytes(b"")
    assert [result_and_compilations(program), result_and_compilations(program)] == ["21.0 1", "21.0 0"]


def test_the_sources_of_a_kernel_are_its_file_and_what_its_parts_and_constants_come_from() -> None:
    strokes = cache.PACKAGES / "slicer" / "strokes"
    sources = cache.sources(strokes / "path_order.py")
    assert {file.relative_to(cache.PACKAGES).as_posix() for file in sources} == {
        "slicer/strokes/path_order.py",
        "mdp/kernels/arrays.py",
        "mdp/kernels/kernel.py",
        "mdp/mesh.py",
    }
    assert cache.PACKAGES / "slicer" / "geometry" / "edge_index.py" in cache.sources(strokes / "travels.py")


def test_the_folder_is_the_one_named_or_the_user_s_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "named"))
    assert cache.home() == tmp_path / "named"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache.home() == tmp_path / "tiltprint" / "kernels"


def test_every_kernel_of_the_packages_is_compiled_by_the_decorators_of_the_kernel_page() -> None:
    packages = [cache.PACKAGES / name for name in ("mdp", "slicer", "machine")]
    files = [file for package in packages for file in package.rglob("*.py") if file.name != "kernel.py"]
    assert [file.name for file in files if "njit" in file.read_text(encoding="utf-8")] == []


def test_a_kernel_that_cannot_be_cached_works_and_the_reason_is_noted(tmp_path: Path, program: Path) -> None:
    code = (
        "import errno; from mdp.near import near; from mdp.kernels.cache import trouble\n"
        "def full(*overload): raise OSError(errno.ENOSPC, 'No space left on device')\n"
        "near._cache._cache_file.save = full\n"
        "print(near(2.0), trouble())"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=program.parent, capture_output=True, text=True, check=True)
    assert done.stdout == f"21.0 {tmp_path / 'cached'} cannot be written: no space left on device\n"


def test_an_invalid_cache_folder_is_not_replaced_by_one_beside_the_source(
    tmp_path: Path, program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    assert result_and_compilations(program).startswith("21.0")
    assert list(program.rglob("*.nbi")) == []


CALLER = (
    "from mdp.kernels.kernel import kernel\nfrom mdp.near import near\n\n\n@kernel\ndef twice(x):\n    return 2.0 * near(x)\n"
)
COMPILED = (
    "import sys; from mdp.near import near; from numba.core.runtime import rtsys\n"
    "print(near(2.0), 'numba.np.linalg' in sys.modules, rtsys._init)"
)


def test_a_cached_kernel_imports_and_compiles_nothing(program: Path) -> None:
    assert [output_of(program, COMPILED), output_of(program, COMPILED)] == ["21.0 True True", "21.0 False False"]


def test_a_kernel_can_be_compiled_with_one_that_comes_from_the_cache(program: Path) -> None:
    (program / "caller.py").write_text(CALLER, encoding="utf-8")
    output_of(program, COMPILED)
    both = "from mdp.near import near; from mdp.caller import twice; print(near(2.0), twice(2.0), near.stats.cache_hits.total())"
    assert output_of(program, both) == "21.0 42.0 1"
