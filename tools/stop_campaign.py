"""Emergency stops at random moments while a large model is opened: how long each takes from the page to the printer's wire.

    python tools/stop_campaign.py [--stops 50] [--faces 2000000] [--seed 1]

One bench prints a box at several simulated printers, each a process of its own behind a relay that notes when M112 passes; a
second one is opened for a ball of so many faces, and meanwhile a page stops one print after the other. Exits with 1 where a
stop has not arrived or is not confirmed. Clocks of one computer are compared, so all must run on one.
"""

import argparse
import json
import random
import socket
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Any

import manifold3d as m3

from machine.simulator.simulator import SimulatedPrinter
from mdp.cut import mesh_of
from mdp.save import stl
from profiles.profile import load
from tests.machine import workbench as harness
from tests.machine.prints import PrintPage, prints_line
from tests.machine.workbench import QUICK, Page, Running, workbench
from tests.shapes import box

AT_ONCE = 5  # prints that run while one model is opened
SPEED = 10.0  # times real time, of the printers: the print lasts longer than the model takes
STOP, READ_BYTES = b"M112", 65536
BALL_MM = 20.0
PATIENCE_S = 600.0  # with the model, on a busy computer
HALTED = "emergency stop: the printer has halted"


def serve() -> None:
    """A printer's process: tells the port of its relay, then the time at which each M112 passes."""
    with SimulatedPrinter(load().machine, SPEED, tcp=0) as printer, socket.create_server(("127.0.0.1", 0)) as relay:
        print(relay.getsockname()[1], flush=True)
        inner = ("127.0.0.1", int(printer.path.rpartition(":")[2]))
        while True:
            host, _ = relay.accept()
            host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            there = socket.create_connection(inner)
            there.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            Thread(target=_pass_on, args=(there, host), daemon=True).start()
            Thread(target=_pass_on, args=(host, there, True), daemon=True).start()


def _pass_on(start: socket.socket, end: socket.socket, watched: bool = False) -> None:
    """Bytes from one connection to another until either ends."""
    last = b""
    try:
        while data := start.recv(READ_BYTES):
            now_s = monotonic()
            if watched and STOP in last + data:
                print(now_s, flush=True)
                last = b""
            else:
                last = (last + data)[1 - len(STOP) :]
            end.sendall(data)
    except OSError:
        pass
    finally:
        for each in (start, end):
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)


