"""Tools: every benchmark, campaign, check, maker and packaging script still finds the names that it uses."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TOOLS = [str(file.relative_to(ROOT)) for folder in (".ci", "tools") for file in ROOT.glob(f"{folder}/**/*.py")]


@pytest.mark.parametrize("tool", sorted(TOOLS))
def test_a_tool_finds_all_that_it_imports(tool: str) -> None:
    assert runpy.run_path(str(ROOT / tool), run_name="not run")


def test_every_tool_is_in_one_of_the_four_folders() -> None:
    inside = {file.relative_to(ROOT).parts[1] for file in ROOT.glob("tools/*/**/*.*") if "__pycache__" not in file.parts}
    beside = {file.name for file in ROOT.glob("tools/*") if file.is_file()}
    assert (inside, beside) == ({"bench", "campaigns", "checks", "docs"}, {"RESULTS.md"})
