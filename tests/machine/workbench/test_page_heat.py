"""Temperatures on a page: fresh ones have no mark, old ones show their age, which keeps increasing without news."""

import pytest

from tests.machine.fake_page import needs_node, on_fake_page

# A print that is reported once, at time 0.
HEARD = """
    printPanel();
    const heats = { nozzle_c: 209.6, nozzle_target_c: 210, bed_c: 60, bed_target_c: null, heat_s: 0, heat_is_old: false };
    const moment = { state: "printing", ...heats, at: {}, elapsed_s: 5 };
    const known = { number: 1, name: "box", port: "sim", is_printing: true, live: true, checks: [], words: [], said: [] };
    const tell = (more) => {
      const print = { ...known, ...moment, ...more };
      fake.sockets[0].tell({ ports: null, asking: false, journals: null, prints: [print] });
    };
    const heat = () => [1, 3].map((place) => $("run-told").children[place].textContent);
    fake.sockets[0].open();
    tell({});
"""
FRESH = ["209.6 of 210 °C", "60.0 °C"]


def marked(ago: str) -> list[str]:
    return [f"{text}, as last known {ago} ago" for text in FRESH]


@needs_node
def test_fresh_temperatures_are_not_marked() -> None:
    assert on_fake_page(f"{HEARD} return heat();") == FRESH


@needs_node
@pytest.mark.parametrize("tell", [
    "tell({ state: 'failed', is_over: true, heat_is_old: true, sentence: 'emergency stop: the printer has halted' });",
    "tell({ state: 'reconnecting', heat_is_old: true });",
    "",  # the line to the workbench is lost, or the print hangs
])  # fmt: skip
@pytest.mark.parametrize(("after_ms", "ago"), [(12_000, "12 s"), (5 * 60_000 + 30_000, "5 min"), (2 * 3_600_000, "2 h")])
def test_old_temperatures_are_marked_with_their_age(tell: str, after_ms: int, ago: str) -> None:
    assert on_fake_page(f"{HEARD} {tell} fake.wait({after_ms}); return heat();") == marked(ago)


@needs_node
def test_at_the_end_of_a_print_it_is_marked_at_once() -> None:
    assert on_fake_page(
        f"{HEARD} fake.wait(2000); tell({{ state: 'done', is_over: true, heat_is_old: true }}); return heat();"
    ) == marked("2 s")
