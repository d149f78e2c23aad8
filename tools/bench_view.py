"""Bench of the view: size of the page and the time to make it, for models or demos: `python tools/bench_view.py MODEL...`."""

import argparse
from time import perf_counter

from machine.app.pipeline import build, decompose_model, model_name
from machine.app.view.page import parts_page, print_page
from profiles.profile import load

DEMOS = ("demo:figure", "demo:tree", "demo:bracket", "demo:lattice")


def main() -> None:
    """A row of the table for every model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", default=DEMOS)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    given = parser.parse_args()
    profile = load(settings=given.settings)
    print("| model | moves | page MB | bytes a move | made in s | parts alone MB |")
    print("|---|---|---|---|---|---|")
    for model in given.models:
        found = decompose_model(model, profile, "classic", to_build=True).decomposition
        program = build(found, profile)
        began = perf_counter()
        page = print_page(model_name(model), program, profile)
        seconds, moves = perf_counter() - began, len(program.run.program.line)
        alone = len(parts_page(found, profile)) / 1e6
        print(
            f"| {model_name(model)} | {moves} | {len(page) / 1e6:.2f} | {len(page) / moves:.1f} | {seconds:.2f} | {alone:.2f} |"
        )


if __name__ == "__main__":
    main()
