"""The websocket of a page: what is no command, what is no fault, and that nothing of it is left."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from starlette.websockets import WebSocketDisconnect

from machine.app.workbench.web.line import until_either_ends
from tests.machine.prints import prints_line
from tests.machine.workbench import workbench


def test_a_frame_of_bytes_is_told_to_be_no_command_and_ends_no_line() -> None:
    no_command = "what the page has sent is no command of the workbench"
    with workbench() as bench, bench.line() as page, prints_line(bench, "first") as printing:
        page.say(b"\x00")
        assert page.until(lambda state: state["problem"])["problem"] == no_command
        page.do("demo", name="other")
        page.until(lambda state: state["problem"].startswith("other: only the models that ship"))
        printing.say(b"\x00")
        assert printing.refused() == no_command
        printing.do("cancel", print=1)
        assert printing.refused() == "this print is not there any more"


class Directions:
    """The two coroutines of a line, and which of them goes on."""

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
def test_a_line_of_which_one_direction_ends_leaves_nothing_and_is_no_fault(error: Exception | None) -> None:
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
