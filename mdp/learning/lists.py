"""Lists: the candidates that competed in one stage of a recorded search, with their outcomes, ratings and regrets.

Record files are those of `mdp.ranking.record`, or any with the same `version`, `model`, `columns`, `features`, `stage` and
`outcome`; the optional `child` and `node_expanded` mark the candidates that the search did not pursue.

The value of a candidate is the least final cost through it, stopping there included. The paper rates the five best candidates of
a list 5, 4, 3, 2, 1 and the rest 0; its lists are what the beam kept, so candidates that were never cut are not in them. For
regrets, candidates that were not pursued are left out as well: all that is known about them is that stopping there is worse.

A model's source determines whether it trains a ranker, stops the training, or tests the result. Models of one repository and
folder are often variants of one object, so a source is always on one side. The side is a hash of the source's name: it does not
depend on other models, so adding models moves none.
"""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from mdp.mesh import Floats, Ints
from mdp.ranking.features import PAPER_COLUMNS
from mdp.ranking.record import VERSION, Arrays
from profiles.errors import UserError

NEEDED = ("model", "columns", "features", "stage", "outcome")
BEST = 5  # rated candidates per list
TIE = 1e-9  # outcomes (shares) that differ less are equal
SMALLEST_RANGE = 1e-8  # added to the range, which is 0 if all values of a list are equal
LEAST_OUTCOME = 0.05  # lower outcomes count as this one, otherwise the best models would weigh most
COLUMNS_NEEDED = ("id", "source_repo", "source_path")
TRAIN_SHARE, VALIDATION_SHARE = 0.60, 0.15  # shares of the sources, as in the 2020 paper; the rest tests
FOLDS = 4  # splits with disjoint test sets, which together hold every model

Singles = NDArray[np.float32]
Mask = NDArray[np.bool_]


class Side(StrEnum):
    """The use of a source's lists."""

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
    """A number from 0 to 1 that depends only on the name (a hash)."""
    return int.from_bytes(sha256(name.encode()).digest()[:8], "big") / 2**64


def model_id(file: Path) -> str:
    """The model of a record file MODEL.ORIENTATION.TERMS.npz."""
    return file.name.split(".")[0]


@dataclass(frozen=True, eq=False)
class RatedList:
    """The n cut candidates of one stage of a recorded search, in the classic order.

    features: (n, F) unscaled, in single precision as a ranker gets them, named in `columns`; outcome: (n,) least final cost
    through the candidate as a share of the model's risky area; censored: (n,) whether the outcome is the candidate's own cost,
    because the search did not pursue it; record: name of the list's file without suffix; a model has one for each orientation and
    terms.
    """

    features: Singles
    columns: tuple[str, ...]
    outcome: Floats
    censored: Mask
    model: str
    source: str
    record: str

    @cached_property
    def ratings(self) -> Ints:
        """(n,) ratings: 5 for the least outcome down to 1 for the fifth, 0 for the rest; ties keep their order."""
        rated = np.zeros(len(self.outcome), np.int32)
        best = np.argsort(self.outcome, kind="stable")[:BEST]
        rated[best] = BEST - np.arange(len(best))
        return rated

    @property
    def regrets(self) -> Floats:
        """(n,) regrets: how much more each candidate ends with than the best of the list, as a share of the best."""
        least = float(self.outcome.min())
        shares: Floats = (self.outcome - least) / max(least, LEAST_OUTCOME)
        return shares

    @property
    def teaches(self) -> bool:
        """Whether the list has an order to learn: a list of one candidate has none."""
        return len(self.outcome) > 1

    def table(self, columns: Sequence[str]) -> Singles:
        """(n, k) columns of the named features."""
        return self.features[:, [self.columns.index(name) for name in columns]]


def read_lists(
    folder: Path, manifest: Path | None = None, columns: Sequence[str] = PAPER_COLUMNS, terms: Sequence[str] = ()
) -> list[RatedList]:
    """The lists of a folder's record files, by file name and stage; a model's source comes from the manifest, or else is the
    model. terms: only lists of searches on one of these terms, MODEL.ORIENTATION.TERMS.npz.

    Raises UserError for a folder without records for one of the terms, and for a record of another version, without one of the
    columns, of a model that is not in the manifest, or with a feature that is not finite.
    """
    known, files = list(folder.glob("*.npz")), set[Path]()
    for ending in [f".{name}.npz" for name in terms] or [".npz"]:
        some = [file for file in known if file.name.endswith(ending)]
        if not some:
            raise UserError(f"folder {folder} holds no record (*{ending}); python -m mdp.learning.collect makes them")
        files.update(some)
    sources = None if manifest is None else read_sources(manifest)
    lists: list[RatedList] = []
    for file in sorted(files):
        source = model_id(file) if sources is None else sources.get(model_id(file))
        if source is None:
            raise UserError(f"record {file}: its model {model_id(file)} is not in {manifest}")
        lists += _lists(read_record(file, columns), file, source, columns)
    return lists


