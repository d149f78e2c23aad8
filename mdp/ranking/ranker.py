"""Ranker: a network that ranks the candidate cuts for the beam, in place of the classic ranking of the 2020 paper.

It scores candidates with an ONNX file that maps raw features to scores. The file names its features (metadata `features`); its
graph prepares them. Scores are rounded before they are compared, so that processors with different rounding give the same order.
A network ranks the shortlist, which takes a tenth of the sweeps of the classic ranking.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache, cached_property
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mdp.mesh import Floats
from mdp.ranking import SUFFIX
from mdp.ranking.features import FEATURES, features
from mdp.ranking.ranking import RankedCandidate
from profiles.errors import UserError, first_line
from profiles.messages import option

if TYPE_CHECKING:
    from onnxruntime import InferenceSession

CLASSIC, LEARNED = "classic", "learned"
INPUT, OUTPUT = "features", "scores"
DECIMALS = 4  # digits of scores; networks are accurate to some 7, and scores that differ less keep the given order
RANKED_TOGETHER = 50  # candidates, the B of the 2020 paper


class LearnedRanker:
    """A trained ranker. Its file is loaded at the first ranking, or by `check`."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def check(self) -> None:
        """Raise UserError unless the file holds a ranker."""
        self.scores(np.zeros((2, len(self.columns))))

    def rank(self, offered: Iterable[RankedCandidate]) -> Iterator[RankedCandidate]:
        """The first RANKED_TOGETHER candidates by descending score, then the others in the given order."""
        others = iter(offered)
        first = list(islice(others, RANKED_TOGETHER))
        if len(first) > 1:
            scores = self.scores(self._features(first))
            first = [first[position] for position in np.argsort(-scores, kind="stable")]
        yield from first
        yield from others

    def scores(self, rows: Floats) -> Floats:
        """(n,) rounded scores of (n, len(columns)) features, higher is better."""
        session = self._session
        try:
            (scores,) = session.run([OUTPUT], {INPUT: rows.astype(np.float32)})
        except Exception as error:  # noqa: BLE001 - onnxruntime's exceptions have no common base
            raise UserError(f"ranker {self.file}: cannot score candidates ({first_line(error)})") from None
        if np.shape(scores) != (len(rows),) or not np.isfinite(scores).all():
            raise UserError(f"ranker {self.file} gives no number for each of {len(rows)} candidates")
        rounded: Floats = np.asarray(np.round(np.asarray(scores, np.float64), DECIMALS), np.float64)
        return rounded

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """The names of the features that the network takes."""
        named = self._session.get_modelmeta().custom_metadata_map.get("features", "")
        columns = tuple(named.split(",")) if named else ()
        unknown = [name for name in columns if name not in FEATURES]
        if not columns or unknown:
            wrong = f"wants the feature {unknown[0]}, which this version does not know" if unknown else "names no features"
            raise UserError(f"ranker {self.file}: {wrong}; train it again with this version")
        (given,) = self._session.get_inputs()
        if list(given.shape)[1:] != [len(columns)]:
            raise UserError(f"ranker {self.file} takes {given.shape}, {len(columns)} features a candidate are named")
        return columns

    def _features(self, candidates: Sequence[RankedCandidate]) -> Floats:
        """(n, len(columns)) features of candidates."""
        rows = np.zeros((len(candidates), len(self.columns)))
        for table in dict.fromkeys(candidate.table for candidate in candidates):
            positions = [position for position, candidate in enumerate(candidates) if candidate.table is table]
            chosen = np.array([candidates[position].row for position in positions], dtype=np.int32)
            rows[positions] = features(table, chosen, self.columns)
        return rows

    @cached_property
    def _session(self) -> "InferenceSession":
        """The loaded network; one thread, so that the order does not depend on the number of threads."""
        from onnxruntime import InferenceSession, SessionOptions, set_default_logger_severity

        if not self.file.is_file():
            raise UserError(f"ranker {self.file}: there is no such file")
        set_default_logger_severity(4)
        options: Any = SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4
        try:
            session = InferenceSession(self.file.read_bytes(), options, providers=["CPUExecutionProvider"])
        except OSError as error:
            raise UserError(f"ranker {self.file} cannot be read ({error.strerror})") from None
        except Exception as error:  # noqa: BLE001 - as above
            raise UserError(f"ranker {self.file} is not an ONNX file ({first_line(error)})") from None
        named = ([value.name for value in session.get_inputs()], [value.name for value in session.get_outputs()])
        if named != ([INPUT], [OUTPUT]):
            raise UserError(f"ranker {self.file} takes {named[0]} and gives {named[1]}; {INPUT} and {OUTPUT} are needed")
        return session


@cache
def ranker_named(name: str) -> LearnedRanker | None:
    """The ranker with a name: None for the classic ranking, the shipped network for `learned`, or the network in an .onnx file.
    Raises UserError for an unknown name, and for a file without a ranker.
    """
    if name == CLASSIC:
        return None
    if name == LEARNED:
        return shipped()
    if not name.endswith(SUFFIX):
        raise UserError(f"{option('ranker', name)}: {CLASSIC}, {LEARNED} or the name of an {SUFFIX} file is allowed")
    own = LearnedRanker(Path(name))
    own.check()
    return own


@cache
def shipped() -> LearnedRanker:
    """The network that ships with the program."""
    return LearnedRanker(Path(str(files("mdp") / "ranker.onnx")))
