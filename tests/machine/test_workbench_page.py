"""The workbench in a real browser: from a file to a saved plan that the command line cuts into the same parts."""

import json
from pathlib import Path

import pytest

from machine.cli.cli import main
from mdp.mesh import Mesh
from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.conftest import small_browser
from tests.machine.firefox import Firefox
from tests.machine.running_workbench import QUICK, Running, workbench
from tests.shapes import ball, tee

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

FOUND = "!document.documentElement.hasAttribute('data-searching') && !document.body.classList.contains('no-cuts')"
SHARES_DRAWN = """[...$('laid').querySelectorAll('canvas')].map((canvas) => {
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  return data.filter((_, k) => k % 4 === 3).reduce((sum, alpha) => sum + (alpha > 0), 0) / (canvas.width * canvas.height); })"""
UNITS = ["in metres", "in inches", "in centimetres"]  # units that give it a printable size, the likeliest first
IDLE = "document.documentElement.dataset.busy === ''"


def choose(browser: "Browser | Firefox", name: str, content: bytes, field: str = "file") -> None:
    """Choose a file as the user does and wait until it is shown."""
    browser.value(
        f"""{{ const bytes = Uint8Array.from({list(content)}), chosen = new DataTransfer();
        chosen.items.add(new File([bytes], {json.dumps(name)}));
        document.documentElement.dataset.shown = '';
        $('{field}').files = chosen.files;
        $('{field}').dispatchEvent(new Event('change')); }}"""
    )


def open_model(browser: Browser, bench: Running, name: str, content: bytes) -> None:
    browser.open(bench.address)
    browser.wait(f"document.documentElement.dataset.version && {IDLE}")  # the present bench is shown completely
    key = "modules['page/store'].store.state.model?.key"
    before = browser.value(f"{key} || ''")
    choose(browser, name, content)
    opened = f"{key} !== {json.dumps(before)} && $('undo').ariaLabel.startsWith('undo: open')"
    browser.wait(f"document.documentElement.dataset.shown === {key} && {opened} && {IDLE}")


def saved(browser: Browser | Firefox, button: str) -> str:
    """The text that a button saves."""
    browser.value(
        "{ window.saved = null; const make = URL.createObjectURL; "
        "URL.createObjectURL = (blob) => { window.saved = blob; return make(blob); }; }"
    )
    browser.click(button)
    browser.wait("window.saved")
    text: str = browser.value("window.saved.text()")
    return text


def find_as_it_lies(browser: Browser | Firefox) -> None:
    """Find parts without changing the orientation."""
    browser.click("#tab-parts")
    browser.value("$('orient').checked = false")
    browser.click("#find")
    browser.wait(FOUND)


def area(browser: Browser) -> float:
    return float(browser.value("$('overhang').textContent").removesuffix(" mm²"))


def drag_slider(browser: Browser, slider: str, value: float | str, event: str) -> None:
    browser.value(f"{{ $('{slider}').value = {value}; $('{slider}').dispatchEvent(new Event('{event}')); }}")


