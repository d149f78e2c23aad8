"""Tools: every benchmark, campaign, check and maker still finds the names that it uses."""

import runpy
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "tools"


@pytest.mark.parametrize("tool", sorted(str(file.relative_to(TOOLS)) for file in TOOLS.rglob("*.py")))
def test_a_tool_finds_all_that_it_imports(tool: str) -> None:
    assert runpy.run_path(str(TOOLS / tool), run_name="not run")
