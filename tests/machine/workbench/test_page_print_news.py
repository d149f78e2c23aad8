"""News of a page about its prints: the tab's title, the browser's notification, the graph of temperatures."""

from tests.machine.fake_page import needs_node, on_fake_page

PAGE = """
    const said = [];
    globalThis.Notification = class { constructor(text) { said.push(text); } static requestPermission() { said.push("asked"); } };
    Notification.permission = "granted";
    printPanel();
    const known = { name: "box", port: "sim", live: true, checks: [], words: [], said: [] };
    known.holder = modules["page/line"].OWN_PAGE;
    const heats = { heat_s: 0, nozzle_c: 200, nozzle_target_c: 210, bed_c: 60, bed_target_c: null, at: {}, elapsed_s: 5 };
    const tell = (state, share, more = {}) => {
      const print = { ...known, number: 1, state, is_printing: state === "printing", share, ...heats, ...more };
      fake.sockets[0].tell({ ports: null, asking: false, journals: null, prints: [print] });
    };
    fake.sockets[0].open();
"""


@needs_node
def test_the_tab_title_shows_the_progress_of_a_print_until_it_is_over() -> None:
    told = on_fake_page(
        f"{PAGE} const titles = []; tell('printing', 0.429); titles.push(document.title);"
        " tell('done', 1, { is_over: true, sentence: 'the print is done' }); titles.push(document.title); return titles;"
    )
    assert told == ["42 % – tiltprint", "tiltprint"]


@needs_node
def test_the_browser_says_once_that_a_print_of_this_page_is_over() -> None:
    over = "tell('done', 1, { is_over: true, sentence: 'the print is done' });"
    assert on_fake_page(f"{PAGE} tell('printing', 0.5); {over} {over} return said;") == ["box: the print is done"]
    assert on_fake_page(f"{PAGE} known.holder = 'another page'; tell('printing', 0.5); {over} return said;") == []
    assert on_fake_page(f"{PAGE} {over} return said;") == []  # it was over before this page was opened


@needs_node
def test_permission_to_notify_is_requested_only_when_a_print_begins() -> None:
    act = "Notification.permission = 'default'; tell('ready', 0); const before = [...said]; $('begin').fire('click');"
    assert on_fake_page(f"{PAGE} {act} return [before, said];") == [[], ["asked"]]


@needs_node
def test_temperatures_of_ten_minutes_are_lines_with_the_newest_at_the_right_edge() -> None:
    samples = "[{ at_s: 0, nozzle: 0, bed: null }, { at_s: 300, nozzle: 100, bed: 60, nozzleTarget: 200 }]"
    lines = on_fake_page(f"return modules['print/print-shown'].heatLines({samples}, 300);")
    assert lines["most"] == 200
    assert lines["lines"] == {
        "nozzle": "M150.0 80.0L300.0 40.0",
        "bed": "M300.0 56.0",
        "nozzleTarget": "M300.0 0.0",
        "bedTarget": "",
    }


@needs_node
def test_the_state_of_a_print_is_on_the_tab_and_in_the_bar_of_every_tab() -> None:
    told = on_fake_page(
        f"{PAGE} tell('printing', 0.5, {{ how: 'printing, 50 %', texts: {{ 'run-news': 'box: printing' }} }});"
        " return ['run-state', 'bar-told', 'run-news'].map((id) => $(id).textContent);"
    )
    assert told == ["printing, 50 %", "box on sim: printing, 50 %", "box: printing"]


@needs_node
def test_heaters_confirmed_off_are_shown_as_off_and_no_sentence_is_shown_twice() -> None:
    told = on_fake_page(
        f"{PAGE} const sentence = 'the print was cancelled; heaters off', lines = ['tiltprint: ' + sentence, 'other'];"
        " tell('cancelled', 0.1, { is_over: true, nozzle_target_c: 0, heat_is_old: true, sentence, said: lines });"
        " const texts = (id) => $(id).children.map((each) => [each.textContent, each.className]);"
        " return [texts('run-told').slice(1, 4), texts('run-said')];"
    )
    assert told[0] == [["off, 200.0 °C (0 s ago)", None], ["bed", None], ["60.0 °C, as last known 0 s ago", "old"]]
    assert [text for text, _ in told[1]] == ["other"]


@needs_node
def test_a_camera_picture_is_fetched_every_two_seconds_until_the_print_is_over() -> None:
    act = f"""{PAGE} tell('printing', 0.5, {{ webcam: true }});
        Object.assign($('webcam'), {{ complete: true }}); fake.wait(2000);
        const asked = $('webcam').src.split('?')[0]; $('webcam').onload();
        const seen = [asked, $('webcam-line').hidden];
        tell('done', 1, {{ webcam: true, is_over: true }}); fake.wait(2000);
        return [...seen, $('webcam-line').hidden];"""
    assert on_fake_page(act) == ["prints/1/webcam", False, True]


@needs_node
def test_earlier_prints_are_listed_with_outcome_time_and_filament_where_there_are_any() -> None:
    done = "{ cells: ['box', 'done', '1h 30m', '1.3 m'], begun: 0 }"
    shown = "$('history-field').hidden, $('past-prints').children.length"
    told = "fake.sockets[0].tell({ ports: null, asking: false, journals: null, prints: [], history: "
    assert on_fake_page(f"{PAGE} {told}[] }}); return [{shown}];") == [True, 0]
    assert on_fake_page(f"{PAGE} {told}[{done}] }}); return [{shown}];") == [False, 2]
