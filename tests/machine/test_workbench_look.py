"""The look of the workbench's page: sizes, next steps, cards, the tools at a plane, menus and keys, in a real browser."""

import pytest

from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import QUICK, Running, workbench
from tests.machine.test_workbench_page import IDLE, drag_slider, open_model
from tests.shapes import box, tee

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

TABS = ("model", "parts", "slices", "printing", "settings")
# Visible texts that are smaller than 12 px.
TINY = """(() => { const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), small = [];
  for (let text = texts.nextNode(); text; text = texts.nextNode()) {
    const within = text.parentElement, size = parseFloat(getComputedStyle(within).fontSize);
    if (text.data.trim() && within.checkVisibility() && size < 12) small.push(within.id || within.className || within.tagName);
  }
  return small; })()"""
# Buttons in the colour of the next step.
MAIN = """[...document.querySelectorAll('#panel button')].filter((one) => one.checkVisibility() &&
  getComputedStyle(one).backgroundColor === getComputedStyle($('open')).backgroundColor).map((one) => one.id)"""
# How far the tools extend beyond the picture, px.
OUTSIDE = """(() => { const [a, b] = ['plane-tools', 'scene'].map((id) => $(id).getBoundingClientRect());
  return Math.max(b.left - a.left, b.top - a.top, a.right - b.right, a.bottom - b.bottom); })()"""
# Knobs of the plane that are covered by the tools or by another knob.
COVERED = """[...document.querySelectorAll('#handles button')].filter((knob) => { const a = knob.getBoundingClientRect();
  const over = (b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  const others = [...document.querySelectorAll('#plane-tools, #handles button')].filter((one) => one !== knob);
  return others.some((one) => over(one.getBoundingClientRect()));
}).map((knob) => knob.id)"""
# Pairs of elements over the picture that overlap.
OVERLAPS = """(() => { const seen = ['axes', 'tools', 'plane-tools', 'legend', 'notice'].filter((id) => $(id).checkVisibility());
  const boxes = seen.map((id) => [id, $(id).getBoundingClientRect()]).filter(([, box]) => box.width);
  return boxes.flatMap(([id, a], k) => boxes.slice(k + 1).filter(([, b]) => (
    a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)).map(([other]) => [id, other])); })()"""
UNDO = "$('undo').getAttribute('aria-label')"
SMALL = (900, 560)


def with_plane(browser: Browser, bench: Running) -> None:
    """A T with a level plane half way up, which is chosen."""
    open_model(browser, bench, "tee.stl", stl(tee()))
    browser.click("#tab-parts")
    browser.click("#add")
    browser.wait("$('plane-tools').checkVisibility() && $('plane-told').textContent")


def control(browser: Browser, key: str) -> None:
    """Press a key with Ctrl held."""
    browser.value(f"document.body.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', ctrlKey: true, bubbles: true }}))")


def test_the_start_card_opens_a_demo_by_its_picture(browser: Browser, bench: Running) -> None:
    browser.open(bench.address)
    browser.wait(f"document.documentElement.dataset.version && {IDLE}")
    assert browser.value("$('drop').checkVisibility()")
    assert browser.value("[...$('demos').querySelectorAll('img')].map((one) => one.naturalWidth)") == [136] * 4
    browser.value(
        "{ window.asked = 0; $('file').addEventListener('click', (event) => { event.preventDefault(); asked += 1; }); }"
    )
    browser.click("#open")
    control(browser, "o")
    assert browser.value("asked") == 2
    browser.click("[data-demo='demo:bracket']")
    browser.wait("$('title').textContent === 'demo:bracket' && !$('drop').checkVisibility()")


def test_earlier_work_is_offered_where_nothing_is_open_and_under_model_else(browser: Browser) -> None:
    with workbench(*QUICK) as own:
        with own.line() as page:
            page.do("demo", name="demo:bracket")
            page.until(lambda state: state["model"] and not state["busy"])
        root = own.place.rsplit("/", 2)[0]
        assert own.ask(f"{root}/benches/1", "DELETE", Origin=f"http://127.0.0.1:{own.port}")[0] == 200
        browser.open(f"http://127.0.0.1:{own.port}{root}/")
        browser.wait("$('drop').textContent.includes('demo:bracket') && $('kept-list').checkVisibility()")
        browser.click("#kept-list button")
        browser.wait("$('title').textContent === 'demo:bracket' && $('earlier-work').contains($('kept-field'))")


