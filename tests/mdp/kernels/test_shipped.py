"""Compiled kernels shipped with the program: used only where they fit, wherever they are installed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.mdp.kernels.small_program import PART_FILE, result_and_compilations, write_program

ANOTHER_CPU = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the program with its kernel compiled for near(2.0), as a wheel has it."""
    program = write_program(tmp_path_factory.mktemp("built") / "program")
    environment = {"NUMBA_CACHE_DIR": str(program / "kernels" / "compiled"), "PYTHONDONTWRITEBYTECODE": "1"}
    assert result_and_compilations(program, **environment) == "21.0 1"
    return program.parent


@pytest.fixture
def shipped(built: Path, program: Path) -> Path:
    """The program's package, installed by copying the build."""
    return shutil.copytree(built, program.parent, dirs_exist_ok=True) / "mdp"


def compiled_here(tmp_path: Path) -> list[str]:
    """The folders of the kernels that were compiled although kernels were shipped."""
    return sorted(path.name.partition("-")[0] for path in (tmp_path / "cached").glob("*"))


def test_a_kernel_that_was_shipped_is_not_compiled(shipped: Path, tmp_path: Path) -> None:
    assert result_and_compilations(shipped) == "21.0 0"
    assert compiled_here(tmp_path) == []


def test_it_is_used_wherever_and_whenever_the_program_is_installed(shipped: Path, tmp_path: Path) -> None:
    installed = shutil.copytree(shipped.parent, tmp_path / "elsewhere" / "site-packages") / "mdp"
    for file in installed.rglob("*.py"):
        os.utime(file, (0, 0))
    assert result_and_compilations(installed) == "21.0 0"


def test_it_is_used_by_a_link_to_the_program(shipped: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(shipped.parent, target_is_directory=True)
    assert result_and_compilations(tmp_path / "link" / "mdp") == "21.0 0"


def test_a_changed_dependency_in_another_file_causes_compilation(shipped: Path, tmp_path: Path) -> None:
    (shipped / "far.py").write_text(PART_FILE.replace("10.0", "20.0"), encoding="utf-8")
    assert result_and_compilations(shipped) == "41.0 1"
    (shipped / "far.py").write_text(PART_FILE.replace("PART = 1.0", "PART = 2.0"), encoding="utf-8")
    assert result_and_compilations(shipped) == "22.0 1"
    assert compiled_here(tmp_path) == ["mdp.near", "mdp.near"]


def test_for_another_processor_it_is_compiled(shipped: Path, tmp_path: Path) -> None:
    assert result_and_compilations(shipped, **ANOTHER_CPU) == "21.0 1"
    assert compiled_here(tmp_path) == ["mdp.near"]


@pytest.mark.parametrize("library", ["numba", "llvmlite"])
def test_another_compiler_version_causes_compilation(shipped: Path, library: str) -> None:
    assert result_and_compilations(shipped, f"import numba, {library}; {library}.__version__ += '.1'") == "21.0 1"


def test_another_python_version_causes_compilation(shipped: Path) -> None:
    assert result_and_compilations(shipped, "import sys, numba; sys.implementation.cache_tag = 'cpython-310'") == "21.0 1"


def test_for_other_arguments_it_is_compiled_into_the_user_s_folder_and_what_was_shipped_stays_as_it_is(
    shipped: Path, tmp_path: Path
) -> None:
    folder = shipped / "kernels" / "compiled"
    before = {path: path.stat().st_mtime_ns for path in (folder, *folder.rglob("*"))}
    for path in before:
        path.chmod(path.stat().st_mode & ~0o222)
    assert result_and_compilations(shipped, "from mdp.near import near; near(1)") == "21.0 1"
    assert {path: path.stat().st_mtime_ns for path in (folder, *folder.rglob("*"))} == before
    assert compiled_here(tmp_path) == ["mdp.near"]
    assert result_and_compilations(shipped, "from mdp.near import near; near(1)") == "21.0 0"


def test_shipped_kernels_need_no_writable_folder(shipped: Path, tmp_path: Path) -> None:
    (tmp_path / "cached").write_text("")
    code = "from mdp.near import near; from mdp.kernels import cache; print(near(2.0), cache.is_cached(''), [cache.trouble()])"
    done = subprocess.run([sys.executable, "-c", code], cwd=shipped.parent, capture_output=True, text=True, check=True)
    assert done.stdout == "21.0 True ['']\n"


@pytest.mark.parametrize("can", [True, False])
def test_a_processor_that_lacks_an_instruction_of_the_common_target_compiles_for_itself(
    program: Path, can: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_CPU_NAME", raising=False)  # this process sets it for all processes that it starts
    monkeypatch.delenv("NUMBA_CPU_FEATURES", raising=False)
    code = (
        "from llvmlite import binding\n"
        "host = binding.get_host_cpu_features()\n"
        f"host['avx2'] = host.get('avx2') and {can}\n"
        "binding.get_host_cpu_features = lambda: host\n"
        "from mdp.kernels.cache import COMMON, INSTRUCTIONS, TARGET\n"
        "print(COMMON in TARGET, all(host.get(name) for name in INSTRUCTIONS))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=program.parent, capture_output=True, text=True, check=True)
    common, able = done.stdout.split()
    assert common == able
    assert can or common == "False"
