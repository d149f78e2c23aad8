import io
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mdp.plane import Plane
from mdp.ranking.features import COLUMNS
from mdp.ranking.ranking import Model
from mdp.ranking.record import Offer, Trace, npz

MODEL = Model(risky_mm2=200.0, volume_mm3=1000.0, radius_mm=10.0)


def offer(parent: str, gain_mm2: float, relaxed: int = 0) -> Offer:
    """A horizontal candidate identified by its offset gain_mm2 and its M1, gain_mm2 / 200."""
    row = np.arange(len(COLUMNS)) / 100.0
    row[0] = gain_mm2 / 200
    return Offer(parent, Plane(np.array([0.0, 0.0, 1.0]), gain_mm2), row, relaxed)


def trace() -> Trace:
    """Model -> a (100), b (120), c (90, dropped); a -> d (20) and e (60); b -> the twin of d."""
    search = Trace("figure.stl", MODEL, "model")
    search.begin_stage(["model"])
    first = [(0, "a", 100.0), (2, "b", 120.0), (3, "c", 90.0)]
    search.add([offer("model", gain) for gain in (10, 11, 12, 13)], first)
    search.begin_stage(["a", "b"])
    second = [(0, "d", 20.0), (1, "e", 60.0), (2, "d", 20.0)]
    search.add([offer("a", 5), offer("a", 6, 1), offer("b", 7, 2)], second)
    return search


def read(content: bytes) -> dict[str, NDArray[Any]]:
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        return dict(file)


def test_every_candidate_has_its_row_cut_or_not() -> None:
    record = read(trace().to_bytes())
    assert record["stage"].tolist() == [1, 1, 1, 1, 2, 2, 2]
    assert record["offset_mm"].tolist() == [10, 11, 12, 13, 5, 6, 7]
    assert record["round"].tolist() == [0, 0, 0, 0, 0, 1, 2]
    assert record["parent"].tolist() == [0, 0, 0, 0, 1, 1, 2]
    assert record["child"].tolist() == [1, -1, 2, 3, 4, 5, 4]
    assert record["normal"].tolist() == [[0, 0, 1]] * 7


def test_the_features_are_those_of_the_search() -> None:
    record = trace().arrays()
    assert record["features"][0, :3].tolist() == [0.05, 0.01, 0.02]
    assert record["columns"].tolist() == list(COLUMNS)
    assert record["columns"][:6].tolist() == ["M1", "M2", "M3", "M4", "M5", "M6"]


def test_a_candidate_carries_the_features_of_the_cut_that_made_its_parent() -> None:
    record = trace().arrays()
    assert np.isnan(record["parent_features"][:4]).all()
    assert record["parent_features"][4:, 0].tolist() == [10 / 200, 10 / 200, 12 / 200]


def test_a_twin_is_not_chosen_but_leads_to_the_same_node() -> None:
    record = trace().arrays()
    assert record["chosen"].tolist() == [True, False, True, True, True, True, False]
    assert record["child"][4] == record["child"][6]
    assert len(record["node_cost"]) == 6


def test_an_outcome_is_the_least_cost_through_a_node_stopping_there_included() -> None:
    model, a, b, c, d, e = trace().outcomes()
    assert (d, e, c) == (20 / 200, 60 / 200, 90 / 200)
    assert (model, a, b) == (20 / 200, 20 / 200, 20 / 200)


def test_a_worse_child_does_not_make_its_parent_worse() -> None:
    search = Trace("m", MODEL, "model")
    search.begin_stage(["model"])
    search.add([offer("model", 1)], [(0, "a", 50.0)])
    search.begin_stage(["a"])
    search.add([offer("a", 2)], [(0, "b", 80.0)])
    assert search.outcomes().tolist() == [0.25, 0.25, 0.4]


def test_a_twin_of_an_earlier_stage_passes_its_outcome_on() -> None:
    search = Trace("m", MODEL, "model")
    search.begin_stage(["model"])
    search.add([offer("model", 1), offer("model", 2)], [(0, "a", 50.0), (1, "b", 90.0)])
    search.begin_stage(["a", "b"])
    search.add([offer("b", 3), offer("a", 4)], [(0, "a", 50.0), (1, "c", 10.0)])
    assert search.outcomes().tolist() == [0.05, 0.05, 0.05, 0.05]


def test_the_outcome_of_a_candidate_is_that_of_its_child() -> None:
    outcome = trace().arrays()["outcome"]
    assert outcome[[0, 2, 3, 4, 5, 6]] == pytest.approx([0.1, 0.1, 0.45, 0.1, 0.3, 0.1])
    assert np.isnan(outcome[1])


def test_a_node_dropped_by_the_beam_is_marked() -> None:
    record = trace().arrays()
    assert record["node_expanded"].tolist() == [True, True, True, False, False, False]
    assert record["node_stage"].tolist() == [0, 1, 1, 1, 2, 2]
    assert record["node_parent"].tolist() == [-1, 0, 0, 0, 1, 1]


def test_a_node_added_twice_in_a_stage_is_one_row() -> None:
    search = Trace("m", MODEL, "model")
    search.begin_stage(["model"])
    search.add([offer("model", 1), offer("model", 2)], [(0, "a", 50.0)])
    search.add([offer("model", 2), offer("model", 1), offer("model", 3)], [(1, "a", 50.0), (0, "b", 60.0)])
    record = search.arrays()
    assert record["offset_mm"].tolist() == [1, 2, 3]
    assert (record["chosen"].tolist(), record["child"].tolist()) == ([True, True, False], [1, 2, -1])


def test_a_duplicate_whose_signature_rounds_differently_is_the_same_node() -> None:
    search = Trace("m", MODEL, "model")
    search.begin_stage(["model"])
    search.add([offer("model", 1)], [(0, "a", 50.0), (0, "a rounded", 50.0)])
    search.begin_stage(["a", "a rounded"])
    search.add([offer("a rounded", 2)], [(0, "b", 10.0)])
    assert search.arrays()["parent"].tolist() == [0, 1]
    assert search.outcomes().tolist() == [0.05, 0.05, 0.05]


def test_the_same_search_gives_the_same_bytes() -> None:
    assert trace().to_bytes() == trace().to_bytes()


def test_a_search_without_a_stage_has_its_columns_too() -> None:
    record = read(Trace("flat.stl", Model(0.0, 1000.0, 10.0), "model").to_bytes())
    assert set(record) == set(read(trace().to_bytes()))
    assert record["features"].shape == (0, len(COLUMNS))
    assert (record["node_outcome"].tolist(), str(record["model"])) == ([0.0], "flat.stl")


def test_npz_carries_names_shapes_and_types_in_order() -> None:
    arrays = {"a": np.arange(6, dtype=np.int32).reshape(2, 3).T, "b": np.array(1.5), "c": np.array(["M1", "M2"])}
    again = read(npz(arrays))
    assert list(again) == ["a", "b", "c"]
    assert all(np.array_equal(again[key], value) and again[key].dtype == value.dtype for key, value in arrays.items())
