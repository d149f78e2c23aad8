"""The workbench's picture in a real browser: brushing marks, the section view, measuring, and the camera."""

import json
from typing import Any

import manifold3d as m3
import pytest
from numpy import cos, radians, sin

from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import Running
from tests.machine.test_workbench_page import open_model
from tests.machine.test_workbench_place import pixels
from tests.shapes import ball, box, standing

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

STORE = "modules['page/store'].store"
IDLE = "document.documentElement.dataset.busy === ''"
MARKED = f"[...({STORE}.faceMarks || [])].filter(Boolean).length"
CUT_COLOUR = (242, 168, 92)


def opened(browser: Browser, bench: Running, name: str, content: bytes) -> None:
    open_model(browser, bench, name, content)
    browser.click("[data-view=front]")
    browser.click("#fit")
    pixels(browser)  # as it will be drawn then


def seen(browser: Browser, *place_mm: float) -> tuple[float, float]:
    """The position of a point of the plate's frame in the window, once a frame is drawn."""
    browser.value("new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
    places = f"""(() => {{
      const {{ left, top }} = $('canvas').getBoundingClientRect(), [x, y] = view.picture.placeOf({json.dumps(place_mm)});
      return [left + x, top + y];
    }})()"""
    x, y = browser.value(places)
    return x, y


def zones(browser: Browser) -> list[tuple[str, int]]:
    found: list[dict[str, Any]] = browser.value(f"{STORE}.state.zones")
    return [(zone["kind"], zone["faces"]) for zone in found]


def test_strokes_of_the_brush_paint_and_erase_and_each_is_one_step(browser: Browser, bench: Running) -> None:
    opened(browser, bench, "ball.stl", stl(ball(20.0)))
    browser.click("#tab-parts")
    browser.value("{ $('mark-kind').value = 'no_seam'; $('brush-radius').value = 4; }")
    browser.key("b")
    assert browser.value("$('mark-brush').getAttribute('aria-pressed')") == "true"
    left, right = seen(browser, -8, -18, 20), seen(browser, 8, -18, 20)
    before = browser.value("view.camera.yaw")
    browser.drag(left, right)
    browser.wait(f"{STORE}.state.zones.length === 1 && {IDLE}")
    [(kind, painted)] = zones(browser)
    assert (kind, browser.value("view.camera.yaw")) == ("no_seam", before)  # a stroke does not turn the view
    assert painted > 40  # a band 8 mm wide and 16 mm long at the front of a ball
    assert painted == browser.value(MARKED)
    browser.value("{ $('canvas').focus(); }")
    erased = "new KeyboardEvent('keydown', { key: 'Enter', shiftKey: true, bubbles: true })"
    browser.value(f"$('canvas').dispatchEvent({erased})")  # in the middle of the picture
    browser.wait(f"{STORE}.state.zones[0].faces < {painted} && {IDLE}")
    browser.click("#undo")
    browser.wait(f"{STORE}.state.zones[0].faces === {painted} && {IDLE}")
    browser.click("#undo")
    browser.wait(f"!{STORE}.state.zones.length && {IDLE} && {MARKED} === 0")
    browser.key("Escape")
    assert browser.complaints == []


def test_a_brush_beside_the_model_turns_the_view_and_a_second_finger_drops_its_stroke(browser: Browser, bench: Running) -> None:
    opened(browser, bench, "touched.stl", stl(ball(20.0)))
    browser.click("#tab-parts")
    browser.click("#mark-brush")
    yaw, (x, y) = browser.value("view.camera.yaw"), seen(browser, 0, -20, 20)
    browser.touch(((x, y),), ((x + 30, y),), ((x + 30, y), (x + 90, y)))
    pixels(browser)
    assert (browser.value(MARKED), browser.value(f"{STORE}.state.zones.length")) == (0, 0)
    assert browser.value("view.camera.yaw") == yaw
    browser.touch(((x, y),), ((x + 30, y),))
    browser.wait(f"{STORE}.state.zones.length === 1 && {IDLE}")
    browser.click("#mark-erase")  # a touch screen has no Shift key
    browser.touch(((x, y),), ((x + 30, y),))
    browser.wait(f"!{STORE}.state.zones.length && {IDLE}")
    browser.click("#mark-erase")
    beside = seen(browser, -28, 0, 20)
    browser.drag(beside, (beside[0] + 20, beside[1]))
    assert browser.value("view.camera.yaw") != yaw
    assert browser.value(f"{STORE}.state.zones.length") == 0
    browser.key("Escape")


def test_a_section_shows_flat_backs_and_what_it_takes_away_cannot_be_clicked(browser: Browser, bench: Running) -> None:
    opened(browser, bench, "inside.stl", stl(box(20.0, 20.0, 20.0)))
    whole = pixels(browser)
    assert not (abs(whole.astype(int) - CUT_COLOUR) < 30).all(axis=2).any()  # no backs shine through at edges
    browser.key("x")
    browser.key("x")
    assert browser.value("[$('section-along').value, $('section-flip').checked]") == ["y", True]  # it opens towards the viewer
    cut = pixels(browser)
    assert (abs(cut.astype(int) - CUT_COLOUR) < 12).all(axis=2).mean() > 0.02
    assert browser.value("$('section-told').textContent") == "0.0 mm"
    browser.click("#measure")
    browser.press(*seen(browser, 0, 0, 10))  # on the section itself, where nothing can be measured
    assert browser.value("$('measure-path').getAttribute('d')") == ""
    browser.key("Escape")
    assert browser.complaints == []


def test_two_points_are_measured_corners_attract_and_faces_have_an_angle(browser: Browser, bench: Running) -> None:
    opened(browser, bench, "measured.stl", stl(box(20.0, 30.0, 40.0)))
    browser.click("[data-view=corner]")
    browser.click("#fit")
    pixels(browser)
    browser.key("m")
    x, y = seen(browser, 10, -15, 0)
    browser.press(x + 2, y - 2)
    browser.press(*seen(browser, 10, -15, 39.8))
    browser.wait("!$('measure-told').hidden")
    assert browser.value("$('measure-told').textContent") == "40.00 mm\nΔX 0.00  ΔY 0.00  ΔZ 40.00"
    browser.press(*seen(browser, 0, -15, 20))  # the front
    browser.press(*seen(browser, 10, 0, 20))  # the right side
    browser.wait("$('measure-told').textContent.endsWith('faces at 90.0°')")
    browser.key("Escape")
    browser.wait("$('measure-told').hidden && $('measure-path').getAttribute('d') === ''")
    assert browser.complaints == []


def test_fit_keeps_the_direction_and_a_double_click_centres_on_the_point(browser: Browser, bench: Running) -> None:
    opened(browser, bench, "centred.stl", stl(box(20.0, 30.0, 40.0)))
    browser.value("{ view.camera.yaw = 0.3; view.camera.pitch = 0.2; }")
    browser.click("#fit")
    pixels(browser)
    assert browser.value("[view.camera.yaw, view.camera.pitch]") == [0.3, 0.2]
    x, y = seen(browser, 10, 3, 33)
    browser.value(f"$('canvas').dispatchEvent(new MouseEvent('dblclick', {{ clientX: {x}, clientY: {y} }}))")
    pixels(browser)
    assert seen(browser, 10, 3, 33) == pytest.approx(browser.middle("#canvas"), abs=0.5)


@pytest.mark.parametrize(("axis", "view"), [("z", "corner"), ("z", "top"), ("x", "side"), ("y", "front")])
def test_a_ring_turns_the_model_with_the_pointer(browser: Browser, bench: Running, axis: str, view: str) -> None:
    opened(browser, bench, f"{axis}-{view}.stl", stl(box(20.0, 30.0, 40.0)))
    browser.click("#tab-model")
    browser.click(f"[data-view={view}]")
    before = browser.value("document.documentElement.dataset.drawn")
    browser.click("#fit")
    browser.wait(f"document.documentElement.dataset.drawn > {before}")  # the rings with the model in view
    pixels(browser)
    (least, most), reach = browser.value(f"[view.picture.box(), 1.05 * {STORE}.triangles.reach_mm]")
    angles = radians([10, 30, 50, 70])  # away from the places where rings meet
    around = {
        "x": (0 * angles, cos(angles), sin(angles)),
        "y": (sin(angles), 0 * angles, cos(angles)),
        "z": (cos(angles), sin(angles), 0 * angles),
    }
    middle = [(low + high) / 2 for low, high in zip(least, most, strict=True)]
    start, *ways = (seen(browser, *(middle[k] + reach * place[k] for k in range(3))) for place in zip(*around[axis], strict=True))
    browser.hold(start, *ways)
    told = browser.value(f"document.querySelector('[data-ring={axis}]').ariaValueNow")
    browser.release(ways[-1])
    browser.wait(f"$('undo').ariaLabel === 'undo: turn the model' && {IDLE}")
    assert float(told) == pytest.approx(60, abs=3)
    assert browser.value(f"{STORE}.state.rotation")["xyz".index(axis) - 2]["xyz".index(axis) - 1] < -0.8  # -sin 60
    browser.click("#undo")
    browser.wait(f"{STORE}.state.rotation[0][0] === 1 && {IDLE}")


def test_parts_have_the_colours_of_the_legend_on_every_tab_also_single_limbs(browser: Browser, bench: Running) -> None:
    posts = [m3.Manifold.cube((8.0, 8.0, 40.0)).translate((x, 0.0, 0.0)) for x in (0.0, 32.0)]
    open_model(browser, bench, "two_posts.stl", stl(standing(m3.Manifold.cube((40.0, 8.0, 6.0)) + posts[0] + posts[1])))
    with bench.line() as page:
        page.do("add", normal=[0, 0, 1], offset_mm=20.0)
        page.until(lambda state: state["parts"] == 2)
        page.do("limb", part=2, point_mm=[16.0, 0.0, 40.0])
        page.until(lambda state: state["cuts"][0].get("limbs_mm"))
    for tab in ("slices", "settings", "printing"):
        browser.click(f"#tab-{tab}")
        browser.wait("$('legend').children.length === 3 && document.documentElement.dataset.pieces === '2'")
        drawn = pixels(browser).astype(int)
        coloured = (drawn[:, :, 0] - drawn[:, :, 2] > 100).mean()  # orange, the second part's
        assert coloured > 0.004, tab
    browser.click("#tab-model")
    browser.wait("$('legend').children.length === 0")
    assert browser.complaints == []
