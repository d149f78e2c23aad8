"""Repeat the experiment of the 2020 paper: collect, train, search, and print the tables.

    python tools/campaigns/learning.py MODELS --manifest FILE.csv --out FOLDER [--only-tables]

MODELS holds models as npz (vertices in mm and faces); the manifest names their sources. Four splits by source: every model is
judged by rankers that saw no model of its source. Existing files in FOLDER are kept, so that an interrupted run resumes. Some 10
core-hours for 615 models.
"""

import argparse
import subprocess
import sys
from itertools import product
from pathlib import Path

from mdp.learning.lists import FOLDS

ROOT = Path(__file__).resolve().parents[2]
PLAIN, LEARNED = "1,2,5,10,20,50", "1,2,5"  # widths
LEAST_REMOVED = 0.05  # of the risky area, by the widest plain beam: on other models all widths give the same result
RANKERS = {  # and their training options
    "urank": ("--loss", "urank", "--patience", "200"),
    "regret": ("--loss", "regret", "--ensemble", "6", "--columns", "paper"),
    "regret_cheap": ("--loss", "regret", "--ensemble", "6"),
}
COLLECTED = ("--terms", "paper", "--beam-width", "50", "--orientations", "4", "--faces", "2500", "--time-limit", "60")
SEARCHES = ("--methods", "published", "--paper-terms", "--faces", "2500", "--set", "search.time_limit_s=120")


def main() -> None:
    """Make what is missing, then print the tables and draw the figures of the paper."""
    parser = argparse.ArgumentParser(description="repeat the experiment of the 2020 paper")
    parser.add_argument("models", type=Path)
    parser.add_argument("--manifest", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only-tables", action="store_true", help="of what is there")
    options = parser.parse_args()
    options.models, options.manifest, options.out = (p.resolve() for p in (options.models, options.manifest, options.out))
    if not options.only_tables:
        _run("-m", "mdp.learning.collect", str(options.models), "-o", str(options.out / "paper"), *COLLECTED)
        _train(options)
        _search(options)
    _tables(options)


def _run(*arguments: str) -> None:
    """Run a command that reports its own errors, and exit with its code."""
    try:
        ended = subprocess.run([sys.executable, *arguments], cwd=ROOT).returncode
    except KeyboardInterrupt:
        sys.exit(130)
    if ended:
        sys.exit(ended)


def _train(options: argparse.Namespace) -> None:
    """Train the missing rankers for each fold."""
    for fold, name in product(range(FOLDS), RANKERS):
        ranker = options.out / "rankers" / f"f{fold}" / f"{name}.onnx"
        ranker.parent.mkdir(parents=True, exist_ok=True)
        if not ranker.exists():
            given = (str(options.out / "paper"), "--terms", "paper", "--manifest", str(options.manifest), "-o", str(ranker))
            _run("-m", "mdp.learning.train", *given, *RANKERS[name], "--fold", str(fold))


def _search(options: argparse.Namespace) -> None:
    given = ("tools/campaigns/widths.py", str(options.models), "--out", str(options.out / "widths.csv"), *SEARCHES)
    _run(*given, "--widths", PLAIN)
    for fold in range(FOLDS):
        rankers = ",".join(str(options.out / "rankers" / f"f{fold}" / f"{name}.onnx") for name in RANKERS)
        judged = ("--side", "test", "--fold", str(fold), "--manifest", str(options.manifest))
        _run(*given, "--widths", LEARNED, "--rankers", rankers, *judged)


def _tables(options: argparse.Namespace) -> None:
    rankers = [f"--ranker={options.out / 'rankers' / 'f0' / name}.onnx" for name in RANKERS]
    given = ("--terms", "paper", "--manifest", str(options.manifest), "--pictures", str(options.out))
    _run("-m", "mdp.learning.evaluate", str(options.out / "paper"), *given, *rankers)
    widths = str(options.out / "widths.csv")
    chosen = ("--least-removed", str(LEAST_REMOVED))
    _run("tools/campaigns/widths.py", "--out", widths, "--summary", *chosen)
    _run("-m", "mdp.learning.evaluate", "--figure7", widths, *chosen, "--pictures", str(options.out))


if __name__ == "__main__":
    main()
