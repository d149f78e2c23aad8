"""The emergency stop of a page: the print that it stops, its keys, and a stop without a connection."""

import pytest

from tests.machine.fake_page import needs_node, on_fake_page

# Two prints run, the second one is the newest; the page controls neither.
TWO_PRINTS = """
    printPanel();
    const known = { port: "sim", state: "printing", at: {}, checks: [], words: [], said: [] };
    const prints = [1, 2].map((number) => ({ ...known, number, name: `box ${number}` }));
    const state = { ports: null, asking: false, journals: null, prints };
    fake.sockets[0].open();
    fake.sockets[0].tell(state);
"""


@needs_node
@pytest.mark.parametrize("target", [
    "{ tagName: 'SELECT' }",
    "{ tagName: 'TEXTAREA' }",
    "{ tagName: 'INPUT', type: 'text' }",
    "{ tagName: 'INPUT', type: 'search' }",
    "{ tagName: 'INPUT', type: 'number' }",
])  # fmt: skip
def test_a_letter_e_that_the_field_in_focus_needs_stops_nothing(target: str) -> None:
    assert on_fake_page(f"{TWO_PRINTS} fake.press('e', {target}); fake.wait(700); return fake.sent();") == []


@needs_node
@pytest.mark.parametrize("target", ["{ tagName: 'BODY' }", "{ tagName: 'BUTTON' }", "{ tagName: 'INPUT', type: 'range' }"])
def test_the_key_e_stops_the_print_that_the_button_names_and_no_other(target: str) -> None:
    held = f"fake.press('e', {target}); fake.wait(600);"
    assert on_fake_page(f"{TWO_PRINTS} {held} return fake.sent();") == [{"do": "emergency", "print": 2}]
    looked_at = "$('which').value = 1; $('which').fire('change');"
    acts = held, "$('emergency').fire('click')"
    by_key, by_button = (on_fake_page(f"{TWO_PRINTS} {looked_at} {act}; return fake.sent();") for act in acts)
    assert by_key == by_button == [{"do": "emergency", "print": 1}]


@needs_node
def test_a_slip_on_the_key_e_stops_nothing() -> None:
    slip = "fake.press('e'); fake.wait(500); fake.press('e', {}, 'keyup');"
    assert on_fake_page(f"{TWO_PRINTS} {slip} fake.wait(2000); return fake.sent();") == []
    assert on_fake_page(f"{TWO_PRINTS} {slip} fake.wait(600); {slip} return fake.sent();") == []
    lost = "fake.press('e'); fake.press('', {}, 'blur'); fake.wait(2000);"
    assert on_fake_page(f"{TWO_PRINTS} {lost} return fake.sent();") == []


@needs_node
def test_the_key_e_pressed_twice_within_a_second_stops_and_shows_that_it_is_held() -> None:
    twice = "fake.press('e'); fake.press('e', {}, 'keyup'); fake.wait(400); fake.press('e');"
    assert on_fake_page(f"{TWO_PRINTS} {twice} return fake.sent();") == [{"do": "emergency", "print": 2}]
    held = "[fake.press('e'), $('emergency').dataset.held, fake.wait(600), $('emergency').dataset.held ?? false]"
    assert on_fake_page(f"{TWO_PRINTS} return {held}.filter((value) => value !== undefined);") == [True, False]


@needs_node
def test_the_key_e_stays_held_while_another_key_is_released() -> None:
    held = "fake.press('e'); fake.wait(200); fake.press('Shift', {}, 'keyup'); fake.wait(400);"
    assert on_fake_page(f"{TWO_PRINTS} {held} return fake.sent();") == [{"do": "emergency", "print": 2}]


LINE_LOST = f"""{TWO_PRINTS}
    fake.sockets[0].lose();
    $('emergency').fire('click');
    const back = (after_ms, numbers) => {{
        fake.wait(after_ms);
        fake.sockets.at(-1).open();
        fake.sockets.at(-1).tell({{ ...state, prints: prints.filter(({{ number }}) => numbers.includes(number)) }});
        return [fake.sent(), $('stop-words').textContent];
    }};
"""
NOT_GIVEN = "THE STOP HAS NOT ARRIVED and is no longer given: press it again, or use the machine's own switch."


@needs_node
def test_a_stop_that_finds_no_line_is_given_to_its_print_when_the_line_is_back_soon() -> None:
    sent, _ = on_fake_page(f"{LINE_LOST} return back(9000, [1, 2]);")
    assert sent == [{"do": "emergency", "print": 2}]


@needs_node
def test_a_stop_that_waited_too_long_for_a_connection_is_dropped_and_reported() -> None:
    assert on_fake_page(f"{LINE_LOST} return back(11000, [1, 2]);") == [[], NOT_GIVEN]


@needs_node
def test_a_stop_that_has_waited_for_a_line_stops_no_other_print() -> None:
    sent, _ = on_fake_page(f"{LINE_LOST} return back(2000, [1]);")
    assert sent == []
