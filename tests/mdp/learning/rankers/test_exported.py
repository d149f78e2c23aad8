from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")
onnx = pytest.importorskip("onnx", reason="the extra `train` is not installed")

from mdp.learning.rankers.export import Graph, export, write
from mdp.learning.rankers.exported import read_ranker
from mdp.learning.rankers.urank import Network, scores
from mdp.ranking.features import PAPER_COLUMNS
from profiles.errors import LearningError
from tests.mdp.learning.records import drawn_list

pytestmark = pytest.mark.train


def test_a_ranker_read_back_scores_as_the_network_did(tmp_path: Path) -> None:
    network, rated = Network(3), drawn_list(2, 9)
    columns = ("M6", "M2", "M1")
    write(tmp_path / "a.onnx", export(network.weights(), columns, {"kind": "urank"}))
    ranker = read_ranker(tmp_path / "a.onnx")
    assert (ranker.columns, ranker.kind) == (columns, "urank")
    assert np.abs(ranker.scores(rated) - scores(network, columns)(rated)).max() < 1e-5


def test_what_is_no_ranker_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.onnx"
    with pytest.raises(LearningError, match="cannot be read"):
        read_ranker(file)
    file.write_bytes(b"no graph")
    with pytest.raises(LearningError, match="is no ONNX file"):
        read_ranker(file)
    graph = Graph()
    content = graph.model(PAPER_COLUMNS, graph.add("ReduceMax", "features", axes=[1], keepdims=0), {})
    bare = onnx.load_model_from_string(content)
    del bare.metadata_props[:]
    file.write_bytes(bare.SerializeToString())
    with pytest.raises(LearningError, match="is an ONNX file of something else"):
        read_ranker(file)
