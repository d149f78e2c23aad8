"""Train: a ranker from a folder of records, with the paper's loss or with expected regret as the loss.

    python -m mdp.learning.train FOLDER -o RANKER.onnx [--manifest CSV] [--loss urank|regret] [--terms NAME,...] ...

The training lists fit the ranker, the validation lists stop the training, and the test lists only give the figures in the file.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from mdp.learning.command import COLUMN_SETS, Parser, add_records, check_range, commit, run
from mdp.learning.lists import RatedList, Side, followed, of_side, of_some_models, read_lists
from mdp.learning.ndcg import NDCGS, Scores, as_searched
from profiles.errors import UserError

if TYPE_CHECKING:
    from mdp.learning.networks import Network

Sides = tuple[Sequence[RatedList], Sequence[RatedList]]  # for training and for validation
MOST_NETWORKS = 12  # in an ensemble; with --loss regret its file stays below 200 kB
LOSSES = {"urank": "paper", "regret": "cheap"}  # and the default columns of each
OWN = ("epochs", "patience", "batch", "rate")  # settings of the schedule; each loss has its own defaults


def main(arguments: Sequence[str] | None = None) -> int:
    """Train and write the ranker; returns the exit code."""
    return run(train, arguments, "nothing was written")


def train(arguments: Sequence[str] | None) -> None:
    """Train and write the ranker, then report its figures on the test lists."""
    options = _options(arguments)
    from mdp.learning.networks import export, scores, write

    columns = COLUMN_SETS[options.columns or LOSSES[options.loss]]
    lists = read_lists(options.folder, options.manifest, columns, options.terms)
    judge = of_side(lists, Side.TEST, options.fold)
    if options.loss == "regret":
        lists = followed(lists)
    teach = of_some_models(of_side(lists, Side.TRAIN, options.fold), options.share)
    stop = of_side(lists, Side.VALIDATION, options.fold)
    networks = _trained(options, columns, (teach, stop))
    about = {
        "kind": options.loss,
        "data_set": f"{options.folder.resolve().name}: {counts(teach)}",
        "commit": commit(),
        "split": f"fold {options.fold}, share {options.share:g}, seed {options.seed}",
        "figures": json.dumps(judged(as_searched(scores(networks, columns)), [rated for rated in judge if rated.teaches])),
    }
    write(options.output, export(networks, columns, about))
    sys.stdout.write("\n".join(f"{name}: {value}" for name, value in {**about, "written": options.output}.items()) + "\n")


def _trained(options: argparse.Namespace, columns: Sequence[str], lists: Sides) -> list["Network"]:
    """The trained networks of a ranker, each with the schedule of its loss and the options that override it; progress is
    shown.
    """
    from mdp.learning.networks import NETWORKS
    from mdp.learning.training import OBJECTIVES, SCHEDULES, train

    given = {name: getattr(options, name) for name in OWN if getattr(options, name) is not None}
    show = partial(_show, OBJECTIVES[options.loss].measures)
    networks = []
    for seed in range(options.seed, options.seed + options.ensemble):
        network = NETWORKS[options.loss](columns, seed=seed)
        train(network, columns, lists, replace(SCHEDULES[options.loss], **given, seed=seed), show)
        networks.append(network)
        if sys.stderr.isatty():
            sys.stderr.write("\n")
    return networks


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = Parser(prog="python -m mdp.learning.train", description="train a ranker on records of wide searches")
    add_records(parser, "to learn from; default paper, cheap with --loss regret")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.onnx")
    parser.add_argument("--loss", choices=LOSSES, default="urank", help="of the paper (urank), or the regret to expect")
    parser.add_argument("--ensemble", type=int, default=1, metavar="N", help="average N networks")
    parser.add_argument("--epochs", type=int, metavar="N", help="the most epochs; default 1000, 100 with --loss regret")
    parser.add_argument("--patience", type=int, metavar="N", help="epochs without a gain after which it ends; default 50, 25")
    parser.add_argument("--batch", type=int, metavar="N", help="lists a step; default 8, 64; the paper takes 1")
    parser.add_argument("--rate", type=float, metavar="R", help="learning rate of Adam; default 1e-4, 2e-3")
    parser.add_argument("--seed", type=int, default=0, metavar="N")
    parser.add_argument("--share", type=float, default=1.0, metavar="S", help="share of the training models that is used")
    options = parser.parse_args(arguments)
    for name, most in {"epochs": 1e6, "patience": 1e6, "batch": 1e5, "ensemble": MOST_NETWORKS}.items():
        check_range(options, name, 1, most)
    for name, least, most in (("rate", 1e-9, 10.0), ("seed", 0, 1e9), ("share", 0.01, 1.0)):
        check_range(options, name, least, most)
    if options.output.is_dir() or not options.output.parent.is_dir():
        raise UserError(f"ranker {options.output} cannot be written; a file in a folder that exists is needed")
    return options


def _show(measures: Sequence[str], number: int, loss: float, validation: Sequence[float], best: int) -> None:
    """Show an epoch as a line that the next one replaces on a terminal."""
    figures = ", ".join(f"{name} {value:.4f}" for name, value in zip(measures, validation, strict=True))
    line = f"epoch {number}: loss {loss:.3f}, validation {figures}, best epoch {best}"
    sys.stderr.write(f"\r\x1b[K{line}" if sys.stderr.isatty() else f"{line}\n")
    sys.stderr.flush()


def counts(lists: Sequence[RatedList]) -> str:
    """The numbers of records, lists and models, in words."""
    records, models = len({rated.record for rated in lists}), len({rated.model for rated in lists})
    return f"{records} records, {len(lists)} lists, {models} models"


def judged(scores: Scores, lists: Sequence[RatedList]) -> dict[str, float | int]:
    """The number of lists, and the mean NDCG over them to four digits."""
    sums = {name: sum(measure(scores(rated), rated) for rated in lists) for name, measure in NDCGS.items() if lists}
    return {"lists": len(lists), **{name: round(total / len(lists), 4) for name, total in sums.items()}}


if __name__ == "__main__":
    sys.exit(main())
