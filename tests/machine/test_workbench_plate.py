"""Several models on the plate of the workbench in a real browser: added, drawn, counted, removed and kept."""

import pytest

from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import Running
from tests.machine.test_workbench_page import choose, open_model
from tests.machine.test_workbench_place import pixels
from tests.shapes import box, tee

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

ROWS = """JSON.stringify([...$('plate-list').children].map(
  (row) => [row.firstChild.textContent, row.querySelector('input').value]))"""
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
    browser.wait("$('command-line').textContent.startsWith('tiltprint export first.3mf ')")
    browser.click("#tab-model")
    browser.open(bench.address)
    waits_for_rows(browser, '[["first.stl","1"],["second.stl","3"]]', "All 4 stand on the plate.")
    browser.click("#plate-list li:last-child button:last-child")
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


def test_a_demo_is_added_to_the_plate_beside_the_open_model(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "open.stl", stl(tee()))
    browser.value("{ $('add-demo').value = 'demo:lattice'; $('add-demo').dispatchEvent(new Event('change')); }")
    waits_for_rows(browser, '[["open.stl","1"],["demo:lattice","1"]]', "All 2 stand on the plate.")
    assert browser.value("[$('title').textContent, $('add-demo').value]") == ["open.stl", ""]
    assert browser.complaints == []


def red_share(browser: Browser) -> float:
    """The share of the picture in the red of models without a place."""
    red, green, blue = (pixels(browser)[:, :, channel].astype(int) for channel in range(3))
    return float(((red > 130) & (green < 70) & (blue < 70)).mean())


def test_models_without_a_place_are_red_beside_the_plate_and_cannot_be_sliced(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "crowd.stl", stl(box(60, 60, 20)))
    browser.click("#tab-slices")
    assert red_share(browser) == 0.0
    assert not browser.value("$('slice').disabled")
    browser.value("{ $('copies').value = 12; $('copies').dispatchEvent(new Event('change')); }")
    browser.wait("$('copies-told').textContent.includes('12 copies: crowd.stl measures 60.0 x 60.0 mm')")
    browser.wait("$('unsliceable').checkVisibility() && $('unsliceable').textContent.includes('has room for')")
    assert browser.value("$('slice').disabled && $('slice').checkVisibility()")
    assert red_share(browser) > 0.02
    browser.click("#undo")
    browser.wait("$('copies-told').textContent === '' && !$('slice').disabled")
    assert red_share(browser) == 0.0
    assert browser.complaints == []


def test_a_click_on_another_model_in_the_picture_or_the_list_works_on_that_and_moves_none(
    browser: Browser, bench: Running
) -> None:
    open_model(browser, bench, "one.stl", stl(tee()))
    choose(browser, "two.stl", stl(box(20, 20, 20)), "add-file")
    browser.wait("document.documentElement.dataset.others && $('plate-told').textContent === 'All 2 stand on the plate.'")
    browser.click("#fit")
    there = browser.value("""(() => {
      const { state } = modules["page/store"].store, [, [low, high]] = state.other_boxes[0], [x, y] = state.copies_mm[0];
      return view.picture.placeOf([(low[0] + high[0]) / 2 - x, (low[1] + high[1]) / 2 - y, (low[2] + high[2]) / 2]);
    })()""")
    places = "JSON.stringify(modules['page/store'].store.state.copies_mm)"
    first = browser.value(places)
    browser.press(*there)
    browser.wait("$('title').textContent === 'two.stl' && $('plate-told').textContent === 'All 2 stand on the plate.'")
    browser.click("#plate-list li:first-child button")
    browser.wait(f"$('title').textContent === 'one.stl' && {places} === '{first}'")
    assert browser.complaints == []


def test_the_page_says_that_a_scale_is_that_of_all_models_and_lists_the_parts_of_each(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "scaled.stl", stl(tee()))
    browser.click("#tab-model")
    assert browser.value("$('scale-told').hidden")
    choose(browser, "cube.stl", stl(box(20, 20, 20)), "add-file")
    browser.wait("$('plate-list').children.length === 2 && $('scale-told').checkVisibility()")
    browser.value("{ $('scale').value = 50; $('scale').dispatchEvent(new Event('change')); }")
    browser.wait("$('undo').ariaLabel === 'undo: scale all models on the plate'")
    sizes = "JSON.stringify([...$('plate-list').querySelectorAll('small')].map((one) => one.textContent))"
    browser.wait(f'{sizes} === \'["not cut","not cut"]\'')
    assert browser.complaints == []