def test_a_file_becomes_a_plan_that_the_command_line_cuts_to_the_same_parts(
    browser: Browser, bench: Running, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("tee.stl").write_bytes(stl(tee()))
    open_model(browser, bench, "tee.stl", Path("tee.stl").read_bytes())
    assert "40.0 × 10.0 × 40.0 mm" in browser.value("$('model-told').textContent")
    find_as_it_lies(browser)
    parts = int(browser.value("$('front-told').querySelector('dd').textContent").split()[0])
    assert "recommended" in browser.value("$('front-told').textContent")
    Path("plan.toml").write_text(saved(browser, "#save-plan"))
    assert main(["decompose", "tee.stl", *QUICK, "--plan", "plan.toml", "--json", "by-plan.json"]) == 0
    assert main(["decompose", "tee.stl", *QUICK, "--as-is", "--json", "searched.json"]) == 0
    by_plan, searched = (json.loads(Path(name).read_text())["parts"] for name in ("by-plan.json", "searched.json"))
    assert (len(by_plan), by_plan) == (parts, searched)
    assert parts > 1
    assert browser.complaints == []
    assert all(address.startswith((bench.address.rsplit("/", 2)[0], "data:", "blob:", "ws:")) for address in browser.requests)


def test_another_row_of_the_front_is_shown_at_once_and_taken_when_the_slider_is_let_go(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee()))
    find_as_it_lies(browser)
    assert browser.value("$('legend').textContent") != ""
    drag_slider(browser, "front", 0, "input")
    assert browser.value("$('front-told').querySelector('dd').textContent") == "1"
    with bench.line() as second_page:  # its changes move neither the slider nor the picture that the user drags
        second_page.do("set", key="process.infill_density", value="1")
        second_page.until(lambda state: not state["priced"])
        priced = second_page.until(lambda state: state["priced"])
        browser.wait(f"Number(document.documentElement.dataset.version) >= {priced['version']}")
    assert browser.value("$('front').value") == "0"
    metres = f"{priced['front'][0]['filament_mm'] / 1000:.1f} m"
    assert browser.value("$('front-told').textContent").endswith(f"plastic{metres}")
    assert browser.value("$('legend').querySelectorAll('span.swatch').length") == 1
    sent = "function (text) { sending.call(this, text.replace('\"parts\":1', '\"parts\":99')); }"
    browser.value(f"window.sending = WebSocket.prototype.send; WebSocket.prototype.send = {sent}")
    drag_slider(browser, "front", 0, "change")
    browser.wait("$('problem').textContent.startsWith('parts is 99: ') && $('front').value === $('front').max")
    browser.value("{ WebSocket.prototype.send = sending; }")
    drag_slider(browser, "front", 0, "change")
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: take another number of parts'")
    browser.key("1")  # it selects a view, not a step
    browser.click("#undo")
    browser.wait("$('front').value === $('front').max && !$('redo').disabled")
    note = "{ text: 'one part would do', parts: 1 }"
    noted = f"modules['page/store'].update({{ state: {{ ...modules['page/store'].store.state, notes: [{note}] }} }})"
    words = "$('front-notes').innerText"
    words = browser.value(f"({noted}, [{words}, $('front-notes').querySelector('button').click()][0])")  # before other updates
    assert words.split("\n")[-1].endswith("Choose 1 part")
    browser.wait("$('front').value === '0' && $('undo').ariaLabel === 'undo: take another number of parts'")
    browser.click("#undo")
    browser.wait("$('front').value === $('front').max && !$('redo').disabled")
    assert "oriented on" not in browser.value("$('front-notes').textContent")
    with bench.line() as second_page:
        second_page.do("set", key="search.seam_mm", value="100")  # too expensive to cut
        second_page.until(lambda state: state["undo"] == "set Width of a seam's blemish" and not state["busy"])
    browser.click("#orient")
    browser.value("$('ranker').value = 'learned'")
    browser.click("#find")
    browser.wait("$('front-notes').textContent.includes('oriented on its front (turned 90 about x): in one piece')")
    assert browser.value("$('laid').textContent") == "as it stoodas it lies now"
    browser.wait(f"{SHARES_DRAWN}.every((share) => share > 0.05 && share < 0.9)")  # of both small pictures
    browser.click("#undo")
    browser.wait("!$('laid').checkVisibility()")
    with bench.line() as second_page:
        second_page.do("set", key="search.seam_mm", value="0.8")
        second_page.until(lambda state: state["undo"] == "set Width of a seam's blemish" and not state["busy"])


def test_red_follows_the_model_while_it_turns_and_the_server_says_the_same(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "ball.stl", stl(ball(30.0, 320)))  # 51,200 faces
    browser.click("#tab-model")
    before = area(browser)
    drag_slider(browser, "turn-x", 90, "input")
    live = area(browser)
    took = [float(browser.value("document.documentElement.dataset.liveMs"))]
    for angle in range(91, 101):
        drag_slider(browser, "turn-x", angle, "input")
        took.append(float(browser.value("document.documentElement.dataset.liveMs")))
    assert min(took) < 50.0  # ms; the others may have waited for a busy machine
    drag_slider(browser, "turn-x", 90, "input")
    drag_slider(browser, "turn-x", 90, "change")
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: lay the model down' && $('turn-x').value === '0'")
    assert area(browser) == pytest.approx(live, abs=0.2)
    assert before > 500.0


