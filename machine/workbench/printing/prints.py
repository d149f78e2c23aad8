"""Prints: all that a workbench prints, one at a port, and which page commands which.

Only one page commands a print, the one that has started it; the others see it, and may take the command over by asking for it.
The emergency stop alone is every page's: who sees that something goes wrong must not look for another window first.
"""

import asyncio
import json
from collections import Counter
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from os.path import realpath
from pathlib import Path
from threading import Event as Flag
from typing import Any

from machine.firmware.firmware import check_baud
from machine.link.port import stable_name
from machine.pipeline.output import write_bytes
from machine.pipeline.requests import BAUD
from machine.printing.destination import Destination, SerialPort, Server, Simulated, parse_destination
from machine.printing.history import past_prints
from machine.printing.job import PrintJob
from machine.printing.journal_folder import ResumableJournal, resumable_journals
from machine.printing.ports import answer_words, ask_ports, known_ports, port_json
from machine.workbench.printing.running_print import RunningPrint
from machine.workbench.session.base import Observable
from profiles.errors import OutputError, PrinterError
from profiles.folders import state_folder

FILE = "last-printer.json"  # of the state folder
MOST_OVER = 5  # prints that are over stay to be looked at, the newest ones


class Prints(Observable):
    """All from the event loop; pages wait for `changed`."""

    def __init__(self) -> None:
        super().__init__()
        self.prints: list[RunningPrint] = []
        self._last = 0  # number that was given
        self._last_printer = last_printer()
        self._pages: Counter[str] = Counter()
        self._ports: list[dict[str, Any]] | None = None
        self._journals: list[ResumableJournal] | None = None
        self._history = past_prints()
        self._reads_journals = False
        self._over: Flag | None = None  # ends the asking of ports that is under way
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def running(self) -> list[RunningPrint]:
        """Those of which something goes on."""
        return [job for job in self.prints if not job.over]

    @property
    def ports_known(self) -> set[str]:
        """Ports that were found here, those of the prints that are listed, and the one that was printed at last."""
        last = {self._last_printer.name} if self._last_printer else set()
        return {report["port"] for report in self._ports or ()} | {job.state.port for job in self.prints} | last

    @property
    def journals_known(self) -> set[str]:
        """Journals that were found here."""
        return {str(journal.path) for journal in self._journals or ()}

    def snapshot(self) -> dict[str, Any]:
        """The state of all prints for every page."""
        return {
            "version": self.version,
            "ports": self._ports,
            "asking": self._over is not None,
            "last_printer": printer_json(self._last_printer) if self._last_printer else None,
            "journals": self._journals_state(),
            "history": self._history,
            "prints": [
                {**job.state.json(), "number": job.number, "holder": job.holder, "held": bool(self._pages[job.holder])}
                for job in self.prints
            ],
        }

    @contextmanager
    def page(self, page: str) -> Iterator[None]:
        """A page that is there; one that goes leaves its prints alone, and their command to whoever takes it."""
        self._pages[page] += 1
        self.notify()
        try:
            yield
        finally:
            self._pages[page] -= 1
            self.notify()

    def close(self) -> None:
        """End the asking; the prints end by themselves, heaters off, for their pipes end with this process."""
        if self._over is not None:
            self._over.set()

    async def end_all(self) -> list[str]:
        """End every print as a cancel does, but leave those on print servers, and wait for that; the last words of each."""
        running = self.running
        for job in running:
            job.end()
        while any(not job.over for job in running):
            await self.changed(self.version)
        return [line for job in running for line in (*job.state.said[-2:], f"{job.state.port}: {job.state.sentence}")]

    def begin(self, page: str, job: PrintJob) -> None:
        """Have something printed, commanded by a page. Raises PrinterError where the port, or the journal, is in use."""
        at = job.destination
        if job.starts and any(other.job.starts and _same(other.job.destination, at) for other in self.running):
            raise PrinterError(f"port {at.name} prints already: wait until that is done, or cancel it")
        if job.cut_off is not None and realpath(job.cut_off) in map(realpath, self._journals_in_use()):
            raise PrinterError(f"journal {job.cut_off}: its print goes on already, or has not ended")
        self._forget_old(at)
        self._last_printer = at
        keep_printer(at)
        self._last += 1
        begun = RunningPrint(self._last, job, page, self.notify)
        self.prints.append(begun)
        self._start(self._print(begun))
        self.notify()

    def _forget_old(self, at: Destination) -> None:
        """Drop what is over at a port that prints anew, and all but the newest of what is over elsewhere. What runs stays:
        only what is listed can be stopped."""
        over = [job for job in self.prints if job.over and not _same(job.job.destination, at)][-MOST_OVER:]
        self.prints = [job for job in self.prints if not job.over or job in over]

    async def _print(self, begun: RunningPrint) -> None:
        try:
            await begun.run()
        except Exception as error:  # noqa: BLE001 - the print is told to be over, whatever it was
            await begun.fail(error)
        self._history = await asyncio.to_thread(past_prints)
        self.notify()

    def stop_at_once(self, number: object) -> None:
        """The one that was named, all when none was or there never was such a one: in doubt everything stops. One that is over
        already, in the list or not any more, stops no other: a button is pressed twice in a fright, and a press may come late."""
        known = isinstance(number, int) and 0 < number <= self._last
        for job in self.prints if known else self.running:
            if job.number == number or not known:
                job.stop_at_once()

    def numbered(self, number: object) -> RunningPrint:
        """The print of a number. Raises PrinterError where it is not there."""
        for running in self.prints:
            if running.number == number:
                return running
        raise PrinterError("this print is not there any more")

    def _journals_state(self) -> list[dict[str, Any]] | None:
        """Those that can be resumed, None before anybody has asked."""
        if self._journals is None:
            return None
        in_use = self._journals_in_use()
        return [asdict(journal) | {"path": str(journal.path)} for journal in self._journals if str(journal.path) not in in_use]

    def _journals_in_use(self) -> set[str]:
        """The journals of prints that run, and of those whose rest is printed."""
        return {path for job in self.running for path in (job.state.journal, job.state.resumes) if path}

    def look_for_journals(self) -> None:
        """Read which prints can be gone on with."""
        if not self._reads_journals:
            self._reads_journals = True
            self._start(self._read_journals())

    async def _read_journals(self) -> None:
        try:
            self._journals = await asyncio.to_thread(resumable_journals)
        finally:
            self._reads_journals = False
            self.notify()

    def look_for_ports(self, baud: int) -> None:
        """Ask at every port who answers. Raises PrinterError for a rate that is not possible."""
        check_baud(baud)
        if self._over is None:
            self._over = Flag()
            self._start(self._ask_ports(baud, self._over))

    async def _ask_ports(self, baud: int, over: Flag) -> None:
        try:
            used = [job.state.port for job in self.running]
            devices = await asyncio.to_thread(known_ports)
            reports = await asyncio.to_thread(ask_ports, devices, baud, over, [*used, *map(stable_name, used)])
            self._ports = [{**port_json(report), "words": answer_words(report)} for report in reports]
        finally:
            self._over = None
            self.notify()

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def _same(a: Destination, b: Destination) -> bool:
    """Whether two destinations are one port, or one print server."""
    if isinstance(a, Server) and isinstance(b, Server):
        return a.url == b.url
    return stable_name(a.name) == stable_name(b.name)


def last_printer() -> Destination | None:
    """The destination that was printed at last, so that nobody chooses it again at the next start; None where none was kept, or
    what is there says nothing."""
    try:
        port, baud, speed = (json.loads(_path().read_bytes())[key] for key in ("port", "baud", "sim_speed"))
        return parse_destination(str(port), int(baud), float(speed))
    except (OSError, ValueError, OverflowError, KeyError, TypeError, OutputError, PrinterError):
        return None


def keep_printer(at: Destination) -> None:
    """Keep it for the next start. Where it cannot be written it is forgotten: a print does not fail for that."""
    with suppress(OSError, OutputError):
        write_bytes(_path(), json.dumps(printer_json(at)).encode(), private=True)


def printer_json(at: Destination) -> dict[str, Any]:
    """The fields of a page in which it is chosen."""
    baud, speed = at.baud if isinstance(at, SerialPort) else BAUD, at.speed if isinstance(at, Simulated) else 0.0
    return {"port": at.name, "baud": baud, "sim_speed": speed}


def _path() -> Path:
    return state_folder() / FILE
