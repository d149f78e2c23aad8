"""Prints of the workbench: who commands them, that they end safely whoever dies, and that they send what `print` sends."""

import asyncio
import os
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from machine.app.cli import main
from machine.app.requests import PrintRequest
from machine.app.workbench.printing.order import PrintOrder
from machine.app.workbench.printing.prints import Prints
from machine.app.workbench.printing.process import Checks, carry_out
from machine.app.workbench.printing.running_print import RunningPrint
from machine.app.workbench.printing.teller import Said
from machine.simulator.simulator import SimulatedPrinter
from mdp.save import stl
from profiles.profile import load
from tests.machine.prints import commands_sent, prints_line
from tests.machine.workbench import QUICK, Running, workbench
from tests.shapes import box

PROFILE = load()
HEAT = ["G21", "G90", "M83", "G28", "G92 A0 C0", "M140 S60", "M104 S210", "M109 S210", "G0 Z0.2 F600"]
STROKES = [f"G1 X{x} Y{y} E1.0 F60" for y in range(50) for x in (20, -20)]  # for an hour
HOUR = "\n".join([*HEAT, *STROKES, "M104 S0", "M140 S0"]) + "\n"


def order(port: str, gcode: str = HOUR, force: bool = True) -> PrintOrder:
    return PrintOrder("hour", gcode.encode(), PROFILE, PrintRequest(port), force)


def print_until(printer: SimulatedPrinter, end: Callable[[Prints, RunningPrint], None]) -> dict[str, Any]:
    """The last state of a print that is ended in some way while it lays its strokes."""

    async def run() -> dict[str, Any]:
        prints = Prints()

        async def reach(condition: Callable[[RunningPrint], object]) -> RunningPrint:
            while not condition(prints.prints[0]):
                await prints.changed(prints.version)
            return prints.prints[0]

        prints.command("me", {"do": "check"}, lambda asked: order(printer.path))
        begun = await reach(lambda one: one.state["phase"] == "ready")
        prints.command("me", {"do": "begin", "print": begun.number}, lambda asked: order(""))
        await reach(lambda one: one.state["progress"] and one.state["progress"]["nozzle_target_c"] == 210.0)
        end(prints, begun)
        state = (await reach(lambda one: one.over)).state
        await asyncio.gather(*prints._tasks)
        return state

    return asyncio.run(asyncio.wait_for(run(), 60.0))


def kill(prints: Prints, one: RunningPrint) -> None:
    assert one._process is not None
    os.kill(one._process.pid, signal.SIGKILL)


def hang_up(prints: Prints, one: RunningPrint) -> None:
    assert one._process is not None
    assert one._process.stdin is not None
    one._process.stdin.close()


@pytest.mark.parametrize(("end", "told"), [
    (kill, "the process that printed has ended before the print was done; the printer reports its heaters off"),
    (hang_up, "the print was stopped"),
])  # fmt: skip
def test_whoever_dies_the_heaters_go_off(end: Callable[[Prints, RunningPrint], None], told: str) -> None:
    with SimulatedPrinter(PROFILE.machine, speed=20.0) as printer:
        state = print_until(printer, end)
        assert (printer.record.nozzle_target_c, printer.record.bed_target_c) == (0.0, 0.0)
    assert state["sentence"] == told
    assert Path(state["journal"]).is_file()


class Agreeing:
    """A person who would print whatever is asked."""

    def agrees(self) -> bool:
        raise AssertionError("nobody is asked when something speaks against the print")


class Heard:
    """Takes what is told."""

    def __init__(self) -> None:
        self.state: dict[str, Any] = {}

    def tell(self, **values: Any) -> None:
        self.state |= values


@pytest.mark.parametrize(("wanted", "sentence", "forcible"), [
    (order("/dev/no-such-port"), "port /dev/no-such-port does not exist", False),
    (order("sim", "G28\nG1 X500 F600\n", force=False), "the dry run found 1 errors, the first: X goes to 500 mm", True),
])  # fmt: skip
def test_what_print_refuses_is_refused_with_its_sentence(wanted: PrintOrder, sentence: str, forcible: bool) -> None:
    heard = Heard()
    end = carry_out(wanted, Agreeing(), Checks(heard, Said(heard)))  # type: ignore[arg-type]
    assert end["sentence"].startswith(sentence)
    assert (end["end"], end["forcible"]) == ("refused", forcible)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("box")
    (made / "box.stl").write_bytes(stl(box(12.0, 12.0, 8.0)))
    return made


