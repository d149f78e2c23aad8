"""Exported: a ranker's ONNX file read back to be judged, by ONNX's own reference: slow, and a witness beside the search's."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnx
from onnx.reference import ReferenceEvaluator

from mdp.learning.labels import RatedList
from mdp.learning.ndcg import Scores
from mdp.mesh import Floats
from mdp.ranking.network import INPUT, OUTPUT
from profiles.errors import LearningError, first_line


@dataclass(frozen=True)
class Exported:
    """The columns that a ranker wants, in its order, what it calls itself, and its scores."""

    columns: tuple[str, ...]
    kind: str
    scores: Scores


def read_ranker(file: Path) -> Exported:
    """A ranker from its file; LearningError for a file that is none."""
    try:
        model = onnx.load_model_from_string(file.read_bytes())
        onnx.checker.check_model(model)
        graph = ReferenceEvaluator(model)
    except OSError as error:
        raise LearningError(f"ranker {file}: cannot be read ({error.strerror})") from None
    except Exception as error:  # noqa: BLE001 - onnx and protobuf have errors of many kinds
        raise LearningError(f"ranker {file}: is no ONNX file ({first_line(error)})") from None
    about = {entry.key: entry.value for entry in model.metadata_props}
    if "features" not in about or [entry.name for entry in model.graph.input] != [INPUT] or OUTPUT not in graph.output_names:
        raise LearningError(f"ranker {file}: is an ONNX file of something else; input {INPUT!r}, output {OUTPUT!r} are needed")
    columns = tuple(about["features"].split(","))

    def scores(rated: RatedList) -> Floats:
        (given,) = graph.run([OUTPUT], {INPUT: rated.table(columns)})
        return np.asarray(given, dtype=np.float64)

    return Exported(columns, about.get("kind", file.stem), scores)
