"""Repeat the experiment of the 2020 paper: collect, train, search, and print the tables.

    python tools/learning_experiment.py MODELS --manifest FILE.csv --out FOLDER [--only-tables]

MODELS holds models as npz (vertices in mm and faces); the manifest names their sources. Four splits by source: every model is
judged by rankers that saw no model of its source. Whatever FOLDER holds already is not made again, so an interrupted run goes on
where it stopped. Some 10 core-hours for 615 models.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from mdp.learning.lists import FOLDS

ROOT = Path(__file__).resolve().parents[1]
SEEDS = range(5)
SHARES = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of the models that train
PLAIN, LEARNED = "1,2,5,10,20,50", "1,2,5"  # widths
LEAST_REMOVED = 0.05  # of the risky area, by the widest plain beam: on other models every width ends alike
RANKERS = {  # and how each is trained
    "urank": ("--loss", "urank", "--patience", "200"),
    "regret": ("--loss", "regret", "--ensemble", "6", "--columns", "paper"),
    "regret_cheap": ("--loss", "regret", "--ensemble", "6"),
}
SEARCHES = ("--methods", "published", "--paper-terms", "--faces", "2500", "--set", "search.time_limit_s=120")


def main() -> None:
    """Make what is missing, then print the tables and draw the figures."""
    parser = argparse.ArgumentParser(description="repeat the experiment of the 2020 paper")
    parser.add_argument("models", type=Path)
    parser.add_argument("--manifest", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only-tables", action="store_true", help="of what is there")
    options = parser.parse_args()
    options.models, options.manifest, options.out = (p.resolve() for p in (options.models, options.manifest, options.out))
    if not options.only_tables:
        _collect(options)
        for arguments in trainings(options):
            _run(*arguments)
        _search(options)
    _tables(options)


def _run(*arguments: str) -> None:
    """Run a command that says itself what is wrong, and end as it does."""
    try:
        ended = subprocess.run([sys.executable, *arguments], cwd=ROOT).returncode
    except KeyboardInterrupt:
        sys.exit(130)
    if ended:
        sys.exit(ended)


def _collect(options: argparse.Namespace) -> None:
    wide = ("--terms", "paper", "--beam-width", "50", "--orientations", "4", "--faces", "2500", "--time-limit", "60")
    _run("-m", "mdp.learning.collect", str(options.models), "-o", str(options.out / "paper"), *wide)


def trainings(options: argparse.Namespace) -> Iterator[Sequence[str]]:
    """The commands that train what is not there yet: every ranker for each fold, then further seeds and shares for the first."""
    runs = [(f"f{fold}/{name}", name, ("--fold", str(fold))) for fold in range(FOLDS) for name in RANKERS]
    runs += [(f"f0/urank.seed{seed}", "urank", ("--seed", str(seed))) for seed in SEEDS if seed > 0]
    runs += [(f"f0/{name}.share{share:g}", name, ("--share", str(share))) for share in SHARES[:-1] for name in RANKERS]
    for file, name, others in runs:
        ranker = options.out / "rankers" / f"{file}.onnx"
        ranker.parent.mkdir(parents=True, exist_ok=True)
        if not ranker.exists():
            given = (str(options.out / "paper"), "--terms", "paper", "--manifest", str(options.manifest), "-o", str(ranker))
            yield ("-m", "mdp.learning.train", *given, *RANKERS[name], *others)


def _search(options: argparse.Namespace) -> None:
    given = ("tools/compare_widths.py", str(options.models), "--out", str(options.out / "widths.csv"), *SEARCHES)
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
    _run("tools/compare_widths.py", "--out", widths, "--summary", *chosen)
    _run("-m", "mdp.learning.evaluate", "--figure7", widths, *chosen, "--pictures", str(options.out))
    print(seeds_table(options.out))
    draw_curve(options.out)


def figures(ranker: Path) -> dict[str, float]:
    """What the training wrote into a ranker's file: mean NDCG over the lists of the test models, and their number."""
    import onnx

    about = {entry.key: entry.value for entry in onnx.load(ranker).metadata_props}
    found: dict[str, float] = json.loads(about["figures"])
    return found


def seeds_table(out: Path) -> str:
    """NDCG of the paper's network by seed, as CSV."""
    lines = [["seed", *(f"NDCG@{cut}" for cut in range(1, 6))]]
    for seed in SEEDS:
        known = figures(out / "rankers" / "f0" / ("urank.onnx" if seed == 0 else f"urank.seed{seed}.onnx"))
        lines.append([str(seed), *(f"{known[name]:.4f}" for name in lines[0][1:])])
    return "\n".join(",".join(line) for line in lines)


def draw_curve(out: Path) -> None:
    """NDCG@1 on the lists of the models that judge, against the share of the models that train."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(5.0, 4.0), layout="constrained")
    axes = picture.subplots()
    for name in RANKERS:
        files = [out / "rankers" / "f0" / (f"{name}.onnx" if share == 1.0 else f"{name}.share{share:g}.onnx") for share in SHARES]
        axes.plot(SHARES, [figures(file)["NDCG@1"] for file in files], "o-", label=name)
    axes.set_xscale("log", base=2)
    axes.set_xlabel("share of the models that train")
    axes.set_ylabel("NDCG@1, models that judge")
    axes.legend()
    picture.savefig(out / "learning-curve.png", dpi=150, metadata={"Software": None})


if __name__ == "__main__":
    main()
