"""Kernels from the cache: what loading them does without, and kernels compiled on top of them."""

from pathlib import Path

from tests.mdp.kernels.small_program import output_of

CALLER = (
    "from mdp.kernels.kernel import kernel\nfrom mdp.near import near\n\n\n@kernel\ndef twice(x):\n    return 2.0 * near(x)\n"
)
COMPILED = (
    "import sys; from mdp.near import near; from numba.core.runtime import rtsys\n"
    "print(near(2.0), 'numba.np.linalg' in sys.modules, rtsys._init)"
)


def test_nothing_that_only_compiling_needs_is_imported_or_compiled_for_a_cached_kernel(program: Path) -> None:
    assert [output_of(program, COMPILED), output_of(program, COMPILED)] == ["21.0 True True", "21.0 False False"]


def test_a_kernel_can_be_compiled_with_one_that_comes_from_the_cache(program: Path) -> None:
    (program / "caller.py").write_text(CALLER, encoding="utf-8")
    output_of(program, COMPILED)
    both = "from mdp.near import near; from mdp.caller import twice; print(near(2.0), twice(2.0), near.stats.cache_hits.total())"
    assert output_of(program, both) == "21.0 42.0 1"
