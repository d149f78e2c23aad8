"""Bench of the view: size of the page, time to make it and to open it in Chromium: `python tools/bench_view.py MODEL...`."""

import argparse
import statistics
import tempfile
from pathlib import Path
from time import perf_counter

from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.requests import ModelRequest
from machine.view.page import parts_page, print_page
from profiles.profile import load
from tests.machine.browser import CHROMIUM, Browser

DEMOS = ("demo:figure", "demo:tree", "demo:bracket", "demo:lattice")
SIZE = (1280, 720)
TURNS = 12
SCREEN = "document.documentElement.dataset"
WHEEL = "document.getElementById('canvas').dispatchEvent(new WheelEvent('wheel', {deltaY: %d, cancelable: true}))"


def page_of(model: str, settings: list[str]) -> bytes:
    """The page of a model, and its row of the first table."""
    profile = load(settings=settings)
    request = ModelRequest(model, profile, orient=False)
    decomposition = decompose_model(request, to_build=True).decomposition
    program = build(decomposition, profile)
    began = perf_counter()
    page = print_page(request.name, program, profile)
    seconds, moves = perf_counter() - began, len(program.run.program.line)
    alone = len(parts_page(decomposition, profile)) / 1e6
    print(f"| {request.name} | {moves} | {len(page) / 1e6:.2f} | {len(page) / moves:.1f} | {seconds:.2f} | {alone:.2f} |")
    return page


def opened(name: str, page: Path) -> str:
    """A row of the second table: seconds from opening until usable, first picture, every move drawn; a frame while it turns."""
    with Browser(SIZE) as browser:
        browser.open(page.as_uri())
        browser.wait(f"{SCREEN}.picture === 'idle'")
        ready, first, whole = (float(browser.value(f"{SCREEN}.{name}Ms")) / 1000 for name in ("opened", "first", "whole"))
        frames = [_frame(browser, 5 - 10 * (k % 2)) for k in range(TURNS)]
        rows = browser.value("document.getElementById('position').max")
    frame = statistics.median(frames)
    return f"| {name} | {int(rows) + 1} | {ready:.1f} | {first:.1f} | {whole:.1f} | {frame:.2f} |"


def _frame(browser: Browser, way: int) -> float:
    """Seconds from a turn of the wheel until its picture is there."""
    began = perf_counter()
    browser.value(WHEEL % way)
    browser.wait(f"['waiting', 'idle'].includes({SCREEN}.picture)")
    return perf_counter() - began


def main() -> None:
    """A row of both tables for every model; --page FILE opens a page that is there already."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*")
    parser.add_argument("--set", action="append", default=[], dest="settings")
    parser.add_argument("--page", action="append", default=[], type=Path, dest="pages")
    given = parser.parse_args()
    models = given.models or ([] if given.pages else DEMOS)
    with tempfile.TemporaryDirectory() as folder:
        pages = {page.stem: page.resolve() for page in given.pages}
        if models:
            print("| model | moves | page MB | bytes a move | made in s | parts alone MB |\n|---|---|---|---|---|---|")
        for model in models:
            pages[model] = Path(folder) / f"{len(pages)}.html"
            pages[model].write_bytes(page_of(model, given.settings))
        if CHROMIUM is None:
            return
        print("\n| page | rows | usable after s | first picture s | every move s | frame s |\n|---|---|---|---|---|---|")
        for name, page in pages.items():
            print(opened(name, page))


if __name__ == "__main__":
    main()
