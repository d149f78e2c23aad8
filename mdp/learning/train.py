"""Train: the paper's ranker from a folder of records.

    python -m mdp.learning.train FOLDER -o RANKER.onnx [--manifest CSV] [--terms paper] [--loss urank|ranknet] [--epochs N] ...

The lists of the training side teach, those of the validation side say when to stop, those of the test side are only counted in
the file's figures. An interrupted training goes on from RANKER.onnx.checkpoint when it is started again.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mdp.learning.command import Parser, check_range, commit, run
from mdp.learning.labels import RatedList, rate
from mdp.learning.lists import of_side, read_lists
from mdp.learning.ndcg import at, full_lists
from mdp.learning.sources import Side
from mdp.ranking.features import PAPER_COLUMNS

if TYPE_CHECKING:
    from mdp.learning.ndcg import Scores
    from mdp.learning.rankers.training import Epoch

CUTS = (1, 2, 3, 4, 5)


def main(arguments: Sequence[str] | None = None) -> int:
    """Train and write the ranker; the exit code."""
    return run(train, arguments, "started again, the training goes on where it stopped")


def train(arguments: Sequence[str] | None) -> None:
    """Train, write the ranker, say what it is worth on the lists that it never saw."""
    options = _options(arguments)
    from mdp.learning.rankers import training, urank
    from mdp.learning.rankers.export import export, write

    lists = read_lists(options.folder, options.manifest, terms=options.terms)
    teach, stop, judge = (rate(of_side(lists, side), PAPER_COLUMNS) for side in (Side.TRAIN, Side.VALIDATION, Side.TEST))
    schedule = training.Schedule(options.loss, options.epochs, options.patience, options.batch, options.rate, seed=options.seed)
    network = urank.Network(len(PAPER_COLUMNS), seed=options.seed)
    checkpoint = options.output.with_name(f"{options.output.name}.checkpoint")
    training.train(network, PAPER_COLUMNS, (teach, stop), schedule, checkpoint, show)
    if sys.stderr.isatty():
        sys.stderr.write("\n")
    figures = judged(urank.scores(network, PAPER_COLUMNS), [one for one in judge if one.teaches])
    about = {
        "kind": options.loss,
        "data_set": f"{options.folder.resolve().name}: {len(teach)} lists of {len({one.model for one in teach})} models",
        "commit": commit(),
        "figures": json.dumps(figures),
    }
    write(options.output, export(network.weights(), PAPER_COLUMNS, about))
    checkpoint.unlink(missing_ok=True)
    sys.stdout.write("\n".join(f"{name}: {value}" for name, value in {**about, "written": options.output}.items()) + "\n")


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = Parser(prog="python -m mdp.learning.train", description="train the paper's ranker on records of wide searches")
    parser.add_argument("folder", type=Path, help="of record files, MODEL.ORIENTATION.TERMS.npz")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.onnx")
    parser.add_argument(
        "--manifest", type=Path, metavar="CSV", help="id, source_repo, source_path of the models: split by source"
    )
    parser.add_argument("--terms", metavar="NAME", help="only records of searches on these terms; all by default")
    parser.add_argument("--loss", choices=("urank", "ranknet"), default="urank")
    parser.add_argument("--epochs", type=int, default=1000, metavar="N", help="at most so many")
    parser.add_argument("--patience", type=int, default=50, metavar="N", help="epochs without a gain after which it ends")
    parser.add_argument("--batch", type=int, default=8, metavar="N", help="lists a step; the paper takes 1")
    parser.add_argument("--rate", type=float, default=1e-4, metavar="R", help="learning rate of Adam")
    parser.add_argument("--seed", type=int, default=0, metavar="N")
    options = parser.parse_args(arguments)
    for name, least, most in (("epochs", 1, 1e6), ("patience", 1, 1e6), ("batch", 1, 1e5), ("rate", 0.0, 10.0), ("seed", 0, 1e9)):
        check_range(options, name, least, most)
    return options


def show(epoch: "Epoch") -> None:
    """An epoch as a line that the next one replaces on a terminal."""
    figures = " ".join(f"{value:.4f}" for value in epoch.validation)
    line = f"epoch {epoch.number}: loss {epoch.loss:.3f}, validation NDCG@1,3,5 {figures}, best epoch {epoch.best}"
    sys.stderr.write(f"\r\x1b[K{line}" if sys.stderr.isatty() else f"{line}\n")
    sys.stderr.flush()


def judged(scores: "Scores", lists: Sequence[RatedList]) -> dict[str, float | int]:
    """Counts and mean NDCG on all and on full lists, with four digits."""
    figures: dict[str, float | int] = {"lists": len(lists)}
    for name, some in (("NDCG", lists), ("full NDCG", full_lists(lists))):
        for cut in CUTS if some else ():
            figures[f"{name}@{cut}"] = round(sum(at(cut)(scores(one), one) for one in some) / len(some), 4)
    return figures


if __name__ == "__main__":
    sys.exit(main())
