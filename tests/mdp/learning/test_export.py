from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")
onnx = pytest.importorskip("onnx", reason="the extra `train` is not installed")
onnxruntime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

from mdp.learning.export import export, write
from mdp.learning.urank import Network, scores
from mdp.ranking.features import PAPER_COLUMNS
from profiles.errors import LearningError
from tests.mdp.learning.records import drawn_list

pytestmark = pytest.mark.train

METADATA = {"kind": "urank", "data_set": "drawn, 3 lists", "commit": "abc", "figures": "NDCG@1 .4"}


@pytest.mark.parametrize("size", [1, 2, 3, 50])
def test_the_graph_scores_as_the_network_does(size: int) -> None:
    network = Network(6, seed=3)
    session = onnxruntime.InferenceSession(export(network.weights(), PAPER_COLUMNS, METADATA))
    for seed in range(20):
        rated = drawn_list(seed, size)
        (given,) = session.run(["scores"], {"features": rated.features})
        assert given.shape == (size,)
        assert np.abs(given - scores(network, PAPER_COLUMNS)(rated)).max() < 1e-5


def test_a_feature_that_is_the_same_for_all_candidates_changes_nothing() -> None:
    session = onnxruntime.InferenceSession(export(Network(6).weights(), PAPER_COLUMNS, METADATA))
    quarter = drawn_list(1, 10).features
    quarter[:, 2] = 0.25
    three_quarters = quarter.copy()
    three_quarters[:, 2] = 0.75
    assert session.run(None, {"features": quarter})[0].tolist() == session.run(None, {"features": three_quarters})[0].tolist()


def test_the_file_says_what_it_is(tmp_path: Path) -> None:
    file = tmp_path / "ranker.onnx"
    write(file, export(Network(6).weights(), PAPER_COLUMNS, METADATA))
    model = onnx.load(file)
    assert {entry.key: entry.value for entry in model.metadata_props} == {"features": "M1,M2,M3,M4,M5,M6", **METADATA}
    assert 43_000 < file.stat().st_size < 46_000
    assert [path.name for path in tmp_path.iterdir()] == ["ranker.onnx"]


def test_a_file_that_cannot_be_written_is_told_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(LearningError, match="cannot be written"):
        write(tmp_path / "nowhere" / "ranker.onnx", b"")
