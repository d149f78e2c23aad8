"""Make the pictures of the viewer page for README and docs: `python tools/docs/make_view_pictures.py [FOLDER [PICTURE ...]]`;
needs Chromium.

Each picture shows another model, at another moment or with other choices.
"""

import json
import sys
import tempfile
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.requests import ModelRequest
from machine.view.page import print_page
from profiles.profile import load
from tests.machine.browser import Browser
from tools.docs.harness import DOCS, clean_browser

PAUSE = "new Promise((done) => setTimeout(done, 400))"  # until the page has come to rest
STILL = "document.documentElement.dataset.picture === 'idle'"


@dataclass(frozen=True)
class Shot:
    """A demo model and the choices on its page: the most parts (None: the program's choice), a fraction of the rows, values of
    lists and sliders, elements clicked, keys pressed."""

    demo: str
    parts: int | None = None
    share: float = 1.0
    choices: dict[str, str] = field(default_factory=dict)
    clicks: tuple[str, ...] = ()
    keys: tuple[str, ...] = ()


SHOTS = {
    "figure": Shot("figure", 4, 0.93, {"colour-by": "part"}),
    "front": Shot("tree", None, 1.0, {}, ("#front tbody tr:nth-child(3)", "#show-machine"), ("-",)),
    "tree": Shot("tree", None, 0.71, {"colour-by": "kind", "model": "hide", "frame": "workpiece"}, (), ("ArrowUp", "-")),
    "bracket": Shot("bracket", None, 0.86, {"colour-by": "speed"}, (), ("d",)),
    "lattice": Shot("lattice", None, 1.0, {"colour-by": "layer", "model": "hide"}, ("#show-machine",), ("d", "-", "-")),
}


@cache
def content(demo: str, parts: int | None) -> bytes:
    """The page of a demo model, sliced for the default machine."""
    profile = load()
    decomposed = decompose_model(ModelRequest(f"demo:{demo}", profile, parts=parts))
    return print_page(f"demo:{demo}", build(decomposed.decomposition, profile), profile)


def choose(browser: Browser, name: str, value: object) -> None:
    """Set a list or a slider as a user would."""
    browser.value(
        f"(() => {{ const e = document.getElementById({json.dumps(name)}); e.value = {json.dumps(str(value))};"
        "for (const kind of ['input', 'change']) e.dispatchEvent(new Event(kind)); })()"
    )


def shoot(browser: Browser, shot: Shot, page: Path, picture: Path) -> None:
    """Open a page, make the choices for a picture, and save it."""
    page.write_bytes(content(shot.demo, shot.parts))
    browser.open(page.as_uri())
    choose(browser, "position", round(shot.share * int(browser.value("document.getElementById('position').max"))))
    for name, value in shot.choices.items():
        choose(browser, name, value)
    for element in shot.clicks:
        browser.click(element)
    for key in ("f", *shot.keys):
        browser.key(key)
    browser.value(PAUSE)
    browser.wait(STILL)
    browser.screenshot(picture)
    print(f"{picture} {picture.stat().st_size // 1000} kB", flush=True)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS
    with clean_browser((1040, 640)) as browser, tempfile.TemporaryDirectory() as work:
        for name in sys.argv[2:] or SHOTS:
            shoot(browser, SHOTS[name], Path(work) / f"{name}.html", folder / f"view-{name}.png")
