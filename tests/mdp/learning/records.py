"""Synthetic records and lists."""

from pathlib import Path
from typing import Any

import numpy as np

from mdp.learning.lists import RatedList
from mdp.learning.ndcg import Scores
from mdp.mesh import Floats
from mdp.ranking.features import PAPER_COLUMNS
from mdp.ranking.record import VERSION, npz


def write_record(file: Path, outcome: Floats, stage: Floats | None = None, **others: Any) -> None:
    """A record of n candidates with features seeded by the file's name; others: arrays that replace its own."""
    rng = np.random.default_rng(list(file.name.encode()))
    arrays = {
        "version": np.array(VERSION),
        "model": np.array(file.stem),
        "columns": np.array(PAPER_COLUMNS),
        "features": rng.random((len(outcome), len(PAPER_COLUMNS))),
        "stage": np.ones(len(outcome), np.int32) if stage is None else stage,
        "outcome": outcome,
    }
    file.write_bytes(npz(arrays | others))


def drawn_list(seed: int, size: int) -> RatedList:
    """A list whose candidates end better with larger M2 and smaller M6, with a little noise."""
    rng = np.random.default_rng(seed)
    features = rng.random((size, len(PAPER_COLUMNS))).astype(np.float32)
    outcome = 1.0 - features[:, 1].astype(np.float64) + 0.5 * features[:, 5] + 0.05 * rng.random(size)
    return RatedList(features, PAPER_COLUMNS, outcome, np.zeros(size, np.bool_), f"m{seed % 7}", "", "")


def by_column(name: str) -> Scores:
    """Scores that equal one feature."""
    return lambda rated: rated.table((name,))[:, 0].astype(np.float64)