@pytest.fixture(scope="module")
def sliced(folder: Path) -> Iterator[Running]:
    """A workbench on which a little box is sliced in one piece."""
    with workbench(*QUICK) as running:
        with running.line() as page, prints_line(running, "first") as printing:
            printing.do("check", port="sim")
            assert printing.refused() == "there is no model on the workbench yet: choose a file first"
            assert running.send(folder / "box.stl")[0] == 200
            page.until(lambda state: state["model"])
            printing.do("check", port="sim")
            assert printing.refused() == "what is on the workbench is not sliced yet: slice it first"
            page.do("slice")
            page.until(lambda state: state["sliced"])
            page.do("turn", axis="z", deg=30)
            page.until(lambda state: not state["sliced"])
            printing.do("check", port="sim")
            assert printing.refused() == "what is on the workbench has changed since it was sliced: slice it again"
            page.do("undo")
            page.until(lambda state: state["sliced"])
        yield running


def listen_to_nothing(running: Running) -> socket.socket:
    """A page's line to the prints that is opened and never read."""
    own = socket.create_connection(("127.0.0.1", running.port))
    own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
    own.sendall(
        f"GET {running.place}prints?page=deaf HTTP/1.1\r\nHost: 127.0.0.1:{running.port}\r\n"
        f"Origin: http://127.0.0.1:{running.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
    )
    return own


def test_fifty_pages_that_read_nothing_leave_the_print_what_the_command_line_sends(sliced: Running, folder: Path) -> None:
    by_hand = ("print", str(folder / "box.stl"), *QUICK, "--parts", "1", "--port", "sim", "--log", str(folder / "own.log"))
    assert main(by_hand) == 0
    with ExitStack() as stack, prints_line(sliced, "first") as page:
        for _ in range(50):
            stack.enter_context(listen_to_nothing(sliced))
        page.do("check", port="sim")
        page.until(lambda one: one["phase"] == "ready")
        page.command("begin")
        done = page.until(lambda one: one["phase"] == "over")
        page.command("forget")
        page.until(lambda one: not one["phase"])
    assert done["sentence"] == "the print is done"
    assert commands_sent(Path(done["log"])) == commands_sent(folder / "own.log")


def test_one_page_commands_the_others_watch_and_any_may_stop_at_once(sliced: Running) -> None:
    with prints_line(sliced, "second") as second:
        with prints_line(sliced, "first") as first:
            first.do("check", port="sim", sim_speed=100)
            first.until(lambda one: one["phase"] == "ready")
            first.do("check", port="sim")
            assert first.refused() == "port sim prints already: wait until that is done, or cancel it"
            second.until(lambda one: one["phase"] == "ready")
            second.command("begin")
            assert second.refused() == "another page commands this print: take the command over first"
            first.command("begin")
            first.until(lambda one: one["progress"] and one["progress"]["layer"])
            first.command("feed", percent=10)
            first.until(lambda one: one["progress"]["feed_percent"] == 10.0)
        watched = second.until(lambda one: not one["held"])
        assert (watched["holder"], watched["phase"]) == ("first", "printing")
        second.command("take")
        second.until(lambda one: one["holder"] == "second")
        second.command("pause")
        second.until(lambda one: one["progress"]["state"] == "paused")
        second.command("resume")
        second.until(lambda one: one["progress"]["state"] == "printing")
        with prints_line(sliced, "third") as third:
            third.until(lambda one: one["phase"] == "printing")
            third.do("emergency")
            ended = third.until(lambda one: one["phase"] == "over")
        assert ended["sentence"].startswith("emergency stop: the printer has halted")
        assert "M112" in commands_sent(Path(ended["log"]))


def test_what_is_no_port_of_a_printer_is_told(sliced: Running) -> None:
    with prints_line(sliced, "first") as page:
        for port, sentence in (
            ("", "no printer is chosen: choose a port, or sim for the simulated one"),
            ("octoprint:host", "octoprint is a print server, which takes whole files"),
        ):
            page.do("check", port=port)
            assert page.refused().startswith(sentence)
