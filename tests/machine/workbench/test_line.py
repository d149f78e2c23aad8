"""The websocket of a page: invalid commands, harmless disconnections, and cleanup."""

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from starlette.websockets import WebSocketDisconnect

from machine.workbench.session.base import Observable
from machine.workbench.web.line import parsed, tell, until_either_ends
from profiles.errors import PlanError
from tests.machine.prints import prints_line
from tests.machine.running_workbench import workbench


def test_a_binary_frame_is_refused_and_does_not_close_the_connection() -> None:
    no_command = "the page has sent something that is not a command of the workbench"
    with workbench() as bench, bench.line() as page, prints_line(bench, "first") as printing:
        page.say(b"\x00")
        assert page.until(lambda state: state["problem"])["problem"] == no_command
        page.do("demo", name="other")
        page.until(lambda state: state["problem"].startswith("other: only the models that ship"))
        printing.say(b"\x00")
        assert printing.refused() == no_command
        printing.do("cancel", print=1)
        assert printing.refused() == "this print no longer exists"


@pytest.mark.parametrize("value", ['"a\\ufdd0b"', '["a\ufdd1"]', '{"\\ufdd2": 1}', '"\\ud800"'])
def test_characters_that_are_no_text_are_refused_wherever_a_command_has_them(value: str) -> None:
    with pytest.raises(PlanError, match=r"what the page has sent is not plain text: .* not allowed"):
        parsed(f'{{"do": "demo", "name": {value}}}', 1000)
    assert parsed('{"do": "demo", "name": "モデル 😀"}', 1000)["name"] == "モデル 😀"


BEAT = -1  # an empty message


class Page:
    """The socket of a page that accepts messages as long as it is awake."""

    def __init__(self) -> None:
        self.heard: list[int] = []
        self.awake = asyncio.Event()

    async def send_text(self, text: str) -> None:
        await self.awake.wait()
        self.heard.append(json.loads(text)["version"] if text else BEAT)


def test_a_page_that_requests_heartbeats_receives_them_between_states() -> None:
    async def run() -> Page:
        source, page = Observable(), Page()
        page.awake.set()
        telling = asyncio.create_task(tell(source, lambda: {"version": source.version}, page, 0.01))  # type: ignore[arg-type]
        while page.heard != [0, BEAT, BEAT]:
            await asyncio.sleep(0)
        source.notify()
        while page.heard[-1] != 1:
            await asyncio.sleep(0)
        telling.cancel()
        return page

    assert asyncio.run(asyncio.wait_for(run(), 10.0)).heard == [0, BEAT, BEAT, 1]


def test_fifty_silent_pages_block_no_other_and_receive_the_newest_state_later() -> None:
    worded: list[int] = []

    async def run() -> tuple[Page, list[Page]]:
        source, reading, asleep = Observable(), Page(), [Page() for _ in range(50)]

        def state() -> dict[str, int]:
            worded.append(source.version)
            return {"version": source.version}

        async def settle() -> None:
            for _ in range(10):
                await asyncio.sleep(0)

        reading.awake.set()
        telling = [asyncio.create_task(tell(source, state, page)) for page in (*asleep, reading)]  # type: ignore[arg-type]
        await settle()
        for _ in range(20):
            source.notify()
            await settle()
        for page in asleep:
            page.awake.set()
        await settle()
        for task in telling:
            task.cancel()
        return reading, asleep

    reading, asleep = asyncio.run(run())
    assert reading.heard == list(range(21))
    assert [page.heard for page in asleep] == 50 * [[0, 20]]
    assert worded == list(range(21))  # once for all pages


class Directions:
    """The two coroutines of a line, and the number that are running."""

    def __init__(self) -> None:
        self.going = 0

    @asynccontextmanager
    async def counted(self) -> AsyncIterator[None]:
        self.going += 1
        try:
            yield
        finally:
            self.going -= 1

    async def waits(self) -> None:
        async with self.counted():
            await asyncio.Event().wait()

    async def ends(self, error: Exception | None = None) -> None:
        async with self.counted():
            await asyncio.sleep(0.01)
            if error is not None:
                raise error


@pytest.mark.parametrize("error", [None, WebSocketDisconnect(1006)])
def test_a_half_closed_connection_leaves_no_task_and_is_not_an_error(error: Exception | None) -> None:
    async def run() -> int:
        directions = Directions()
        await until_either_ends(directions.ends(error), directions.waits())
        return directions.going

    assert asyncio.run(run()) == 0


def test_a_line_that_is_cancelled_leaves_nothing() -> None:
    async def run() -> int:
        directions = Directions()
        talking = asyncio.create_task(until_either_ends(directions.waits(), directions.waits()))
        await asyncio.sleep(0.01)
        talking.cancel()
        await asyncio.wait([talking])
        return directions.going

    assert asyncio.run(run()) == 0


def test_a_bug_of_one_direction_is_not_taken_for_a_page_that_has_gone() -> None:
    async def run() -> None:
        directions = Directions()
        await until_either_ends(directions.ends(RuntimeError("a bug")), directions.waits())

    with pytest.raises(ExceptionGroup) as raised:
        asyncio.run(run())
    assert [str(error) for error in raised.value.exceptions] == ["a bug"]
