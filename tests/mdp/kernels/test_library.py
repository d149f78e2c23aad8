"""How machine code is made: of kernels with their parts, not of the parts."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Flags
from numba.core.registry import cpu_target

from mdp.kernels import library
from mdp.kernels.kernel import part


@part
def _halved(values: Any, index: int) -> float:
    if index >= len(values):
        raise IndexError("beyond the end")
    return values[index] / 2.0


@part
def _halves(values: Any, count: int) -> float:
    total = 0.0
    for index in range(count):
        total += _halved(values, index)
    return total


def _sum_of_halves(values: Any, count: int) -> float:
    return _halves(values, count)


def _has_code(dispatcher: Any) -> bool:
    compiled = next(iter(dispatcher.overloads.values())).library
    return not compiled._waits


def test_a_kernel_has_machine_code_and_its_parts_have_none_of_their_own() -> None:
    kernel = njit(_sum_of_halves)
    assert kernel(np.array([1.0, 2.0, 3.0]), 3) == 3.0
    assert [_has_code(kernel), _has_code(_halves), _has_code(_halved)] == [True, False, False]


def test_an_error_of_a_part_deep_in_a_kernel_keeps_its_words() -> None:
    kernel = njit(_sum_of_halves)
    with pytest.raises(IndexError, match="beyond the end"):
        kernel(np.array([1.0]), 2)


def test_a_part_that_is_asked_for_its_address_gets_code_then() -> None:
    njit(_sum_of_halves)(np.array([1.0]), 1)
    compiled = next(iter(_halved.overloads.values()))  # type: ignore[attr-defined]
    assert compiled.library.get_pointer_to_function("no_such_name") == 0
    assert compiled.library.get_pointer_to_function(compiled.fndesc.mangled_name) != 0


def test_the_options_are_those_that_numba_reads_one_by_one() -> None:
    flags = Flags()
    flags.nrt, flags.error_model = True, "numpy"
    assert library.option_values(flags) == {name: getattr(flags, name) for name in flags.options}
    assert flags.values() == library.option_values(flags)


def test_where_numba_has_no_such_method_its_libraries_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    codegen = cpu_target.target_context.codegen()
    monkeypatch.setattr(codegen, "_library_class", JITCodeLibrary)
    monkeypatch.setattr(library, "PUT_OFF", ("a_method_of_an_older_numba",))
    library.use_kernel_libraries()
    assert codegen._library_class is JITCodeLibrary


SORTED = """
import numpy as np
from numba import njit
from mdp.kernels.sorting import argsort

kernel = njit(lambda keys: argsort(keys))
print(kernel(np.sin(np.arange(50.0))).tolist())
print(type(next(iter(argsort.overloads.values())).library).__name__)
"""
PLAIN = "from mdp.kernels import library\nlibrary.PUT_OFF = ('a_method_of_an_older_numba',)\n"


def test_a_kernel_gives_the_same_numbers_by_numbas_own_libraries() -> None:
    own, plain = (
        subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout.splitlines()
        for text in (SORTED, PLAIN + SORTED)
    )
    assert own[0] == plain[0]
    assert [own[1], plain[1]] == ["KernelLibrary", "JITCodeLibrary"]
