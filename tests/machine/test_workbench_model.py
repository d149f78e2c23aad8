"""The model on the workbench in a real browser: rotated by its rings, scaled, and marked beyond the machine's reach."""

import json
import re
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import Running
from tests.machine.test_workbench_page import drag_slider, find_as_it_lies, open_model
from tests.mdp.slicer_files import Made, Object, Placed, bambu
from tests.shapes import tee

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

RING_Y = """(() => { const path = document.querySelector('[data-ring=y] .near'), box = $('rings').getBoundingClientRect();
  const at = (share) => path.getPointAtLength(share * path.getTotalLength());
  return [at(0.5), at(0.6)].map(({ x, y }) => [x + box.x, y + box.y]); })()"""
SLIPPED = """(({ add, scaled, sub, unit }, { faceMet }) => { let seed = 7;
  const random = () => (seed = seed * 16807 % 2147483647) / 2147483647 - 0.5;
  const place = () => [random(), random(), random()], ends = () => [place(), place()];
  return Array.from({ length: 2000 }, () => { const [a, b] = ends(), [c, d] = ends(), along = random() + 0.5;
    const on = add(scaled(a, along), scaled(b, 1 - along)), from = scaled(place(), 100);
    return faceMet({ corners: [a, b, c, b, a, d].flat(), count: 2 }, from, unit(sub(on, from)));
  }).filter(({ face }) => face < 0).length; })(modules["picture/math"], modules["scene/face-tree"])"""
MENU = ["Remove", "Lock", "Print earlier", "Print later", "Settings of this part"]
# The key arrives before the page is redrawn, when a browser removes the focus from hidden elements.
LOCK_AND_DELETE = """{ document.querySelector('#part-menu button:nth-child(2)').click();
  document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { key: 'Delete', bubbles: true })); }"""
MENU_OF = """((part) => document.querySelector(`#parts-list .card:has([value="${part}"])`)
  .dispatchEvent(new MouseEvent("contextmenu", { bubbles: true, cancelable: true, clientX: 50, clientY: 50 })))"""
TURNED = "$('undo').getAttribute('aria-label') === 'undo: turn the model'"


def told_by(browser: Browser, ring: str) -> str:
    text: str = browser.value(f"document.querySelector('[data-ring={ring}]').getAttribute('aria-valuetext')")
    return text


def arrow_up(browser: Browser, event: str) -> None:
    given = "{ key: 'ArrowUp', shiftKey: true, bubbles: true }"
    browser.value(f"document.activeElement.dispatchEvent(new KeyboardEvent('{event}', {given}))")


def test_a_drag_of_a_ring_turns_the_model_in_one_step_and_red_follows_it(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "dragged.stl", stl(tee()))
    browser.wait("!$('rings').hasAttribute('hidden')")
    browser.wait("parseFloat($('overhang').textContent) === 300")  # two arms of 15 x 10 mm, once the picture is drawn
    start, end = (tuple(point) for point in browser.value(RING_Y))
    browser.hold(start, end)
    browser.wait("parseFloat($('overhang').textContent) > 300")  # while it is held
    angle = told_by(browser, "y")
    browser.release(end)
    browser.wait(TURNED)
    assert angle not in ("0 degrees", "")
    browser.wait("parseFloat($('overhang').textContent) > 300")
    browser.click("#undo")
    browser.wait("$('undo').getAttribute('aria-label').startsWith('undo: open')")
    browser.wait("parseFloat($('overhang').textContent) === 300")


def test_plates_and_settings_of_a_slicer_file_are_taken_by_buttons(browser: Browser, bench: Running, tmp_path: Path) -> None:
    def cube(side_mm: float, x_mm: float, plate: int) -> Object:
        transform = np.vstack([np.eye(3), [x_mm, 0.0, 0.0]])
        return Object([Made(m3.Manifold.cube(3 * (side_mm,), True))], [Placed(transform, plate)])

    inside = {"Metadata/project_settings.config": json.dumps({"wall_loops": "5", "sparse_infill_density": "33%"})}
    bambu(tmp_path / "two.3mf", [cube(20.0, 0.0, 1), cube(30.0, 300.0, 2)], np.random.default_rng(0), inside)
    open_model(browser, bench, "two.3mf", (tmp_path / "two.3mf").read_bytes())
    browser.click("#tab-model")
    browser.wait("$('size-x').value === '20.00'")
    assert "choose another one below: 2" in browser.value("$('model-notes').textContent")
    browser.click("#plates button:nth-child(2)")
    browser.wait("$('size-x').value === '30.00' && $('plates').children[1].disabled")
    browser.click("#file-settings")
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: take the settings of two.3mf'")
    browser.wait("$('file-settings-note').textContent.startsWith('two.3mf: uses the settings of OrcaSlicer inside: ')")
    with bench.line() as line:
        settings = line.until(lambda state: state["model"]["plates"][1]["taken"])["given"]["settings"]
    assert {"process.walls=5", "process.infill_density=0.33"} <= set(settings)
    open_model(browser, bench, "tee.stl", stl(tee()))
    assert browser.value("$('plates').childElementCount === 0 && $('inside').hidden && $('file-settings-note').hidden")


