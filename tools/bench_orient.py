"""What it brings to choose the orientation together with the parts, by the estimates that the search chooses by.

    python tools/bench_orient.py MODEL [MODEL ...] [--set KEY=VALUE ...]

One row a model: scars in mm2 and minutes in one piece as it stands, as the search cuts it there, and laid down; in brackets the
time and the filament over those of one piece as it stands. Then processor time of the search alone, and of laying down over it.
"""

import argparse
from collections.abc import Callable
from functools import partial
from time import process_time
from typing import TypeVar

from machine.pipeline.pricing import pricing
from mdp.decomposition import Decomposition, FrontRow
from mdp.directions.orientation import in_words
from mdp.model_file import locate
from mdp.read import read_mesh
from mdp.search.orient import orient_and_decompose
from mdp.search.search import SearchRequest, decompose
from profiles.profile import Profile, load

HEAD = (
    "model",
    "one piece",
    "parts",
    "cut as it stands",
    "orientation",
    "parts",
    "laid down",
    "core s",
    "laying",
)

Result = TypeVar("Result")


def main() -> None:
    """Read the options, print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+", metavar="MODEL")
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    given = options.parse_args()
    profile = load(settings=given.set)
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for model in given.models:
        print(row(model, profile), flush=True)


def row(model: str, profile: Profile) -> str:
    """One line of the table."""
    mesh, _ = read_mesh(locate(model), profile.process.scale, profile.process.rotate_deg)
    search = partial(decompose, name=model, profile=profile, request=SearchRequest(price=pricing(profile)))
    upright, search_s = timed(lambda: search(mesh))
    oriented, lay_s = timed(lambda: orient_and_decompose(mesh, profile, pricing, search))
    whole, laid = upright.front[0], oriented.decomposition
    cells = [model.rsplit("/", 1)[-1], f"{whole.cost_mm2:.0f}, {(whole.time_s or 0.0) / 60:.0f}"]
    cells += [
        str(len(upright.parts)),
        figures(upright, whole),
        "-" if oriented.orientation is None else in_words(oriented.orientation),
    ]
    cells += [str(len(laid.parts)), figures(laid, whole), f"{search_s:.1f}", f"{lay_s / search_s:.1f}"]
    return "| " + " | ".join(cells) + " |"


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """What work gives, and its seconds of processor time."""
    began = process_time()
    return work(), process_time() - began


def figures(decomposition: Decomposition, whole: FrontRow) -> str:
    """Blemishes and minutes of what was chosen, and its time and filament over those of one piece."""
    chosen = decomposition.chosen
    if chosen is None or None in (chosen.time_s, whole.time_s):
        return "-"
    time_s, filament_mm = chosen.time_s or 0.0, chosen.filament_mm or 0.0
    shares = f"{time_s / (whole.time_s or 1.0):.2f}, {filament_mm / (whole.filament_mm or 1.0):.2f}"
    return f"{chosen.cost_mm2:.0f}, {time_s / 60:.0f} ({shares})"


if __name__ == "__main__":
    main()
