"""Command: what the command lines of this package share. Errors are one sentence on stderr with exit code 1, an interrupt 130."""

import argparse
import subprocess
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from math import inf
from pathlib import Path

from mdp.learning.lists import FOLDS
from mdp.ranking.features import CHECKED, COLUMNS, PAPER_COLUMNS
from profiles.errors import UserError

COLUMN_SETS = {  # cheap: those known for a candidate before it is checked
    "paper": PAPER_COLUMNS,
    "cheap": tuple(name for name in COLUMNS if name not in CHECKED),
    "all": COLUMNS,
}


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are sentences like all others."""

    def error(self, message: str) -> None:  # type: ignore[override]
        """Raise UserError instead of printing the usage."""
        raise UserError(f"{message}; --help shows what is allowed")


def run(command: Callable[[Sequence[str] | None], None], arguments: Sequence[str] | None, interrupted: str) -> int:
    """The exit code of a command. interrupted: message after Ctrl-C."""
    try:
        command(arguments)
    except UserError as error:
        sys.stderr.write(f"error: {error!s}\n")
        return 1
    except ModuleNotFoundError as error:
        sys.stderr.write(f"error: {error.name} is not installed; in a clone: pip install -e '.[train]'\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write(f"interrupted; {interrupted}\n")
        return 130
    return 0


def add_records(parser: argparse.ArgumentParser, use: str, nargs: str | None = None) -> None:
    """Add the options that select records and columns.

    use: what the columns are for; nargs: as in argparse, for the folder; exactly one by default.
    """
    parser.add_argument("folder", type=Path, nargs=nargs, help="of record files, MODEL.ORIENTATION.TERMS.npz")
    parser.add_argument(
        "--manifest", type=Path, metavar="CSV", help="id, source_repo, source_path of the models: split by source"
    )
    parser.add_argument(
        "--terms",
        type=split_names,
        default=(),
        metavar="NAME,...",
        help="only records of searches on these terms; all by default",
    )
    parser.add_argument("--fold", type=int, choices=range(FOLDS), default=0, help="split by source; each has its own test models")
    parser.add_argument("--columns", choices=COLUMN_SETS, help=f"features {use}; cheap: known without a check")


def split_names(text: str) -> tuple[str, ...]:
    """The names in a comma-separated list."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def check_range(options: argparse.Namespace, name: str, least: float, most: float = inf) -> None:
    """Raise UserError if an option's value is outside its range."""
    value = getattr(options, name)
    if value is not None and not least <= value <= most:
        allowed = f"{least:g} or more" if most == inf else f"{least:g} to {most:g}"
        raise UserError(f"--{name.replace('_', '-')} is {value:g}: {allowed} is allowed")


def table(heads: Sequence[str], lines: Sequence[Sequence[str]], numbers: bool = False) -> str:
    """A table in Markdown. numbers: whether all columns but the first are right-aligned."""
    rows = [f"| {' | '.join(cells)} |" for cells in (heads, *lines)]
    return "\n".join([rows[0], "|---|" + ("---:|" if numbers else "---|") * (len(heads) - 1), *rows[1:]])


def commit() -> str:
    """The commit of this program, or its version if it is not a clone."""
    here = Path(__file__).resolve().parent
    try:
        output = subprocess.run(
            ["git", "-C", str(here), "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        try:
            return f"version {version('tiltprint')}"
        except PackageNotFoundError:
            return "unknown"
    return output.stdout.strip()