class Printer:
    """A printer in a process of its own. port: where it is reached."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self.port = f"socket://127.0.0.1:{self._line().strip()}"

    def stopped_s(self) -> float:
        """When the next M112 has passed."""
        return float(self._line())

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()


@contextmanager
def started() -> Iterator[Printer]:
    """A printer until it is not needed any more."""
    process = subprocess.Popen([sys.executable, "-m", "tools.stop_campaign", "--printer"], stdout=subprocess.PIPE, text=True)
    try:
        yield Printer(process)
    finally:
        process.kill()
        process.wait()


def begin_prints(page: PrintPage, ports: Sequence[str]) -> list[int]:
    """The numbers of prints at these ports that all move already."""
    for port in ports:
        page.do("check", port=port)

    def of(port: str) -> dict[str, Any]:
        return next((each for each in page.state["prints"] if each["port"] == port), {"phase": ""})

    page.until(lambda one: all(of(port)["phase"] in ("ready", "over") for port in ports))
    for port in ports:
        page.do("begin", print=of(port)["number"])
    page.until(lambda one: all((of(port)["progress"] or {}).get("state") == "printing" for port in ports))
    return [int(of(port)["number"]) for port in ports]


def ended(page: PrintPage, number: int) -> dict[str, Any]:
    """The last state of a print."""

    def of(number: int) -> dict[str, Any]:
        return next(each for each in page.state["prints"] if each["number"] == number)

    page.until(lambda one: of(number)["phase"] == "over")
    return of(number)


def listen(page: PrintPage, until_s: float) -> None:
    """Hear what the page is told, until a moment: a page that reads nothing is taken for one that has gone."""
    with suppress(TimeoutError):
        while True:
            page.hear(until_s)


class Opening:
    """A model that is opened on a bench of its own. took_s: how long that has taken, 0 while it lasts."""

    def __init__(self, running: Running, model: Path) -> None:
        self.took_s, self._running, self._model = 0.0, running, model
        above = f"/{running.place.split('/')[1]}/benches"
        self._origin = f"http://127.0.0.1:{running.port}"
        self._number = json.loads(running.ask(f"{above}?like=1", "POST", Origin=self._origin)[1])["number"]
        self._close = f"{above}/{self._number}"
        self._thread = Thread(target=self._open)
        self._thread.start()

    def _open(self) -> None:
        began = monotonic()
        bench = Running(self._running.process, self._running.address.replace("/1/", f"/{self._number}/"))
        status, content = bench.send(self._model)
        if status != 200:
            raise SystemExit(content.decode())
        with bench.line() as page:
            bench.ask(f"model/{page.state['model']['key']}")  # as the page does
        self.took_s = monotonic() - began

    def end(self) -> None:
        """Wait for it and close the bench."""
        self._thread.join()
        self._running.ask(self._close, "DELETE", Origin=self._origin)


def stops_at(moments_s: Sequence[float], running: Running, model: Path) -> tuple[list[float], float]:
    """How long stops take that a page gives so long after a model has begun to be opened, and how long that takes."""
    with ExitStack() as stack, prints_line(running, "campaign") as page:
        printers = [stack.enter_context(started()) for _ in moments_s]
        numbers = begin_prints(page, [printer.port for printer in printers])
        opening, began, took = Opening(running, model), monotonic(), []
        for moment_s, number, printer in zip(sorted(moments_s), numbers, printers, strict=True):
            listen(page, began + moment_s)
            sent_s = monotonic()
            page.do("emergency", print=number)
            took.append(printer.stopped_s() - sent_s)
        for number in numbers:
            last = ended(page, number)
            if not last["sentence"].startswith(HALTED):
                raise SystemExit(f"a stop is not confirmed: {last['sentence']}")
            page.do("forget", print=number)
        opening.end()
        return took, opening.took_s


def slice_box(page: Page, running: Running, folder: Path) -> None:
    """Have a box sliced on the first bench."""
    (folder / "box.stl").write_bytes(stl(box(40.0, 40.0, 40.0)))
    running.send(folder / "box.stl")
    page.do("slice")
    page.until(lambda state: state["sliced"])


def main() -> None:
    """Stop prints while models are opened, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stops", type=int, default=50)
    parser.add_argument("--faces", type=int, default=2_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--printer", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.printer:
        serve()
    harness.PATIENCE_S = PATIENCE_S
    chance, took, window_s = random.Random(asked.seed), list[float](), 15.0
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        ball = Path(name) / "ball.stl"
        ball.write_bytes(stl(mesh_of(m3.Manifold.sphere(BALL_MM, 4 * round((asked.faces / 8) ** 0.5)))))
        running = stack.enter_context(workbench(*QUICK))
        with running.line() as page:
            slice_box(page, running, Path(name))
        while len(took) < asked.stops:
            moments_s = [chance.uniform(0.0, window_s) for _ in range(min(AT_ONCE, asked.stops - len(took)))]
            fresh, window_s = stops_at(moments_s, running, ball)
            took += fresh
            told = " ".join(f"{1000 * each:.0f}" for each in fresh)
            print(f"opened in {window_s:.1f} s, stops after {told} ms", flush=True)
    worst, middle = 1000 * max(took), 1000 * statistics.median(took)
    print(f"{len(took)} stops, all arrived: worst {worst:.0f} ms, median {middle:.0f} ms")


if __name__ == "__main__":
    main()
