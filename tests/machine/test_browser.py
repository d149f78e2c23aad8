"""The page of a print in a real browser: screen reader output, drawing, mouse, keys and a hostile file name."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from machine.dryrun.dryrun import dry_run
from machine.link.print_state import PrintState, PrintStatus
from machine.link.protocol.events import Temperature
from machine.program import Program
from machine.view.page import parts_page, print_page
from machine.view.serving.watch_page import serve
from mdp.decomposition import FrontRow
from mdp.plane import Plane
from profiles.profile import load
from tests.machine import hand
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.conftest import WINDOW, small_browser

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

HOSTILE = "</title></script><img src=x onerror=hit=1><script>hit=1</script>.gcode"
FOREIGN = """G28
G1 Z0.3 F600
G1 X0 Y0 F6000
G1 X30 Y0 E2 F1200
G1 X30 Y30 E4
M106 S128
G1 Z0.6
G1 X0 Y30 E6 F2400
G1 X0 Y0 E8
M106 S255
G1 X30 Y30 E9
"""
# The canvas right after the page has drawn it: in the same frame, because it is empty afterwards.
PICTURE = """new Promise((done) => {
  const look = () => {
    if (document.documentElement.dataset.picture !== 'idle') return setTimeout(look, 5);
    document.getElementById('position').dispatchEvent(new Event('input'));
    requestAnimationFrame(() => done(document.getElementById('canvas').toDataURL()));
  };
  look();
})"""
# Calls a function while a picture is being drawn.
WHILE_DRAWN = """((then) => {
  const root = document.documentElement;
  const seen = new MutationObserver(() => { if (root.dataset.picture === 'drawing') { seen.disconnect(); then(); } });
  seen.observe(root, { attributeFilter: ['data-picture'] });
  document.getElementById('position').dispatchEvent(new Event('input'));
})"""
# Pixels of such a picture in the red of risky faces.
REDS = f"""{PICTURE}.then(async (address) => {{
  const picture = new Image(), copy = document.createElement('canvas'), pen = copy.getContext('2d');
  picture.src = address;
  await picture.decode();
  [copy.width, copy.height] = [picture.width, picture.height];
  pen.drawImage(picture, 0, 0);
  const seen = pen.getImageData(0, 0, copy.width, copy.height).data;
  let count = 0;
  for (let k = 0; k < seen.length; k += 4) if (seen[k] > 40 && seen[k] > 3 * seen[k + 1] && seen[k] > 3 * seen[k + 2]) count++;
  return count;
}})"""


@cache
def program(machine: str = "generic_ac") -> tuple[Any, Program]:
    """The post and the arm, dry-run: the arm begins in air, which is reported."""
    profile, decomposition, _, _ = hand.printed(machine)
    lines = hand.text(machine)
    return profile, Program(lines, dry_run(lines, profile), decomposition)


@pytest.fixture
def page(browser: Browser, tmp_path: Path) -> Browser:
    """The post and the arm, opened as a file."""
    profile, printed = program()
    return opened(browser, tmp_path, print_page("post and arm", printed, profile))


@pytest.fixture
def foreign(browser: Browser, tmp_path: Path) -> Browser:
    """A file of another program without comments, under a hostile name."""
    profile, lines = load(), tuple(FOREIGN.splitlines())
    return opened(browser, tmp_path, print_page(HOSTILE, Program(lines, dry_run(lines, profile), None), profile, known=False))


def opened(browser: Browser, folder: Path, content: bytes) -> Browser:
    file = folder / "page.html"
    file.write_bytes(content)
    browser.prefer("light")
    browser.resize(*WINDOW)
    browser.open(file.as_uri())
    return browser


def put(browser: Browser, name: str, value: object) -> None:
    """Set a slider or a list to a value, as the user does."""
    browser.value(
        f"(() => {{ const e = document.getElementById('{name}'); e.value = '{value}';"
        "e.dispatchEvent(new Event(e.tagName === 'SELECT' ? 'change' : 'input')); })()"
    )


def text(browser: Browser, name: str) -> str:
    return str(browser.value(f"document.getElementById('{name}').textContent"))


def row(browser: Browser) -> int:
    return int(browser.value("Number(document.getElementById('position').value)"))


def drawn(browser: Browser) -> int:
    """The number of rows in the picture, once it is drawn."""
    browser.value(PICTURE)
    return int(browser.value("Number(document.documentElement.dataset.drawn)"))


def test_the_page_opens_from_a_file_without_a_complaint_and_asks_for_nothing(page: Browser) -> None:
    assert page.complaints == []
    assert page.requests == [page.value("location.href")]
    assert page.value("document.documentElement.dataset.state") == "ready"


def test_readouts_are_the_numbers_of_the_dry_run(page: Browser) -> None:
    read = program()[1].run.program
    names = ("line", "x", "y", "z", "tilt", "turn", "e", "part", "layer")
    for k in (0, 7, 23, 44, 61, 75, len(read.line) - 1):
        put(page, "position", k)
        places = [f"{value:.3f}" for value in [*(read.end[k] + 0.0), read.filament_mm[k]]]
        expected = [str(read.line[k]), *places, *(str(number or "–") for number in (read.part[k], read.layer[k]))]
        assert [text(page, f"readout-{name}") for name in names] == expected


def test_an_extruding_row_shows_its_type_bead_and_speed(page: Browser) -> None:
    read = program()[1].run.program
    k = int((read.e_mm > 0).nonzero()[0][5])
    put(page, "position", k)
    assert text(page, "readout-type") == read.types[read.type[k]]
    assert text(page, "readout-size") == f"{read.width_mm[k]:.2f} × {read.height_mm[k]:.2f}"
    assert text(page, "readout-speed") == f"{read.feed[k] / 60:.1f} mm/s"


def test_the_same_choice_gives_the_same_picture(page: Browser) -> None:
    assert page.value(PICTURE) == page.value(PICTURE)


def test_each_toggle_changes_the_picture_and_back(page: Browser) -> None:
    before = page.value(PICTURE)
    for name in ("beads", "travels", "retractions", "seams", "machine", "planes", "directions"):
        page.click(f"#show-{name}")
        assert page.value(PICTURE) != before, name
        page.click(f"#show-{name}")
        assert page.value(PICTURE) == before, name


def test_a_section_takes_beads_away_on_either_side_of_it_and_clicks_go_through(page: Browser) -> None:
    before = page.value(PICTURE)
    put(page, "section-along", "z")
    below = page.value(PICTURE)
    page.click("#section-flip")
    above = page.value(PICTURE)
    assert len({before, below, above}) == 3
    put(page, "section-at", -100)
    page.click("#section-flip")
    page.value(PICTURE)
    last = row(page)
    canvas = "document.getElementById('canvas').getBoundingClientRect()"
    x, y = page.value(f"(({{ x, y, width, height }}) => [x + width / 2, y + height / 2])({canvas})")
    page.press(x, y)  # no bead is left at this point
    assert row(page) == last
    put(page, "section-along", "")
    assert page.value(PICTURE) == before


def test_every_colouring_gives_another_picture(foreign: Browser) -> None:
    pictures = set()
    for mode in ("part", "kind", "speed", "layer", "flow", "fan"):
        put(foreign, "colour-by", mode)
        pictures.add(foreign.value(PICTURE))
    assert len(pictures) == 6
    assert text(foreign, "legend").startswith("fan, %")
    foreign.value("localStorage.clear()")


def test_beads_are_coloured_by_line_type_until_a_choice_is_made_which_holds_for_the_next_print(
    page: Browser, tmp_path: Path
) -> None:
    assert text(page, "legend").startswith("line type")
    put(page, "colour-by", "speed")
    profile, printed = program()
    opened(page, tmp_path, print_page("the same again", printed, profile))
    assert page.value("document.getElementById('colour-by').value") == "speed"
    assert text(page, "legend").startswith("speed, mm/s")
    page.value("localStorage.setItem('colour by', JSON.stringify({ mode: 'a colouring of an older page' }))")
    opened(page, tmp_path, print_page("the same again", printed, profile))
    page.value("localStorage.clear()")
    assert page.value("document.getElementById('colour-by').value") == "kind"


def test_a_kind_of_line_can_be_left_out(page: Browser) -> None:
    before = page.value(PICTURE)
    page.click("#types input")
    assert page.value(PICTURE) != before


def test_the_slider_limits_what_is_drawn(page: Browser) -> None:
    put(page, "position", 20)
    assert drawn(page) == 21


def test_layers_of_one_part_are_drawn_between_the_two_handles(page: Browser) -> None:
    read = program()[1].run.program
    put(page, "others", "hide")
    put(page, "part", 2)
    put(page, "layer-low", 1)
    put(page, "layer-high", 1)
    assert drawn(page) == ((read.part == 2) & (read.layer == 2)).sum()


def test_other_parts_are_shown_or_hidden(page: Browser) -> None:
    put(page, "part", 2)
    all_shown = drawn(page)
    put(page, "others", "hide")
    assert 0 < drawn(page) < all_shown == len(program()[1].run.program.line)


def test_the_workpiece_frame_shows_the_same_row_from_another_pose(page: Browser) -> None:
    turned = int((abs(program()[1].run.program.end[:, 3]) > 30).nonzero()[0][10])
    put(page, "position", turned)
    before, read = page.value(PICTURE), text(page, "readout-x")
    put(page, "frame", "workpiece")
    assert page.value(PICTURE) != before
    assert text(page, "readout-x") == read


def test_residual_faces_are_red_and_may_be_left_plain(browser: Browser, tmp_path: Path) -> None:
    profile, decomposition, _, _ = hand.printed()
    page = opened(browser, tmp_path, parts_page(decomposition, profile))
    assert page.complaints == []
    page.click("#show-machine")
    page.drag((300, 300), (300, 100))  # seen from below
    put(page, "risky", "none")
    plain = page.value(REDS)
    put(page, "risky", "straight")
    assert page.value(REDS) > plain + 100


def test_parts_are_drawn_apart_and_the_table_is_posed_as_for_one(browser: Browser, tmp_path: Path) -> None:
    profile, decomposition, _, _ = hand.printed()
    page = opened(browser, tmp_path, parts_page(decomposition, profile))
    together = page.value(PICTURE)
    put(page, "apart", 0.3)
    apart = page.value(PICTURE)
    put(page, "stand", 2)
    assert len({together, apart, page.value(PICTURE)}) == 3


@pytest.fixture
def choices(browser: Browser, tmp_path: Path) -> Browser:
    """The post and the arm with a front of three rows: whole, as they are, and with one more cut of the post."""
    profile, decomposition, _, _ = hand.printed()
    post = Plane(np.array([0.0, 0.0, 1.0]), 30.0)
    front = (
        FrontRow((), 100.0, 0.0, 130.0, stairs_mm2=30.4),
        FrontRow((hand.SIDE,), 0.0, 40.0, 24.0, chosen=True, time_s=4000.0, filament_mm=1234.0, reason="for the lowest cost"),
        FrontRow((hand.SIDE, post), 0.0, 80.0, 48.0),
    )
    return opened(browser, tmp_path, parts_page(replace(decomposition, front=front), profile))


def test_the_front_is_shown_with_dashes_where_nothing_is_estimated(choices: Browser) -> None:
    lines = choices.value(
        "[...document.querySelectorAll('#front tbody tr')].map((line) => [...line.cells].map((c) => c.textContent))"
    )
    assert lines[0] == ["1", "100", "0", "30.4", "–", "–"]
    assert lines[1] == ["2✓", "0.0", "40", "0.0", "1h 7m", "1.2"]
    assert text(choices, "front-told") == "✓ chosen for the lowest cost."


def test_another_row_of_the_front_shows_its_cuts_and_the_command_by_the_keyboard_alone(choices: Browser) -> None:
    before = choices.value(PICTURE)
    choices.value("document.querySelector('#front :checked').focus()")
    choices.key("ArrowDown")
    assert "tiltprint decompose 'post and arm' --parts 3" in text(choices, "front-told")
    assert text(choices, "legend") == "as 3 parts123"
    assert choices.value(PICTURE) != before
    choices.key("ArrowUp")
    assert choices.value(PICTURE) == before
    assert choices.complaints == []


def test_the_cuts_of_another_row_take_the_place_of_the_beads(browser: Browser, tmp_path: Path) -> None:
    profile, printed = program()
    assert printed.decomposition is not None
    front = (FrontRow((), 100.0, 0.0, 100.0), FrontRow((hand.SIDE,), 0.0, 40.0, 24.0, chosen=True))
    page = opened(
        browser,
        tmp_path,
        print_page("post", replace(printed, decomposition=replace(printed.decomposition, front=front)), profile),
    )
    before = page.value(PICTURE)
    page.click("#front tbody tr:first-child")
    whole = page.value(PICTURE)
    page.click("#show-beads")
    assert page.value(PICTURE) == whole != before


def test_no_front_is_shown_without_a_choice(page: Browser) -> None:
    assert page.value("document.getElementById('front-field').hidden")


def test_a_click_on_the_marker_of_a_finding_jumps_to_its_line(page: Browser) -> None:
    finding = program()[1].run.findings[0]
    put(page, "position", 0)
    page.value(PICTURE)  # markers appear with the first picture
    page.click("#markers button")
    assert text(page, "readout-line") == str(finding.line)
    assert page.value("document.querySelector('#findings .chosen').textContent").startswith(f"error: {finding.code}")
    assert finding.message in text(page, "findings")


def test_findings_at_one_place_share_a_marker_that_steps_through_them(browser: Browser, tmp_path: Path) -> None:
    profile, printed = program()
    finding = printed.run.findings[0]
    crowd = tuple(replace(finding, message=f"complaint {k}") for k in range(400))
    page = opened(browser, tmp_path, print_page("crowd", replace(printed, run=replace(printed.run, findings=crowd)), profile))
    page.value(PICTURE)
    assert page.value("[...document.querySelectorAll('#markers button')].map((e) => e.textContent)") == ["99+"]
    for message in ("complaint 0", "complaint 1"):
        page.click("#markers button")
        assert message in page.value("document.querySelector('#findings .chosen').textContent")


def test_a_hostile_name_is_only_text(foreign: Browser) -> None:
    assert text(foreign, "title") == HOSTILE
    assert foreign.value("document.title") == HOSTILE
    assert foreign.value("typeof hit") == "undefined"
    assert foreign.value("document.images.length") == 0
    assert foreign.complaints == []


def test_a_file_without_comments_is_shown_with_what_is_known(foreign: Browser) -> None:
    assert text(foreign, "readout-layer") == "2"
    assert foreign.value("document.getElementById('show-machine').checked") is False
    assert foreign.value("getComputedStyle(document.querySelector('.solids')).display") == "none"


def test_playing_continues_until_it_is_paused(page: Browser) -> None:
    put(page, "position", 3)
    put(page, "speed", 5)
    page.click("#play")
    page.wait("Number(document.getElementById('position').value) > 3")
    page.click("#play")
    paused = row(page)
    page.value(PICTURE)
    assert row(page) == paused


def test_playing_ends_at_the_end(page: Browser) -> None:
    put(page, "position", 60)
    put(page, "speed", 1000)
    page.click("#play")
    page.wait("document.getElementById('play').getAttribute('aria-label') === 'Play'")
    assert row(page) == len(program()[1].run.program.line) - 1


def test_keys_step_turn_and_choose(page: Browser) -> None:
    put(page, "position", 40)
    page.key(".")
    assert row(page) == 41
    before = page.value(PICTURE)
    page.key("ArrowLeft")
    assert page.value(PICTURE) != before
    page.key("t")
    assert page.value("document.getElementById('show-travels').checked") is True
    layer = int(page.value("document.getElementById('layer-high').value"))
    page.key("[")
    assert page.value("Number(document.getElementById('layer-high').value)") == layer - 1


def test_dragging_turns_and_the_wheel_zooms(page: Browser) -> None:
    before = page.value(PICTURE)
    page.drag((300, 300), (400, 320))
    turned = page.value(PICTURE)
    page.value("document.getElementById('canvas').dispatchEvent(new WheelEvent('wheel', {deltaY: -200, cancelable: true}))")
    assert len({before, turned, page.value(PICTURE)}) == 3


def test_one_finger_turns_and_two_fingers_zoom(page: Browser) -> None:
    before = page.value(PICTURE)
    page.touch(((300, 300),), ((360, 320),))
    turned = page.value(PICTURE)
    page.touch(((300, 300), (340, 340)), ((260, 260), (380, 380)))
    assert len({before, turned, page.value(PICTURE)}) == 3


def test_a_click_on_a_bead_jumps_to_its_row(page: Browser) -> None:
    put(page, "part", 2)
    put(page, "model", "hide")
    page.click("#fit")
    last = row(page)
    for x, y in ((x, y) for y in range(80, 500, 8) for x in range(220, 540, 8)):
        page.press(x, y)
        if row(page) != last:
            break
    assert 0 < row(page) < last
    assert text(page, "readout-type") in ("External perimeter", "Perimeter")


def test_dark_and_light_follow_the_system_until_the_user_chooses(page: Browser) -> None:
    page.prefer("dark")
    page.wait("document.documentElement.dataset.theme === 'dark'")
    dark = page.value("getComputedStyle(document.body).backgroundColor")
    page.click("#theme")
    assert page.value("document.documentElement.dataset.theme") == "light"
    assert page.value("getComputedStyle(document.body).backgroundColor") != dark


def test_the_page_fits_a_telephone(page: Browser) -> None:
    page.resize(360, 740, mobile=True)
    assert page.value("document.scrollingElement.scrollWidth") <= 360
    assert drawn(page) > 0


def test_the_picture_returns_after_the_graphics_card_has_let_go_of_it(page: Browser) -> None:
    before = page.value(PICTURE)
    page.value("window.card = document.getElementById('canvas').getContext('webgl2').getExtension('WEBGL_lose_context')")
    page.value(f"new Promise((done) => {{ {WHILE_DRAWN}(() => {{ card.loseContext(); done(); }}); }})")
    page.wait("document.documentElement.dataset.picture === 'idle' && !document.getElementById('notice').hidden")
    page.value("card.restoreContext()")
    page.wait("document.getElementById('notice').hidden")
    page.wait(f"{PICTURE}.then((now) => now === {json.dumps(before)})")
    page.complaints.clear()


def test_the_picture_keeps_its_width_when_the_report_is_opened(page: Browser) -> None:
    page.resize(1440, 600)
    width = "document.getElementById('canvas').clientWidth"
    before = page.value(width)
    page.click("#tab-report")
    assert page.value(width) == before
    assert page.value("[...document.querySelectorAll('#report .table')].every((table) => table.tabIndex === 0)")  # may scroll


def test_the_report_holds_every_part_and_is_printed_with_the_picture(page: Browser) -> None:
    assert page.value("document.querySelectorAll('#report-text section')[0].querySelectorAll('tbody tr').length") == 2
    assert "External perimeter" in text(page, "report-text")
    page.value("dispatchEvent(new Event('beforeprint'))")
    assert page.value("document.getElementById('picture').width === document.getElementById('canvas').width")
    assert page.pdf().startswith(b"%PDF")


def test_without_webgl_the_report_and_the_reason_are_shown(tmp_path: Path) -> None:
    profile, printed = program()
    with small_browser("--disable-3d-apis") as blind:
        opened(blind, tmp_path, print_page("post and arm", printed, profile))
        assert "no WebGL2" in text(blind, "notice")
        assert blind.value("document.getElementById('report').offsetHeight") > 100


def test_a_running_print_is_followed(browser: Browser, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.view.serving.watch_page.LAST_WORD_S", 0.0)
    profile, printed = program()
    line = int(printed.run.program.line[40])
    heat = Temperature(nozzle_c=209.6, nozzle_target_c=210.0)
    now = PrintStatus(
        sent=60, acknowledged=50, total=100, elapsed_s=10.0, left_s=61.0, share=0.5,
        temperature=heat, part=2, parts=2, layer=7, file_line=line,
    )  # fmt: skip
    with serve(print_page("post and arm", printed, profile, live=True)) as watched:
        watched.follow(now)
        browser.open(watched.address)
        browser.wait("Number(document.getElementById('position').value) === 40")
        assert text(browser, "live").startswith(f"printing, 50 % · line {line} · nozzle 210 of 210 °C")
        assert "as last known" not in text(browser, "live")
        assert {address.rsplit("/", 1)[1] for address in browser.requests} == {"", "state"}
        assert browser.complaints == []
        watched.end(PrintState.CANCELLED)
        browser.wait("document.getElementById('live').textContent.includes('nozzle 210 of 210 °C · as last known')")
