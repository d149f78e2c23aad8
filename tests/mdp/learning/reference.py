"""The labels and scores that the authors published for their 1,248 test lists."""

from pathlib import Path

import numpy as np
import pytest

from mdp.mesh import Floats, Ints

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "reference" / "urank"


def reference_lists() -> list[tuple[Floats, Ints]]:
    """Scores and ratings of every list; skips the test if the files are missing."""
    if not FOLDER.is_dir():
        pytest.skip("the published scores are not here")
    lines = [line.split() for line in (FOLDER / "label_output").read_text().splitlines()]
    labels = np.array([int(line[0]) for line in lines], np.int32)
    query = np.array([int(line[1].removeprefix("qid:")) for line in lines])
    scores = np.loadtxt(FOLDER / "prediction_output")
    return [(scores[query == number], labels[query == number]) for number in np.unique(query)]
