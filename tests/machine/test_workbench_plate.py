"""Several models on the plate of the workbench in a real browser: added, drawn, counted, taken away and kept."""

import pytest

from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import Running
from tests.machine.test_workbench_page import choose, open_model
from tests.machine.test_workbench_place import pixels
from tests.shapes import box, tee

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

ROWS = (
    "JSON.stringify([...$('plate-list').children].map((row) => [row.firstChild.textContent, row.querySelector('input').value]))"
)
COPIES = "document.querySelector('#plate-list li:last-child input')"


def waits_for_rows(browser: Browser, rows: str, told: str) -> None:
    browser.wait(f"{ROWS} === '{rows}' && $('plate-told').textContent === '{told}'")


def test_a_model_is_added_drawn_counted_taken_off_the_plate_and_there_after_a_reload(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "first.stl", stl(tee()))
    waits_for_rows(browser, '[["first.stl","1"]]', "")
    assert browser.value("getComputedStyle($('others-told')).display") == "none"
    choose(browser, "second.stl", stl(box(20, 20, 20)), "add-file")
    waits_for_rows(browser, '[["first.stl","1"],["second.stl","1"]]', "All 2 stand on the plate.")
    browser.wait("document.documentElement.dataset.others")
    browser.click("#fit")
    both = pixels(browser)
    browser.value(f"{{ {COPIES}.value = 3; {COPIES}.dispatchEvent(new Event('change')); }}")
    waits_for_rows(browser, '[["first.stl","1"],["second.stl","3"]]', "All 4 stand on the plate.")
    browser.click("#tab-settings")
    browser.wait("$('command-line').textContent.startsWith('tiltprint export first.stl second.stl:3 ')")
    browser.click("#tab-model")
    browser.open(bench.address)
    waits_for_rows(browser, '[["first.stl","1"],["second.stl","3"]]', "All 4 stand on the plate.")
    browser.click("#plate-list li:last-child button")
    waits_for_rows(browser, '[["first.stl","1"]]', "")
    browser.wait("document.documentElement.dataset.others === ''")
    assert (both != pixels(browser)).any(axis=2).mean() > 0.02
    browser.click("#undo")
    waits_for_rows(browser, '[["first.stl","1"],["second.stl","3"]]', "All 4 stand on the plate.")
    choose(browser, "third.stl", stl(box(8, 8, 8)))
    browser.wait("$('title').textContent === 'third.stl' && !$('add-opened').hidden")
    browser.click("#add-opened")
    waits_for_rows(browser, '[["first.stl","1"],["second.stl","3"],["third.stl","1"]]', "All 5 stand on the plate.")
    browser.wait("$('add-opened').hidden")
    assert browser.complaints == []
