"""The examples in the docstrings are correct: every module that has any runs them."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

from tools.docs.draw_rooms import LAYERS

ROOT = Path(__file__).resolve().parents[1]


def modules_with_examples() -> list[str]:
    files = sorted(path for layer in LAYERS for path in (ROOT / layer).rglob("*.py"))
    with_examples = [path for path in files if "    >>> " in path.read_text(encoding="utf-8")]
    return [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in with_examples]


@pytest.mark.parametrize("module", modules_with_examples())
def test_the_examples_of_a_module_are_true(module: str) -> None:
    failed, attempted = doctest.testmod(import_module(module), optionflags=doctest.ELLIPSIS)
    assert (failed, attempted > 0) == (0, True)


def test_a_newcomer_finds_an_example_of_slicing() -> None:
    assert {"slicer.slice", "mdp.topology.cross_section"} <= set(modules_with_examples())