def test_a_model_of_an_implausible_size_is_opened_in_the_unit_that_the_user_chooses(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee()))
    choose(browser, "tiny.stl", stl(Mesh(tee().vertices * 0.004, tee().faces)))
    browser.wait("$('units').childElementCount === 3")
    question = "tiny.stl: its largest extent is 0.16 mm, less than 1 mm: which unit are its coordinates in?"
    assert browser.value("$('problem').textContent") == question
    assert browser.value("[...$('units').children].map((button) => button.textContent)") == UNITS
    browser.click("#units button")
    browser.wait("$('title').textContent === 'tiny.stl' && $('scale').value === '100000' && $('size-z').value === '160.00'")
    assert browser.value("$('problem').hidden && !$('remedies').childElementCount")
    browser.click("#undo")
    browser.wait("$('title').textContent === 'tee.stl' && $('scale').value === '100'")


def test_a_small_model_has_a_button_that_takes_its_coordinates_as_inches(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "small.stl", stl(Mesh(tee().vertices / 25.4, tee().faces)))
    assert "its longest side is 1.57 mm: if its coordinates are inches" in browser.value("$('model-notes').textContent")
    assert browser.value("$('remedies').textContent") == "Set Scale of the model to 2540 %"
    browser.click("#remedies button")
    browser.wait("$('size-z').value === '40.00' && !$('remedies').childElementCount")


def test_a_slow_upload_shows_its_progress_and_can_be_cancelled(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee()))
    slowly = {"offline": False, "latency": 0, "downloadThroughput": -1}
    browser._send("Network.emulateNetworkConditions", **slowly, uploadThroughput=100_000)
    try:
        browser.value(
            """{ const chosen = new DataTransfer();
            chosen.items.add(new File([new Uint8Array(3e6)], "large.stl"));
            $('file').files = chosen.files;
            $('file').dispatchEvent(new Event('change')); }"""
        )
        browser.wait("!$('sending').hidden && $('sending-bar').value > 0")
        assert browser.value("/^Sending large.stl: [0-9.]+ of 3.0 MB$/.test($('sending-told').textContent)")
        browser.click("#sending-cancel")
        browser.wait("$('sending').hidden")
    finally:
        browser._send("Network.emulateNetworkConditions", **slowly, uploadThroughput=-1)
    assert browser.value("[$('title').textContent, $('problem').hidden]") == ["tee.stl", True]


LEFT = [(n, f"{'abcdefga'[n]}.stl") for n in range(8)]  # the last one is an older a.stl


def test_files_that_were_left_are_listed_by_their_names_each_with_a_button_that_removes_it(
    browser: Browser, bench: Running
) -> None:
    browser.open(bench.address)
    browser.wait("performance.getEntriesByName(new URL('left', location)).length")
    files = json.dumps([{"key": key, "name": name, "bytes": 1500, "written_s": 1e9 - key} for key, name in LEFT])
    browser.value(
        f"""{{ const real = fetch; window.asked = [];
        const left = (what, method) => {{ asked.push([what, method]); return new Response({json.dumps(files)}); }};
        fetch = async (what, more) => (/^left/.test(what) ? left(what, more?.method) : real(what, more)); }}"""
    )
    names = "[...$('left-list').querySelectorAll(':scope > li > button:first-child')].map((b) => b.firstChild.textContent)"
    browser.value("modules['model/benches'].offer('left')")
    assert browser.value(names) == [name for _, name in LEFT]
    browser.click("#left-list > li:nth-child(7) > [aria-label^='Remove g.stl, 2 kB']")
    browser.wait("asked.length === 3")  # listed, removed, listed again
    assert browser.value("asked[1]") == ["left/6", "DELETE"]


def test_long_work_shows_its_elapsed_time(browser: Browser, bench: Running) -> None:
    browser.open(bench.address)
    browser.wait(f"document.documentElement.dataset.version && {IDLE}")
    under_way = "(({ store, update }) => update({ state: { ...store.state, busy: 'reading big.stl' } }))(modules['page/store'])"
    at_once = f"({under_way}, [$('summary').textContent, $('summary').dataset.elapsed])"  # before updates from the server
    assert browser.value(at_once) == ["reading big.stl …", ""]
    browser.wait(
        f"({under_way}, /^ \\([2-9]s\\)$/.test($('summary').dataset.elapsed))"
    )  # again after updates that are still arriving