def read_record(file: Path, columns: Sequence[str] = PAPER_COLUMNS) -> Arrays:
    """The arrays of a record file for training; raises UserError like `read_lists`."""
    try:
        with np.load(file, allow_pickle=False) as archive:
            arrays: Arrays = dict(archive)
    except (OSError, ValueError, BadZipFile, EOFError) as error:
        raise UserError(f"record {file} cannot be read ({error})") from None
    version = int(arrays["version"]) if "version" in arrays else 1
    if version != VERSION:
        raise UserError(f"record {file} is of version {version}, only {VERSION} is understood; record the search again")
    _check(file, arrays, columns)
    return arrays


def _check(file: Path, arrays: Arrays, columns: Sequence[str]) -> None:
    missing = [name for name in NEEDED if name not in arrays]
    if missing:
        raise UserError(f"record {file} holds no {', '.join(missing)}")
    absent = [name for name in columns if name not in arrays["columns"]]
    if absent:
        raise UserError(f"record {file} has no feature {', '.join(absent)}; it has {', '.join(arrays['columns'])}")
    rows = len(arrays["stage"])
    if arrays["features"].shape != (rows, len(arrays["columns"])) or arrays["outcome"].shape != (rows,):
        raise UserError(f"record {file}: its features, stages and outcomes differ in length")
    unusable = ~np.isfinite(arrays["features"])
    if unusable.any():
        row, column = np.argwhere(unusable)[0]
        name, value = arrays["columns"][column], arrays["features"][row, column]
        raise UserError(f"record {file}: feature {name} of a candidate of model {arrays['model']} is {value}")


def _lists(record: Arrays, file: Path, source: str, columns: Sequence[str]) -> Iterator[RatedList]:
    names = record["columns"].tolist()
    features = record["features"][:, [names.index(name) for name in columns]].astype(np.float32)
    cut, censored = ~np.isnan(record["outcome"]), _censored(record)
    for stage in np.unique(record["stage"][cut]):
        rows = cut & (record["stage"] == stage)
        yield RatedList(
            features[rows], tuple(columns), record["outcome"][rows], censored[rows], model_id(file), source, file.stem
        )


def _censored(record: Arrays) -> Mask:
    if "node_expanded" not in record or "child" not in record:
        return np.zeros(len(record["stage"]), np.bool_)
    cut = record["child"] >= 0
    followed = record["node_expanded"].astype(np.bool_)
    if "parent" in record:  # an expanded node without any cut is no more informative than one that was not expanded
        followed &= np.isin(np.arange(len(followed)), record["parent"][cut])
    censored: Mask = cut.copy()
    censored[cut] = ~followed[record["child"][cut]]
    return censored


def of_side(lists: Sequence[RatedList], wanted: Side, fold: int = 0) -> list[RatedList]:
    """The lists whose source is on one side of a split."""
    return [recorded for recorded in lists if side(recorded.source, fold) is wanted]


def of_some_models(lists: Sequence[RatedList], share: float) -> list[RatedList]:
    """The lists of a share of the models; a smaller share is a subset of a larger one."""
    return [recorded for recorded in lists if place(f"share of {recorded.model}") < share]


def followed(lists: Sequence[RatedList]) -> list[RatedList]:
    """The lists without the candidates that the search did not pursue, unless they are the best of their list."""
    shorter = []
    for rated in lists:
        rows = ~rated.censored | (rated.outcome <= np.min(rated.outcome) + TIE)
        table, outcome, censored = rated.features[rows], rated.outcome[rows], rated.censored[rows]
        shorter.append(replace(rated, features=table, outcome=outcome, censored=censored))
    return shorter


def scale(features: Singles) -> Singles:
    """(n, F) features scaled to 0 to 1 over their list; a constant column becomes 0."""
    low, high = features.min(axis=0), features.max(axis=0)
    scaled: Singles = (features - low) / (high - low + np.float32(SMALLEST_RANGE))
    return scaled


def read_sources(manifest: Path) -> dict[str, str]:
    """The source of each model, its repository and folder, from a table with the columns id, source_repo and source_path.

    Raises UserError for any other file.
    """
    try:
        with manifest.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UserError(f"manifest {manifest} cannot be read ({error})") from None
    missing = [name for name in COLUMNS_NEEDED if not rows or not rows[0].get(name)]
    if missing:
        raise UserError(f"manifest {manifest} has no column {', '.join(missing)}; {', '.join(COLUMNS_NEEDED)} are needed")
    return {row["id"]: f"{row['source_repo']}/{row['source_path'].rpartition('/')[0]}" for row in rows}
