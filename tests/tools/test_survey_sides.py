"""What the survey of ways to lie sums up."""

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from profiles.profile import load

TOOLS = Path(__file__).parents[2] / "tools"

PROFILE = load(settings=["search.turning_mm2=20"])


def row(model: str, ways: list[float], chosen: float, order: list[int]) -> dict[str, Any]:
    return {"model": model, "ways": ways, "chosen": chosen, "order": order, "choice_s": 3.0, "ways_s": 2.0 * len(ways)}


@pytest.fixture
def sides(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(TOOLS))
    return importlib.import_module("survey_sides")


def test_a_model_is_turned_only_for_what_is_clearly_cheaper(sides: ModuleType) -> None:
    assert sides.least_mm2([1000.0, 960.0], PROFILE) == 1000.0
    assert sides.least_mm2([1000.0, 940.0], PROFILE) == 940.0
    assert sides.least_mm2([100.0, 85.0], PROFILE) == 100.0


def test_what_a_choice_costs_over_the_best_and_in_searches_is_averaged(sides: ModuleType) -> None:
    rows = [
        row("a", [1000.0, 500.0], 550.0, [1, 0]),
        row("b", [300.0, 900.0, 280.0], 300.0, [1, 0, 2]),
        {"model": "c", "error": "open"},
    ]
    lines = sides.summary(rows, PROFILE)
    assert lines[0] == "2 models, 5 ways to lie"
    assert lines[1] == "chosen over the best: mean +0.0500, within 1 %: 0.500, over 5 %: 0.500"
    assert lines[2] == "best way among the first two by forecast: 0.500"
    assert lines[3] == "searches' time: mean 1.50, median 1.50"
    assert lines[4:] == ["a: +0.100", "c: open"]
