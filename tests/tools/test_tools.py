"""Tools: every benchmark and campaign still finds what it uses."""

import runpy
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "tools"


@pytest.mark.parametrize("tool", sorted(file.name for file in TOOLS.glob("*.py")))
def test_a_tool_finds_all_that_it_imports(tool: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TOOLS))  # as when it is run as a script
    assert runpy.run_path(str(TOOLS / tool), run_name="not run")
