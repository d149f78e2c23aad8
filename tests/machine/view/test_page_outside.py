"""The page of a running print, after it receives the final state."""

import json

import pytest

from machine.link.print_state import OVER, PrintState, PrintStatus
from machine.view.page import TEMPLATE
from tests.machine.fake_page import needs_node, on_fake_page

OUTSIDE = TEMPLATE / "panel" / "outside.js"


def orders_hidden(state: PrintState) -> bool:
    """Whether a page that receives a state hides its commands and stops polling."""
    told = json.dumps(PrintStatus(state).json())
    act = f"""
        let asked = 0;
        Object.assign(document, {{ querySelector: $, querySelectorAll: () => [] }});
        globalThis.fetch = async () => {{ asked += 1; return {{ json: () => ({told}) }}; }};
        modules["panel/outside"].follow({{}}, {{}});
        await new Promise((done) => setImmediate(done));
        fake.wait(5000);
        return [$("orders").hidden, asked];
    """
    hidden, asked = on_fake_page(act, OUTSIDE)
    assert (asked == 1) == hidden
    return bool(hidden)


@needs_node
@pytest.mark.parametrize("state", sorted(OVER))
def test_a_print_that_is_over_takes_no_orders(state: PrintState) -> None:
    assert orders_hidden(state)


@needs_node
def test_a_print_that_pauses_takes_orders() -> None:
    assert not orders_hidden(PrintState.PAUSING)