@pytest.mark.parametrize("size", [(1280, 800), (720, 900), (390, 844)])
def test_no_letter_is_small_and_one_button_is_the_next_step(browser: Browser, bench: Running, size: tuple[int, int]) -> None:
    browser.resize(*size)
    with_plane(browser, bench)
    seen = {}
    for tab in TABS:
        browser.click(f"#tab-{tab}")
        browser.wait("new Promise((drawn) => requestAnimationFrame(() => drawn(true)))")
        assert browser.value(TINY) == []
        seen[tab] = browser.value(MAIN)
        assert browser.value("document.documentElement.scrollWidth <= innerWidth")
    browser.resize(*SMALL)
    assert seen == {"model": ["slice"], "parts": ["slice"], "slices": ["slice"], "printing": ["check"], "settings": ["slice"]}


@pytest.mark.parametrize("size", [(720, 560), (390, 720)])
def test_axes_tools_notices_and_legend_of_a_small_picture_do_not_cover_one_another(
    browser: Browser, bench: Running, size: tuple[int, int]
) -> None:
    browser.resize(*size)
    with_plane(browser, bench)
    drag_slider(browser, "section-along", '"x"', "change")
    low = "{ view.camera.lookFrom(0, 0); $('fit').click(); view.camera.zoom(0.6); view.camera.pan(0, 0.4); view.picture.ask(); }"
    browser.value(low)
    browser.wait("$('plane-tools').getBoundingClientRect().top < $('hand-along').getBoundingClientRect().top")
    placed = browser.value(OVERLAPS)
    browser.click("[data-view=corner]")
    browser.click("#fit")
    browser.wait("$('plane-tools').getBoundingClientRect().top > $('hand-along').getBoundingClientRect().top")
    browser.value("modules['template/elements'].notice('a notice that is longer than one line of a small picture', 'test')")
    noticed = browser.value(OVERLAPS)
    browser.click("#tab-printing")
    printing = browser.value(OVERLAPS)
    browser.resize(*SMALL)
    browser.value("modules['template/elements'].notice('', 'test')")
    drag_slider(browser, "section-along", '""', "change")
    assert (placed, noticed, printing) == ([], [], [])


def test_settings_are_as_narrow_as_a_window_that_becomes_narrow(browser: Browser, bench: Running) -> None:
    browser.resize(720, 900)
    browser.open(bench.address)
    browser.click("#tab-settings")
    browser.wait("document.querySelectorAll('[data-key]').length > 10")
    drawn = "new Promise((drawn) => setTimeout(() => drawn(true), 100))"
    browser.wait(drawn)
    browser.click("#tab-model")
    browser.resize(390, 844)
    browser.click("#tab-settings")
    browser.wait(drawn)
    assert browser.value("$('settings').scrollWidth <= $('settings').clientWidth")
    browser.resize(*SMALL)


def test_a_tool_for_the_whole_model_puts_parts_together_and_ends_when_they_are_apart(browser: Browser, bench: Running) -> None:
    with_plane(browser, bench)
    state = "[$('apart').value, $('measure').getAttribute('aria-pressed')]"
    drag_slider(browser, "apart", 0.3, "input")
    browser.click("#measure")
    assert browser.value(state) == ["0", "true"]
    drag_slider(browser, "apart", 0.3, "input")
    assert browser.value(state) == ["0.3", "false"]


