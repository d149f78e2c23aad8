"""Make the pictures of README and docs: `python tools/docs/make_pictures.py [GROUP ...]`; without a group, all of them.

Groups: drawn (by the program itself), view and workbench (both need Chromium), tour and scale (both need the extra `train`),
rooms. With `--steps FOLDER`: every step from model to print, on a desktop and on a phone, light and dark, for inspection.
docs/parts.png, limbs.png and learning-*.png show results with models that do not ship, and stay as they are.
"""

import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from machine.pipeline.pictures import contact_sheet, parts_picture, write_png
from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.requests import ModelRequest
from machine.setup.coupon.bars import BEND
from machine.setup.coupon.plate import coupon
from machine.view.page import print_page
from profiles.profile import load
from tests.machine.browser import Browser
from tests.machine.running_workbench import workbench
from tools.docs import draw_rooms, draw_scale, draw_tour
from tools.docs.harness import DOCS

DEMO = "demo:tree"
DESKTOP, PHONE, STRIP, VIEW = (1280, 800), (390, 844), (1040, 650), (1040, 640)
SHOWN_IN_STRIP = ("model", "parts", "plane", "settings", "sliced", "look", "checks", "printing")
SCALE = 0.75  # of the strip; smaller text is illegible
SETTLED_S = 0.8
SHOWN = "document.documentElement.dataset.shown && document.documentElement.dataset.busy === ''"
FOUND = "!document.documentElement.hasAttribute('data-searching') && !document.body.classList.contains('no-cuts')"
STILL = "document.documentElement.dataset.picture === 'idle'"
# Name, clicks before the picture is taken, condition to wait for.
STEPS = (
    ("model", (), SHOWN),
    ("finding", ("#tab-parts", "#find"), "document.documentElement.hasAttribute('data-searching')"),
    ("parts", (), FOUND),
    ("plane", ("#parts-list .card:last-child input",), "!document.getElementById('plane').hidden"),
    ("settings", ("#tab-settings",), "document.querySelectorAll('[data-key]').length > 10"),
    ("slicing", ("#tab-slices", "#slice"), "document.getElementById('slice').disabled"),
    ("look", (), "$('print-page').contentDocument?.documentElement?.dataset.picture === 'idle' && !$('print-page').hidden"),
    ("sliced", ("#leave-print",), "$('print-page').hidden && document.documentElement.dataset.walls.split(' ').length === 4"),
    ("checks", ("#tab-printing", "#check"), "!document.getElementById('run-ask').hidden"),
    ("printing", ("#begin",), "document.documentElement.dataset.printing === 'printing'"),
)
# Demo, number of parts (None: the program's choice), share of the print, values of lists, keys.
VIEWS = (
    ("figure", 4, 0.93, {"colour-by": "part"}, ()),
    ("tree", None, 0.71, {"colour-by": "kind", "model": "hide", "frame": "workpiece"}, ("ArrowUp", "-")),
)


@contextmanager
def clean_browser(size: tuple[int, int]) -> Iterator[Browser]:
    """A browser for light-theme pictures, without earlier work and printers."""
    with tempfile.TemporaryDirectory() as state, Browser(size) as browser:
        os.environ["XDG_STATE_HOME"] = state
        browser.resize(*size, mobile=size == PHONE)
        browser.prefer("light")
        yield browser
        print(f"complaints: {browser.complaints or 'none'}")


def drawn() -> None:
    """Parts of demos, and the first and the last step of a plate of coupons."""
    profile = load()
    for demo, file in (("tree", "tree.png"), ("calibration", "calibration-piece.png")):
        found = decompose_model(ModelRequest(f"demo:{demo}", profile))
        write_png(DOCS / file, parts_picture(found.decomposition, found.profile))
    plate, size = coupon(BEND, profile), 480
    sheet = contact_sheet(plate, profile.machine, size)
    sheet = sheet[len(sheet) % size :]  # without its title
    columns, last = sheet.shape[1] // size, len(plate.parts) - 1
    frames = [sheet[k // columns * size :, k % columns * size :][:size, :size] for k in (0, last)]
    write_png(DOCS / "coupons.png", np.concatenate(frames, axis=1))


def view() -> None:
    """The viewer with a demo, at a moment and with choices of its own."""
    profile = load()
    with clean_browser(VIEW) as browser, tempfile.TemporaryDirectory() as folder:
        for demo, parts, share, choices, keys in VIEWS:
            found = decompose_model(ModelRequest(f"demo:{demo}", profile, parts=parts)).decomposition
            page = Path(folder) / f"{demo}.html"
            page.write_bytes(print_page(f"demo:{demo}", build(found, profile), profile))
            browser.open(page.as_uri())
            position = round(share * int(browser.value("document.getElementById('position').max")))
            for name, value in {"position": position, **choices}.items():
                browser.value(
                    f"(() => {{ const e = document.getElementById({json.dumps(name)}); e.value = {json.dumps(str(value))};"
                    "for (const kind of ['input', 'change']) e.dispatchEvent(new Event(kind)); })()"
                )
            for key in ("f", *keys):
                browser.key(key)
            time.sleep(SETTLED_S)
            browser.wait(STILL)
            browser.screenshot(DOCS / f"view-{demo}.png")


def session(size: tuple[int, int], last: str = STEPS[-1][0]) -> Iterator[tuple[Browser, str]]:
    """Yield after each step up to the last one, on a workbench with a model."""
    with clean_browser(size) as browser, workbench(DEMO) as running:
        browser.open(running.address)
        for name, clicks, until in STEPS[: [step[0] for step in STEPS].index(last) + 1]:
            for element in clicks:
                browser.click(element)
            browser.wait(until)
            time.sleep(SETTLED_S)
            yield browser, name


def of_workbench() -> None:
    """The workbench with a plane chosen, and a session from model to print."""
    for browser, name in session(DESKTOP, "plane"):
        if name == "plane":
            browser.screenshot(DOCS / "workbench.png")
    for browser, name in session(STRIP):
        browser.value("$('run-files').hidden = true")  # a log's path differs each time
        if name in SHOWN_IN_STRIP:
            browser.screenshot(DOCS / "strip" / f"{SHOWN_IN_STRIP.index(name) + 1}-{name}.png", SCALE)


def every_step(folder: Path) -> None:
    """All steps on both devices, light and dark."""
    folder.mkdir(parents=True, exist_ok=True)
    for device, size in (("desktop", DESKTOP), ("phone", PHONE)):
        for browser, name in session(size):
            for scheme in ("light", "dark"):
                browser.prefer(scheme)
                time.sleep(SETTLED_S)
                browser.screenshot(folder / f"{device}-{name}-{scheme}.png")


DRAWERS = {"tour": draw_tour.main, "scale": draw_scale.main, "rooms": draw_rooms.main}
GROUPS = {"drawn": drawn, "view": view, "workbench": of_workbench, **DRAWERS}


if __name__ == "__main__":
    if sys.argv[1:2] == ["--steps"]:
        every_step(Path(sys.argv[2]))
    else:
        for group in sys.argv[1:] or GROUPS:
            print(group, flush=True)
            GROUPS[group]()
