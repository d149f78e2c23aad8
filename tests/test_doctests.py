"""The examples in docstrings run as they are printed."""

import doctest
from importlib import import_module

import pytest

MODULES = (
    "mdp.directions.frame",
    "mdp.plane",
    "mdp.pose",
    "mdp.sweep.sweep",
    "mdp.topology.components",
    "mdp.topology.linked_faces",
    "profiles.search",
)


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_a_module_hold(name: str) -> None:
    tried = doctest.testmod(import_module(name))
    assert tried.attempted > 0
    assert tried.failed == 0
