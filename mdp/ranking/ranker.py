"""Ranker: a network that says which of the candidate cuts the beam follows, in place of the classic ranking of the 2020 paper.

It scores candidates by an ONNX file, raw features in, scores out. The file names the features that it wants (metadata
`features`); what prepares them is part of its graph. Scores are rounded before they are compared, so that processors that round
otherwise take the same order. A network is offered the shortlist, which takes a tenth of the sweeps of the classic ranking.
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
DECIMALS = 4  # of scores; networks give some 7 digits, and those that differ less are ties that the order offered decides
RANKED_TOGETHER = 50  # candidates, the B of the 2020 paper


class LearnedRanker:
    """A trained ranker. Its file is read when it ranks for the first time, or by `check`."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def check(self) -> None:
        """Raise UserError unless the file holds a ranker."""
        self.scores(np.zeros((2, len(self.columns))))

    def rank(self, offered: Iterable[RankedCandidate]) -> Iterator[RankedCandidate]:
        """The first candidates by their scores, then the others as they come."""
        others = iter(offered)
        first = list(islice(others, RANKED_TOGETHER))
        if len(first) > 1:
            scores = self.scores(self._features(first))
            first = [first[position] for position in np.argsort(-scores, kind="stable")]
        yield from first
        yield from others

    def scores(self, rows: Floats) -> Floats:
        """(n,) rounded scores of (n, len(columns)) features, the best one highest."""
        session = self._session
        try:
            (scores,) = session.run([OUTPUT], {INPUT: rows.astype(np.float32)})
        except Exception as error:  # noqa: BLE001 - onnxruntime's own have no common base
            raise UserError(f"ranker {self.file}: cannot score candidates ({first_line(error)})") from None
        if np.shape(scores) != (len(rows),) or not np.isfinite(scores).all():
            raise UserError(f"ranker {self.file}: gives no number for each of {len(rows)} candidates")
        rounded: Floats = np.asarray(np.round(np.asarray(scores, np.float64), DECIMALS), np.float64)
        return rounded

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """The features that it wants."""
        named = self._session.get_modelmeta().custom_metadata_map.get("features", "")
        columns = tuple(named.split(",")) if named else ()
        unknown = [name for name in columns if name not in FEATURES]
        if not columns or unknown:
            wrong = f"wants the feature {unknown[0]}, which this version does not know" if unknown else "names no features"
            raise UserError(f"ranker {self.file}: {wrong}; train it anew with this version")
        (given,) = self._session.get_inputs()
        if list(given.shape)[1:] != [len(columns)]:
            raise UserError(f"ranker {self.file}: takes {given.shape}, {len(columns)} features a candidate are named")
        return columns

    def _features(self, candidates: Sequence[RankedCandidate]) -> Floats:
        """(n, len(columns)) the features of candidates."""
        rows = np.zeros((len(candidates), len(self.columns)))
        for table in dict.fromkeys(candidate.table for candidate in candidates):
            positions = [position for position, candidate in enumerate(candidates) if candidate.table is table]
            chosen = np.array([candidates[position].row for position in positions], dtype=np.int32)
            rows[positions] = features(table, chosen, self.columns)
        return rows

    @cached_property
    def _session(self) -> "InferenceSession":
        """The file, read; one thread, so that the order does not depend on their number."""
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
            raise UserError(f"ranker {self.file}: cannot be read ({error.strerror})") from None
        except Exception as error:  # noqa: BLE001 - as above
            raise UserError(f"ranker {self.file}: is no ONNX file ({first_line(error)})") from None
        named = ([value.name for value in session.get_inputs()], [value.name for value in session.get_outputs()])
        if named != ([INPUT], [OUTPUT]):
            raise UserError(f"ranker {self.file}: takes {named[0]} and gives {named[1]}; {INPUT} and {OUTPUT} are needed")
        return session


@cache
def ranker_named(name: str) -> LearnedRanker | None:
    """The ranker of a name: None is the classic ranking, `learned` the network that ships, the name of an .onnx file a network of
    one's own. Raises UserError for a name that is none and for a file that holds no ranker."""
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
    """The network that ships."""
    return LearnedRanker(Path(str(files("mdp") / "ranker.onnx")))
