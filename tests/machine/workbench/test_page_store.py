"""The store of the page: changes are reported in order, each with the previous values, and only the store writes into itself."""

import re
from pathlib import Path

import pytest

from machine.workbench.web.server import OWN
from tests.machine.fake_page import needs_node, on_fake_page

HEARD = """
    const { store, update, subscribe, onState } = modules["page/store"], heard = [];
    subscribe((now, before) => { if (now.part === 1 && before.part === 0) update({ part: 2, tab: "parts" }); });
    subscribe((now, before) => heard.push([before.part, now.part, now.tab]));
    onState((state, before) => heard.push([before?.version ?? null, state.version]));
"""


@needs_node
def test_no_listener_is_called_before_the_first_state() -> None:
    assert on_fake_page(f"{HEARD} update({{ part: 5 }}); return [heard, store.part];") == [[], 5]


@needs_node
def test_a_change_made_by_a_listener_follows_after_all_have_seen_the_previous_one() -> None:
    asked = f"{HEARD} update({{ state: {{ version: 1 }} }}); update({{ part: 1 }}); return heard;"
    assert on_fake_page(asked) == [[0, 0, "model"], [None, 1], [0, 1, "model"], [1, 2, "parts"]]


@pytest.mark.parametrize("script", sorted(OWN.rglob("*.js")), ids=lambda file: file.stem)
def test_only_the_store_writes_to_its_state(script: Path) -> None:
    assert script.stem == "store" or re.findall(r"\bstore(?:\.\w+)+ [-+|&?]*=[^=>].*", script.read_text("utf-8")) == []
