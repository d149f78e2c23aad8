"""Make the pictures of the workbench: `python tools/docs/make_workbench_pictures.py [FOLDER]`; needs Chromium.

Without a folder those of the docs, `workbench.png`, `workbench-phone.png` and the small ones of one session, `strip/`; with one,
every step from model to print, on a desktop and on a phone, light and dark, for inspection.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tests.machine.browser import Browser
from tests.machine.running_workbench import workbench
from tools.docs.harness import DOCS, clean_browser

DEMO = "demo:tree"
DESKTOP, PHONE = (1280, 800), (390, 844)
STRIP = ("model", "parts", "plane", "settings", "sliced", "look", "checks", "printing")
STRIP_SIZE, STRIP_SCALE = (1040, 650), 0.5
SETTLED_S = 0.8
SHOWN = "document.documentElement.dataset.shown && document.documentElement.dataset.busy === ''"
FOUND = "!document.documentElement.hasAttribute('data-searching') && !document.body.classList.contains('no-cuts')"


class Step(NamedTuple):
    """Clicks on the page before its picture is taken, and the condition to wait for."""

    name: str
    clicks: tuple[str, ...]
    until: str


STEPS = (
    Step("model", (), SHOWN),
    Step("finding", ("#tab-parts", "#find"), "document.documentElement.hasAttribute('data-searching')"),
    Step("parts", (), FOUND),
    Step("plane", ("#parts-list .card:last-child input",), "!document.getElementById('plane').hidden"),
    Step("settings", ("#tab-settings",), "document.querySelectorAll('[data-key]').length > 10"),
    Step("slicing", ("#tab-slices", "#slice"), "document.getElementById('slice').disabled"),
    Step("look", (), "!document.getElementById('print-page').hidden"),
    Step("sliced", ("#leave-print",), "document.getElementById('print-page').hidden"),
    Step("checks", ("#tab-printing", "#check"), "!document.getElementById('run-ask').hidden"),
    Step("printing", ("#begin",), "document.documentElement.dataset.printing === 'printing'"),
)


def session(size: tuple[int, int], keep: Callable[[Browser, str], None], last: str = STEPS[-1].name) -> None:
    """The steps up to a named one on a workbench with a model; keep: called after each step."""
    with clean_browser(size, mobile=size == PHONE) as browser, workbench(DEMO) as running:
        browser.open(running.address)
        for step in STEPS[: [step.name for step in STEPS].index(last) + 1]:
            for element in step.clicks:
                browser.click(element)
            browser.wait(step.until)
            time.sleep(SETTLED_S)
            keep(browser, step.name)


def pictures_of_the_docs() -> None:
    """One picture on a desktop, one on a phone, and a session in small ones."""
    for size, last, file in ((DESKTOP, "plane", "workbench.png"), (PHONE, "parts", "workbench-phone.png")):

        def keep(browser: Browser, name: str, last: str = last, file: str = file) -> None:
            if name == last:
                browser.screenshot(DOCS / file)

        session(size, keep, last)

    def keep_small(browser: Browser, name: str) -> None:
        browser.value("$('run-files').hidden = true")  # a log's path differs each time
        if name in STRIP:
            browser.screenshot(DOCS / "strip" / f"{STRIP.index(name) + 1}-{name}.png", STRIP_SCALE)

    session(STRIP_SIZE, keep_small)


def every_step(folder: Path) -> None:
    """All steps on both devices, light and dark."""
    folder.mkdir(parents=True, exist_ok=True)
    for device, size in (("desktop", DESKTOP), ("phone", PHONE)):

        def keep(browser: Browser, name: str, device: str = device) -> None:
            for scheme in ("light", "dark"):
                browser.prefer(scheme)
                time.sleep(SETTLED_S)
                browser.screenshot(folder / f"{device}-{name}-{scheme}.png")

        session(size, keep)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        every_step(Path(sys.argv[1]))
    else:
        pictures_of_the_docs()
