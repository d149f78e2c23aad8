"""Sources: where a model comes from, and whether it trains a ranker, stops the training, or judges the result.

Models of one repository and folder are often variants of one thing, so a source is never on two sides. The side is a hash of the
source's name: it depends on no other model, so a set that grows moves none.
"""

import csv
from enum import StrEnum
from hashlib import sha256
from pathlib import Path

from profiles.errors import UserError

NEEDED = ("id", "source_repo", "source_path")
TRAIN_SHARE, VALIDATION_SHARE = 0.60, 0.15  # of the sources, as in the 2020 paper; the rest judges
FOLDS = 4  # splits whose test sets are disjoint and together hold every model


class Side(StrEnum):
    """What the lists of a source are for."""

    TRAIN = "train"
    VALIDATION = "validation"
    TEST = "test"


def side(source: str, fold: int = 0) -> Side:
    """The side of a source in one of the FOLDS splits; it is in the test set of exactly one of them."""
    share = (place(source) + fold / FOLDS) % 1.0
    if share < TRAIN_SHARE:
        return Side.TRAIN
    return Side.VALIDATION if share < TRAIN_SHARE + VALIDATION_SHARE else Side.TEST


def place(name: str) -> float:
    """A number from 0 to 1 that depends on nothing but the name."""
    return int.from_bytes(sha256(name.encode()).digest()[:8], "big") / 2**64


def model_id(file: Path) -> str:
    """The model of a record file, which is named MODEL.ORIENTATION.TERMS.npz."""
    return file.name.split(".")[0]


def read_sources(manifest: Path) -> dict[str, str]:
    """Model -> its repository and folder, of a table with the columns id, source_repo and source_path.

    Raises UserError for a file that is no such table.
    """
    try:
        with manifest.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UserError(f"manifest {manifest}: cannot be read ({error})") from None
    missing = [name for name in NEEDED if not rows or not rows[0].get(name)]
    if missing:
        raise UserError(f"manifest {manifest}: has no column {', '.join(missing)}; {', '.join(NEEDED)} are needed")
    return {row["id"]: f"{row['source_repo']}/{row['source_path'].rpartition('/')[0]}" for row in rows}
