"""The model's place on the plate in a real browser: dragged, stepped by keys, typed, and undone in one step."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import Running
from tests.machine.test_workbench_page import drag_slider, open_model
from tests.shapes import tee

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

PLACE = "[$('place-x').value, $('place-y').value]"
STOOD = "JSON.stringify(modules['page/store'].store.state.place_mm)"


def open_in_the_middle(browser: Browser, bench: Running, name: str) -> None:
    open_model(browser, bench, name, stl(tee()))
    browser.click("#place-middle")  # another test may have moved it
    waits_for_place(browser, 0, 0)
    browser.wait("!$('hand-place').hidden")


def knob_drawn(browser: Browser) -> tuple[float, float]:
    browser.wait("new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(() => drawn(true))))")
    x, y = browser.middle("#hand-place")
    return x, y


def pixels(browser: Browser) -> np.ndarray:
    knob_drawn(browser)
    width, height = browser.value("[$('canvas').clientWidth, $('canvas').clientHeight]")
    with Image.open(BytesIO(browser.screenshot())) as picture:
        return np.array(picture.convert("RGB"))[-height:, :width]


def press(browser: Browser, key: str, shift: bool = False) -> None:
    for event in ("keydown", "keyup"):
        given = f"{{ key: '{key}', shiftKey: {str(shift).lower()}, bubbles: true }}"
        browser.value(f"$('hand-place').dispatchEvent(new KeyboardEvent('{event}', {given}))")


def waits_for_place(browser: Browser, x: int, y: int) -> None:
    browser.wait(f"JSON.stringify({PLACE}.map(Number)) === '[{x},{y}]' && {STOOD} === '[{x},{y}]'")


def test_keys_and_numbers_move_the_model_with_its_plane_in_one_step(browser: Browser, bench: Running) -> None:
    open_in_the_middle(browser, bench, "placed.stl")
    browser.click("#tab-parts")
    browser.click("#add")
    browser.wait("$('plane-offset').value === '20.00'")
    browser.click("#tab-model")
    middle = knob_drawn(browser)
    press(browser, "ArrowRight", shift=True)
    waits_for_place(browser, 10, 0)
    press(browser, "ArrowDown")
    waits_for_place(browser, 10, -1)
    assert np.hypot(*np.subtract(knob_drawn(browser), middle)) > 10.0
    drag_slider(browser, "place-x", 25, "change")
    waits_for_place(browser, 25, -1)
    assert browser.value("$('parts-list').children.length") == 2
    browser.click("#undo")
    waits_for_place(browser, 10, -1)
    browser.click("#place-middle")
    waits_for_place(browser, 0, 0)
    drag_slider(browser, "place-x", 97, "change")
    browser.wait("$('fit-told').classList.contains('refused')")
    assert "over the edge of the plate" in browser.value("$('fit-told').textContent")
    assert browser.complaints == []


def test_a_drag_of_the_handle_moves_the_model_by_whole_mm(browser: Browser, bench: Running) -> None:
    open_in_the_middle(browser, bench, "dragged-away.stl")
    browser.click("[data-view=top]")
    browser.click("#fit")
    start = knob_drawn(browser)
    end = (start[0] + 60, start[1] - 30)
    browser.hold(start, end)
    x, y = map(int, browser.value(PLACE))
    assert knob_drawn(browser) == pytest.approx(end, abs=7.0)
    browser.release(end)
    waits_for_place(browser, x, y)
    assert x == pytest.approx(2.0 * y, abs=1.5)
    assert x >= 4.0


def test_copies_are_drawn_where_they_are_printed_and_too_many_are_reported(browser: Browser, bench: Running) -> None:
    open_in_the_middle(browser, bench, "many.stl")
    browser.click("#tab-slices")
    drag_slider(browser, "copies", 6, "change")
    browser.wait("$('copies-told').textContent === 'All 6 stand on the plate.'")
    browser.click("#fit")
    six = pixels(browser)
    drag_slider(browser, "copies", 1, "change")
    browser.wait("$('copies-told').textContent === ''")
    assert (six != pixels(browser)).any(axis=2).mean() > 0.05
    drag_slider(browser, "copies", 900, "change")
    browser.wait("$('copies-told').textContent.startsWith('900 copies: many.stl measures 40.0 x 10.0 mm')")
    assert "has room for" in browser.value("$('copies-told').textContent")
    browser.click("#undo")
    browser.wait("$('copies').value === '1' && $('copies-told').textContent === ''")
    assert browser.complaints == []
