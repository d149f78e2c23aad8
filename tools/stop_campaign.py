"""Emergency stops at random moments while a large model is opened: how long each takes from the page to the printer's wire.

    python tools/stop_campaign.py [--stops 50] [--faces 2000000] [--seed 1]

One bench prints a box at several simulated printers, each a process of its own behind a relay that notes when M112 passes; a
second one is opened for a ball of a number of faces, and meanwhile a page stops one print after the other. Another page asks all
the time for what is refused at once: moments that 50 stops do not meet are among its thousands.

A busy computer lets everything wait. On each core a process that only sleeps tells when it was woken too late; what of the time
of an answer one of them has overslept is left out of the second figure. Exits with 1 where a stop has not arrived or is not
confirmed. Clocks are compared, so all must run on one computer.
"""

import argparse
import json
import os
import random
import socket
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep
from typing import Any, TextIO

import manifold3d as m3

from machine.simulator.simulator import SimulatedPrinter
from mdp.cut import mesh_of
from mdp.save import stl
from profiles.profile import load
from tests.machine import prints
from tests.machine import workbench as harness
from tests.machine.prints import PrintPage, prints_line
from tests.machine.running_workbench import QUICK, Page, Running, workbench
from tests.shapes import box

Span = tuple[float, float]  # begin and end, s
AT_ONCE = 5  # prints that run while one model is opened
SPEED = 10.0  # times real time, of the printers: the print lasts longer than the model takes
STOP, READ_BYTES = b"M112", 65536
BALL_MM = 20.0
ASK_EVERY_S, LIGHT_SLEEP_S = 0.01, 0.002
PATIENCE_S = 600.0  # with the model, on a busy computer
HALTED = "emergency stop: the printer has halted"


def serve() -> None:
    """A printer's process: tells the port of its relay, then the time at which each M112 passes."""
    with SimulatedPrinter(load().machine, SPEED, at=0) as printer, socket.create_server(("127.0.0.1", 0)) as relay:
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
        for side in (start, end):
            with suppress(OSError):
                side.shutdown(socket.SHUT_RDWR)


def sleep_lightly(core: int) -> None:
    """A process that only sleeps on a core: tells from when to when it has slept longer than it wanted."""
    os.sched_setaffinity(0, {core})
    while True:
        due_s = monotonic() + LIGHT_SLEEP_S
        sleep(LIGHT_SLEEP_S)
        now_s = monotonic()
        if now_s - due_s > LIGHT_SLEEP_S:
            print(due_s, now_s, flush=True)


class Printer:
    """A printer in a process of its own. port: where it is reached."""

    def __init__(self, own: "subprocess.Popen[str]") -> None:
        self._process = own
        self.port = f"socket://127.0.0.1:{self._line().strip()}"

    def stopped_s(self) -> float:
        """When the next M112 has passed."""
        return float(self._line())

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()


@contextmanager
def process(*part: str, out: Any = subprocess.PIPE) -> Iterator["subprocess.Popen[str]"]:
    """A part of this program as a process of its own, as long as it is needed."""
    own = subprocess.Popen([sys.executable, "-m", "tools.stop_campaign", *part], stdout=out, text=True)
    try:
        yield own
    finally:
        own.kill()
        own.wait()


def begin_prints(page: PrintPage, ports: Sequence[str]) -> list[int]:
    """The numbers of prints at these ports that all move already."""

    def of(port: str) -> dict[str, Any]:
        return next((entry for entry in page.state["prints"] if entry["port"] == port), {"over": True, "state": "", "number": 0})

    while wanting := [port for port in ports if of(port)["over"]]:  # a busy computer asks a printer in vain
        before = {port: of(port)["number"] for port in wanting}
        for port in wanting:
            page.do("check", port=port)
        page.until(lambda state: all(of(port)["number"] != number for port, number in before.items()))  # noqa: B023
        page.until(lambda state: all((of(port)["over"] or of(port)["state"] == "ready") for port in ports))
    for port in ports:
        page.do("begin", print=of(port)["number"])
    page.until(lambda state: all(of(port)["over"] or _moves(of(port)) for port in ports))
    if ended_early := [of(port)["sentence"] for port in ports if of(port)["over"]]:
        raise SystemExit(f"a print has not begun: {ended_early[0]}")
    return [int(of(port)["number"]) for port in ports]


def _moves(state: dict[str, Any]) -> bool:
    return bool(state["progress"]) and state["progress"]["state"] == "printing"


def ended(page: PrintPage, number: int) -> dict[str, Any]:
    """The last state of a print."""

    def of(number: int) -> dict[str, Any]:
        return next(entry for entry in page.state["prints"] if entry["number"] == number)

    page.until(lambda state: of(number)["over"])
    return of(number)


