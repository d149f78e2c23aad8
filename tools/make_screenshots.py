"""Makes the pictures of the page for README and docs: `python tools/make_screenshots.py [FOLDER [DEMO ...]]`; needs Chromium.

One picture a demo model, each at another moment and with other choices, so that together they show what the page can do.
"""

import json
import sys
import tempfile
from pathlib import Path

from machine.app.pipeline.pipeline import build, decompose_model
from machine.app.requests import ModelRequest
from machine.view.page import print_page
from profiles.profile import load
from tests.machine.browser import Browser

FOLDER = Path(__file__).resolve().parents[1] / "docs"
SIZE = (1040, 640)
PAUSE = "new Promise((done) => setTimeout(done, 400))"  # until the page thinks that nothing moves any more
STILL = "document.documentElement.dataset.picture === 'idle'"
# What is chosen for each demo: a share of the rows, values of lists and sliders, boxes clicked, keys pressed.
SHOTS = {
    "figure": (0.52, {"colour-by": "part"}, ("show-travels",), ("+",)),
    "tree": (0.71, {"colour-by": "kind", "model": "hide", "frame": "workpiece"}, (), ("ArrowUp",)),
    "bracket": (0.86, {"colour-by": "speed"}, (), ("d",)),
    "lattice": (1.0, {"colour-by": "layer", "model": "hide"}, ("show-machine",), ("d", "-")),
}


def content(demo: str) -> bytes:
    """The page of a demo model, sliced for the usual machine."""
    profile = load()
    found = decompose_model(ModelRequest(f"demo:{demo}", profile))
    return print_page(f"demo:{demo}", build(found.decomposition, profile), profile)


def choose(browser: Browser, name: str, value: object) -> None:
    """A list or a slider set as by hand."""
    browser.value(
        f"(() => {{ const e = document.getElementById({json.dumps(name)}); e.value = {json.dumps(str(value))};"
        "for (const kind of ['input', 'change']) e.dispatchEvent(new Event(kind)); })()"
    )


def shoot(browser: Browser, demo: str, folder: Path, page: Path) -> Path:
    """Open a page, choose what is told for this demo, and keep what is seen."""
    share, choices, boxes, keys = SHOTS[demo]
    browser.open(page.as_uri())
    choose(browser, "position", round(share * int(browser.value("document.getElementById('position').max"))))
    for name, value in choices.items():
        choose(browser, name, value)
    for box in boxes:
        browser.click(f"#{box}")
    for key in ("f", *keys):
        browser.key(key)
    browser.value(PAUSE)
    browser.wait(STILL)
    path = folder / f"view-{demo}.png"
    browser.screenshot(path)
    return path


def main(folder: Path, demos: list[str]) -> None:
    with Browser(SIZE) as browser, tempfile.TemporaryDirectory() as work:
        browser.prefer("light")
        for demo in demos or SHOTS:
            page = Path(work) / f"{demo}.html"
            page.write_bytes(content(demo))
            path = shoot(browser, demo, folder, page)
            print(f"{path} {path.stat().st_size // 1000} kB, complaints: {browser.complaints or 'none'}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER, sys.argv[2:])