def test_a_part_has_a_card_that_the_keyboard_chooses_and_locks(browser: Browser, bench: Running) -> None:
    with_plane(browser, bench)
    browser.wait("$('parts-list').textContent.includes('breaks at about')")
    card = browser.value("$('parts-list').children[1].innerText").split("\n")
    assert card[:2] == ["Part 2", "straight up"]
    assert card[2:8] == ["volume", "5.00 cm³", "support", "300 mm²", "seam", "40 mm"]
    browser.value("document.querySelector('#parts-list [value=\"2\"]').focus()")
    browser.value("document.querySelector('#parts-list [value=\"1\"]').click()")  # as an arrow key does
    assert browser.value("document.activeElement.value") == "1"
    assert not browser.value("$('plane-tools').checkVisibility()")
    browser.click("#parts-list [value='2']")
    browser.value("document.querySelector('.card .lock').focus()")
    browser.click(".card .lock")
    browser.wait("$('lock').getAttribute('aria-pressed') === 'true'")
    assert browser.value("[document.activeElement.name, document.activeElement.checked]") == ["lock-2", True]
    assert browser.value("$('plane-offset').disabled && $('remove').disabled && !$('lock').disabled")
    browser.click("#lock")
    browser.wait("!document.querySelector('.card .lock').checked && !$('remove').disabled")


@pytest.mark.parametrize("size", [SMALL, (720, 900), (390, 844)])
def test_the_plane_tools_are_in_the_picture_hide_no_handle_and_say_why_a_plane_is_refused(
    browser: Browser, bench: Running, size: tuple[int, int]
) -> None:
    browser.resize(*size)
    with_plane(browser, bench)
    for view in ("front", "top", "corner"):
        browser.click(f"[data-view={view}]")
        browser.click("#fit")
        browser.wait(f"{OUTSIDE} <= 0 && {COVERED}.length === 0")
    drag_slider(browser, "plane-offset", 39.95, "change")
    browser.wait("$('plane-told').classList.contains('refused') && $('put-near').checkVisibility()")
    assert not browser.value("$('problem').checkVisibility()")  # it is reported only once
    browser.wait(f"{OUTSIDE} <= 0 && {COVERED}.length === 0")
    browser.click("#put-aside")
    browser.wait("!$('plane-told').classList.contains('refused') && !$('put-near').checkVisibility()")
    browser.resize(*SMALL)


def test_a_refusal_ends_when_another_part_is_chosen(browser: Browser, bench: Running) -> None:
    with_plane(browser, bench)
    drag_slider(browser, "plane-offset", 39.95, "change")
    browser.wait("$('plane-told').classList.contains('refused')")
    browser.click("#parts-list [value='1']")
    browser.wait("!modules['page/store'].store.state.refused && $('problem').hidden")
    browser.click("#parts-list [value='2']")
    assert not browser.value("$('plane-told').classList.contains('refused') || $('put-near').checkVisibility()")


def test_the_list_of_steps_undoes_and_redoes_several_at_once(browser: Browser, bench: Running) -> None:
    with_plane(browser, bench)
    drag_slider(browser, "plane-offset", 22, "change")
    browser.wait(f"{UNDO} === 'undo: move a plane'")
    browser.click("#history")
    steps = "[...$('history-menu').children].map((one) => one.textContent)"
    assert browser.value(f"{steps}.slice(0, 4)") == ["now", "move a plane", "add a plane", "open tee.stl"]
    browser.click("#history-menu button:nth-child(3)")
    browser.wait(f"{UNDO} === 'undo: open tee.stl'")
    assert not browser.value("document.querySelector(':popover-open')")
    assert browser.value(f"{steps}.slice(0, 3)") == ["move a plane", "add a plane", "now"]
    browser.click("#history")
    browser.press(200, 300)
    assert not browser.value("document.querySelector(':popover-open')")
    browser.click("#history-menu button:first-child")
    browser.wait(f"{UNDO} === 'undo: move a plane' && $('redo').disabled")


def test_a_key_slices_the_preview_opens_by_itself_and_a_key_saves(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "post.stl", stl(box(8.0, 8.0, 4.0)))
    browser.click("#tab-model")
    control(browser, "r")
    browser.wait("document.body.classList.contains('looking') && !$('print-page').hidden")
    assert browser.value("$('tab-slices').getAttribute('aria-selected')") == "true"
    browser.value(
        "{ const make = URL.createObjectURL; URL.createObjectURL = (one) => { window.saved = one; return make(one); }; }"
    )
    control(browser, "g")
    browser.wait("window.saved && $('notice').textContent === 'saved post.gcode'")
    browser.click("#leave-print")
    assert browser.value(MAIN) == ["verdict-print"]
