"""Pages that read nothing, planes while a hand moves and when it rests, and what is had of a search that is stopped."""

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from tests.machine.workbench import QUICK, Page, Running, workbench

MOVES, IDLE, MOST_S = 20, 50, 2.0
UP = [0.0, 0.0, 1.0]


@pytest.fixture(scope="module")
def bench() -> Iterator[Running]:
    with workbench("demo:tree", *QUICK) as running:
        yield running


def asleep(bench: Running) -> socket.socket:
    """A page that asks for the line and never reads what it is told."""
    sleeper = socket.create_connection(("127.0.0.1", bench.port))
    lines = (
        f"GET {bench.place}line HTTP/1.1",
        f"Host: 127.0.0.1:{bench.port}",
        f"Origin: http://127.0.0.1:{bench.port}",
        "Connection: Upgrade",
        "Upgrade: websocket",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    )
    sleeper.sendall("\r\n".join((*lines, "", "")).encode())
    return sleeper


def is_tried(offset_mm: float) -> Any:
    return lambda state: state["trial"] and [cut["offset_mm"] for cut in state["trial"]["cuts"]][:1] == [offset_mm]


def dragged_s(page: Page, first_mm: float) -> list[float]:
    """Seconds from each move of the second part's plane to its figures."""
    spent = []
    for k in range(MOVES):
        began = time.monotonic()
        page.do("try", part=2, normal=UP, offset_mm=first_mm + 0.25 * k)
        page.until(is_tried(first_mm + 0.25 * k))
        spent.append(time.monotonic() - began)
    return spent


def test_fifty_pages_that_read_nothing_do_not_hold_up_the_one_that_drags(bench: Running) -> None:
    with bench.line() as page, ExitStack() as sleeping:
        page.until(lambda state: state["model"])
        page.do("add", normal=UP, offset_mm=12.0)
        page.until(lambda state: state["parts"] == 2)
        for _ in range(IDLE):
            sleeping.enter_context(asleep(bench))
        assert any(max(dragged_s(page, first_mm)) < MOST_S for first_mm in (14.0, 14.1, 14.2))  # a machine may be busy once
        page.do("undo")
        page.until(lambda state: state["parts"] == 0)


def test_figures_follow_the_hand_at_once_and_what_else_is_cut_is_looked_at_when_it_rests(bench: Running) -> None:
    with bench.line() as page:
        page.until(lambda state: state["model"])
        page.do("add", normal=UP, offset_mm=12.0)
        page.until(lambda state: state["parts"] == 2)
        page.do("add", normal=UP, offset_mm=24.0)
        page.until(lambda state: state["parts"] == 3)
        page.do("try", part=3, normal=UP, offset_mm=23.0)
        moving = page.until(lambda state: state["trial"]["cuts"][1]["offset_mm"] == 23.0)["trial"]
        rested = page.until(lambda state: not state["trial"]["unchecked"])["trial"]
        assert (moving["unchecked"], moving["parts"], moving["seam_mm"]) == (1, rested["parts"], rested["seam_mm"])


def test_the_best_of_a_search_that_is_stopped_is_there_at_once_and_its_time_a_little_later(bench: Running) -> None:
    with bench.line() as page:
        page.until(lambda state: state["model"])
        page.do("search")
        page.until(lambda state: state["search"] and state["search"]["planes"])
        page.do("stop")
        taken = page.until(lambda state: state["undo"] == "stop the search")
        assert [(row["parts"], row["time_s"]) for row in taken["front"]] == [(taken["parts"], None)]
        priced = page.until(lambda state: state["front"][0]["time_s"])
        assert (priced["undo"], priced["parts"], priced["front"][0]["planes"]) == (
            "stop the search",
            taken["parts"],
            taken["front"][0]["planes"],
        )