def listen(page: PrintPage, until_s: float) -> None:
    """Hear what the page is told, until a moment: a page that reads nothing is taken for one that has gone."""
    with suppress(TimeoutError):
        while True:
            page.hear(until_s)


class Asking:
    """A page that asks all the time while it is open. spans: when each question was asked and answered."""

    def __init__(self, running: Running) -> None:
        self.spans: list[Span] = []
        self._running, self._ended = running, Event()
        self._thread = Thread(target=self._ask)

    def __enter__(self) -> "Asking":
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._thread.join()

    def _ask(self) -> None:
        with prints_line(self._running, "asking") as page:
            while not self._ended.wait(ASK_EVERY_S):
                asked_s = monotonic()
                page.do("pause", print=0)
                page.refused()
                self.spans.append((asked_s, monotonic()))


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


def stops_at(moments_s: Sequence[float], running: Running, model: Path) -> tuple[list[Span], list[Span], float]:
    """When stops are given, so long after a model has begun to be opened, and when they pass; when other questions are asked and
    answered; and how long it takes to open the model."""
    with ExitStack() as stack, prints_line(running, "campaign") as page:
        printers = [Printer(stack.enter_context(process("--printer"))) for _ in moments_s]
        numbers = begin_prints(page, [printer.port for printer in printers])
        asking = stack.enter_context(Asking(running))
        opening, began, took = Opening(running, model), monotonic(), list[Span]()
        for moment_s, number, printer in zip(sorted(moments_s), numbers, printers, strict=True):
            listen(page, began + moment_s)
            sent_s = monotonic()
            page.do("emergency", print=number)
            took.append((sent_s, printer.stopped_s()))
        for number in numbers:
            last = ended(page, number)
            if not last["sentence"].startswith(HALTED):
                raise SystemExit(f"a stop is not confirmed: {last['sentence']}")
            page.do("forget", print=number)
        opening.end()
        return took, asking.spans, opening.took_s


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
    parser.add_argument("--sleeper", type=int, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.printer:
        serve()
    if asked.sleeper is not None:
        sleep_lightly(asked.sleeper)
    harness.PATIENCE_S = prints.PATIENCE_S = PATIENCE_S
    chance, window_s, stops, answers = random.Random(asked.seed), 15.0, list[Span](), list[Span]()
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        ball = Path(name) / "ball.stl"
        ball.write_bytes(stl(mesh_of(m3.Manifold.sphere(BALL_MM, 4 * round((asked.faces / 8) ** 0.5)))))
        running = stack.enter_context(workbench(*QUICK))
        nights = [stack.enter_context((Path(name) / f"core {core}").open("w+")) for core in os.sched_getaffinity(0)]
        for core, night in zip(os.sched_getaffinity(0), nights, strict=True):
            stack.enter_context(process("--sleeper", f"{core}", out=night))
        with running.line() as page:
            slice_box(page, running, Path(name))
        while len(stops) < asked.stops:
            moments_s = [chance.uniform(0.0, window_s) for _ in range(min(AT_ONCE, asked.stops - len(stops)))]
            fresh, asked_for, window_s = stops_at(moments_s, running, ball)
            stops, answers = stops + fresh, answers + asked_for
            delays = " ".join(f"{1000 * (end - begin):.0f}" for begin, end in fresh)
            print(f"opened in {window_s:.1f} s, stops after {delays} ms", flush=True)
        overslept = united(span for night in nights for span in read_spans(night))
    print(f"{len(stops)} stops, all arrived: {figures(stops, overslept)}")
    print(f"{len(answers)} other answers: {figures(answers, overslept)}")


def read_spans(night: TextIO) -> list[Span]:
    """What a sleeper has told."""
    night.seek(0)
    rows = [line.split() for line in night.read().splitlines()[:-1]]
    return [(float(begin), float(end)) for begin, end in rows]


def united(spans: Iterable[Span]) -> list[Span]:
    """Spans of which those that overlap are one."""
    whole: list[Span] = []
    for begin, end in sorted(spans):
        if whole and begin <= whole[-1][1]:
            whole[-1] = whole[-1][0], max(end, whole[-1][1])
        else:
            whole.append((begin, end))
    return whole


def figures(spans: Sequence[Span], overslept: Sequence[Span]) -> str:
    """How long they are, in milliseconds."""
    whole = [end - begin for begin, end in spans]
    own = [end - begin - sum(max(min(end, b) - max(begin, a), 0.0) for a, b in overslept) for begin, end in spans]
    worst, median, worst_own = (1000 * seconds for seconds in (max(whole), statistics.median(whole), max(own)))
    return f"worst {worst:.0f} ms, median {median:.1f} ms; without what was overslept worst {worst_own:.0f} ms"


if __name__ == "__main__":
    main()