def test_a_typed_angle_turns_the_model_and_its_size_follows(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "typed.stl", stl(tee()))
    browser.click("#tab-model")
    drag_slider(browser, "turn-x-typed", 90, "input")
    browser.wait("$('model-told').textContent.includes('40.0 × 40.0 × 10.0 mm')")  # while it rotates
    drag_slider(browser, "turn-x-typed", 90, "change")
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: lay the model down' && $('turn-x-typed').value === '0'")
    browser.wait("$('model-told').textContent.includes('40.0 × 40.0 × 10.0 mm') && $('size-z').value === '10.00'")


def test_a_clicked_face_is_laid_on_the_build_plate(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee()))
    browser.click("#tab-model")
    browser.click("[data-view=top]")
    browser.click("#fit")
    browser.click("#lay")
    browser.wait("$('rings').hasAttribute('hidden')")  # one of the rings crosses the middle
    browser.wait("modules['page/store'].store.facets?.facets.length === 6")  # of the hull of a T; none below its arms
    browser.press(*browser.middle("#canvas"))
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: lay a face down'")
    assert area(browser) == 0.0  # upside down a T needs no support
    assert browser.value("$('lay').getAttribute('aria-pressed')") == "false"


def test_a_plane_is_dragged_with_its_figures_and_returns_if_it_cannot_be_cut(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee()))
    browser.click("#tab-parts")
    browser.click("[data-view=front]")
    browser.click("#fit")
    browser.click("#add")
    browser.wait("!$('plane').hidden && !$('handles').hidden && $('plane-told').textContent")
    assert browser.value("$('plane-offset').value") == "20.00"
    x, y = browser.middle("#hand-along")
    browser.hold((x, y), (x, y - 20))
    browser.wait("document.documentElement.dataset.triedMs > 0")  # its figures, during the drag
    browser.release((x, y - 20))
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: move a plane'")
    moved = float(browser.value("$('plane-offset').value"))
    assert 20.0 < moved < 30.0
    drag_slider(browser, "plane-offset", 70, "change")
    browser.wait("!$('problem').hidden")
    assert "misses the model" in browser.value("$('problem').textContent")
    browser.wait(f"Math.abs(Number($('plane-offset').value) - {moved}) < 0.01 && !$('handles').hidden")
    browser.click("#put-aside")
    browser.wait("!$('trouble').checkVisibility() && $('put-near').hidden")
    drag_slider(browser, "plane-offset", 39.95, "change")  # 0.05 mm below the top
    browser.wait("$('put-near').checkVisibility()")
    browser.click("#put-near")
    browser.wait("$('plane-offset').value === '39.60' && $('problem').hidden")
    assert "The plane stands 0.35 mm below the wanted position" in browser.value("$('notice').textContent")
    browser.value("$('hand-tilt-a').focus()")
    browser.key("ArrowUp")
    browser.wait("Math.abs(Number($('plane-tilt').value) - 1) < 0.11")


def test_a_plane_dragged_where_it_cannot_be_cut_stays_at_the_last_place_where_it_can(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee()))
    browser.click("#tab-parts")
    browser.click("[data-view=front]")
    browser.click("#fit")
    browser.click("#add")
    browser.wait("!$('handles').hidden && $('plane-told').textContent")
    x, y = browser.middle("#hand-along")
    browser.hold((x, y), (x, y - 30))
    browser.wait("document.documentElement.dataset.triedMs > 0 && Number($('plane-offset').value) > 20.5")
    shown = "[$('plane-offset').value, $('parts-list').children[1].textContent]"
    allowed = browser.value(shown)
    browser._send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y - 900, button="left", buttons=1)
    browser.wait("$('plane-told').textContent.includes('misses the model')")
    assert browser.value(shown) == allowed
    browser.release((x, y - 900))
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: move a plane' && $('problem').hidden")
    browser.wait(f"$('plane-offset').value === '{allowed[0]}'")
    assert "misses the model" not in browser.value("$('plane-told').textContent")  # it is back where it can be cut
    browser.wait("$('plane-told').textContent.includes('mm of seams')")
    assert browser.value("document.documentElement.dataset.obstacle") == ""


def test_a_setting_is_found_by_a_word_changed_and_marked(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee()))
    browser.click("#tab-settings")
    browser.wait("document.querySelectorAll('[data-key]').length > 25")
    browser.value("{ $('search-settings').value = 'steepest overhang'; $('search-settings').dispatchEvent(new Event('input')); }")
    assert browser.value("document.querySelectorAll('[data-key]').length") == 1
    before = area(browser)
    browser.value(
        "{ const input = document.querySelector('[data-key] input'); input.value = 5; input.dispatchEvent(new Event('change')); }"
    )
    browser.wait("document.querySelector('[data-key].changed')")
    assert area(browser) >= before
    browser.click("#undo")
    browser.wait("document.querySelector('[data-key]:not(.changed)')")