def test_a_click_on_the_edge_between_two_faces_meets_one_of_them(browser: Browser, bench: Running) -> None:
    browser.open(bench.address)
    assert browser.value(SLIPPED) == 0


def test_arrow_keys_turn_a_ring_and_shift_takes_15_degrees_at_once(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "keys.stl", stl(tee()))
    browser.wait("!$('rings').hasAttribute('hidden')")
    browser.value("document.querySelector('[data-ring=x]').focus()")
    for _ in range(6):
        arrow_up(browser, "keydown")
    assert told_by(browser, "x") == "90 degrees"
    arrow_up(browser, "keyup")
    browser.wait(TURNED)
    browser.wait("$('size-z').value === '10.00' && $('size-y').value === '40.00'")  # a T of 40 x 10 x 40 mm, lying on its back


def test_a_typed_side_scales_the_model_and_an_unreachable_size_is_reported(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "sized.stl", stl(tee()))
    browser.click("#tab-parts")
    browser.click("#add")
    browser.wait("$('plane-offset').value === '20.00'")
    drag_slider(browser, "size-x", 60, "change")
    browser.wait("$('scale').value === '150' && $('size-y').value === '15.00'")
    assert browser.value("$('plane-offset').value") == "30.00"
    assert "reaches all of it" in browser.value("$('fit-told').textContent")
    drag_slider(browser, "scale", 2000, "change")
    browser.wait("$('fit-told').classList.contains('refused')")
    assert "Scale of the model makes the model smaller" in browser.value("$('fit-told').textContent")
    drag_slider(browser, "scale", -3, "change")
    browser.wait("$('scale').value === '2000'")
    browser.click("#scale-as-read")
    browser.wait("$('scale').value === '100'")
    assert browser.complaints == []


def test_exploded_parts_show_their_support_and_are_selected_by_a_click(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "apart.stl", stl(tee()))
    find_as_it_lies(browser)
    browser.wait("document.documentElement.dataset.pieces === '2'")
    first, second = browser.value("[...$('parts-list').querySelectorAll('.words')].map((cell) => cell.textContent)")
    assert first == "straight up"
    assert "° to the " in second
    joint = browser.value("$('parts-list').children[1].querySelector('.icon-joint dd').textContent")
    assert re.fullmatch(r"[\d.]+ mm², breaks at about [\d.]+ N sideways at the tip: the weakest", joint)
    browser.click("[data-view=front]")
    drag_slider(browser, "apart", 1, "input")
    browser.click("#fit")
    browser.wait("new Promise((drawn) => requestAnimationFrame(() => drawn(true)))")
    left, top, width, height = browser.value(
        "(() => { const b = $('canvas').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()"
    )
    heights = (top + share * height for share in np.arange(0.05, 0.95, 0.05))
    met = next(chosen for y in heights if (chosen := part_at(browser, left + width / 2, y)))
    assert met == "2"  # from above, the part lifted off is met first
    assert browser.value("$('parts-list').querySelector(':checked').value") == "2"
    browser.click("#parts-list input[value='1']")
    browser.value(f"{MENU_OF}(2)")
    assert browser.value("[...$('part-menu').children].map((entry) => entry.textContent)") == MENU
    browser.value(LOCK_AND_DELETE)
    browser.wait("$('parts-list').querySelectorAll('.lock:checked').length === 1 && !document.querySelector(':popover-open')")
    browser.wait("$('problem').textContent === 'the plane of part 2 is locked: unlock it first'")
    browser.click("#undo")
    browser.wait("$('problem').hidden && $('parts-list').querySelectorAll('[type=checkbox]:checked').length === 0")
    browser.key("Delete")
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: remove a plane'")
    assert browser.value("$('parts-list').children.length") == 1


def test_another_bench_has_its_own_page_and_is_closed_in_the_list(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "here.stl", stl(tee()))
    browser.click("#tab-model")
    browser.click("#another")
    browser.wait("!$('benches').hidden && $('benches-list').children.length === 2")
    assert browser.value("[...$('benches-list').children].map((row) => row.firstChild.textContent)") == [
        "here.stl (this page)",
        "nothing yet",
    ]
    browser.click("#benches-list li:last-child button")
    browser.wait("$('benches').hidden")
    assert browser.value("document.documentElement.dataset.line") == "open"


def part_at(browser: Browser, x: float, y: float) -> str | None:
    """The part that is chosen by a click."""
    browser.press(x, y)
    chosen: str | None = browser.value("$('parts-list').querySelector(':checked')?.value")
    return chosen