def test_a_broken_model_is_reported_and_the_previous_one_stays(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee()))
    choose(browser, "<img onerror=alert(1)>.stl", stl(tee())[:400])
    browser.wait("!$('problem').hidden")
    problem = "is cut short: it holds 6 of the 28 facets that its header announces"
    assert browser.value("$('problem').textContent") == f"<img onerror=alert(1)>.stl {problem}"
    assert browser.value("$('title').textContent") == "tee.stl"


def test_a_picture_that_loses_its_model_or_graphics_context_says_so_and_recovers(browser: Browser, bench: Running) -> None:
    browser.open(bench.address)
    browser.wait("document.documentElement.dataset.version")
    deaf = "(at, ...more) => window.deaf && `${at}`.startsWith('model/') ? Promise.reject(new TypeError()) : asking(at, ...more)"
    browser.value(f"{{ window.deaf = true; const asking = window.fetch; window.fetch = {deaf}; }}")
    choose(browser, "tee.stl", stl(tee()))
    browser.wait("$('notice').textContent.startsWith('The model has not come') && $('title').textContent === 'tee.stl'")
    browser.value("window.deaf = false")
    browser.click("[data-turn=x]")
    browser.wait("document.documentElement.dataset.shown && $('notice').hidden")
    browser.value("{ window.card = $('canvas').getContext('webgl2').getExtension('WEBGL_lose_context'); card.loseContext(); }")
    browser.wait("$('notice').textContent.startsWith('The graphics card has let go')")
    browser.click("#undo")
    browser.wait("$('redo').getAttribute('aria-label') === 'redo: turn the model'")
    before = browser.value("Number(document.documentElement.dataset.drawn)")
    browser.value("card.restoreContext()")
    browser.wait(f"$('notice').hidden && document.documentElement.dataset.drawn > {before}")
    assert area(browser) > 0.0


def test_a_model_that_changed_while_it_was_fetched_is_fetched_again(browser: Browser, bench: Running) -> None:
    browser.open(bench.address)
    browser.wait("document.documentElement.dataset.version")
    late = (
        "(at, ...more) => `${at}`.startsWith('model/') && late-- > 0 ? new Response(null, { status: 204 }) : asking(at, ...more)"
    )
    browser.value(f"{{ window.late = 2; const asking = window.fetch; window.fetch = async {late}; }}")
    choose(browser, "tee.stl", stl(tee()))
    browser.wait("late < 0 && document.documentElement.dataset.shown && $('title').textContent === 'tee.stl'")
    assert area(browser) > 0.0


def test_a_page_without_a_workbench_reports_that_an_emergency_stop_has_not_arrived(browser: Browser) -> None:
    with workbench() as running:
        browser.open(running.address)
        browser.wait("document.documentElement.dataset.line === 'open'")
    browser.wait("document.documentElement.dataset.line === 'ended'")
    assert browser.value("$('notice').textContent").startswith("tiltprint has ended")
    browser.value("$('emergency').click()")
    counting = "WebSocket = class extends WebSocket { constructor(at) { super(at); tries++; } }"
    browser.value(f"window.tries = 0; {counting}")
    browser.wait("tries >= 3")  # each attempt reports the line as lost
    assert browser.value("$('stop-words').checkVisibility() && $('stop-words').textContent").startswith(
        "THE STOP HAS NOT ARRIVED"
    )


def test_without_webgl_the_numbers_and_the_front_are_shown(bench: Running) -> None:
    with small_browser("--disable-3d-apis") as blind:
        open_model(blind, bench, "tee.stl", stl(tee()))
        assert blind.value("document.documentElement.dataset.state") == "failed"
        assert area(blind) > 0.0
        assert blind.value("$('blind').checkVisibility() && $('undo').checkVisibility() && !$('fit').checkVisibility()")
        find_as_it_lies(blind)
        assert "area to support" in blind.value("$('front-told').textContent")
        blind.click("#parts-list [value='2']")
        blind.wait("$('plane-tools').checkVisibility() && $('save').checkVisibility()")
