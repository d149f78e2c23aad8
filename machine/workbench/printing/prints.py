"""Prints: all prints of a workbench, one per port, and the pages that control them.

The page that starts a print controls it; other pages see it, and may take over control. Only the emergency stop is available to
every page: in an emergency no one should have to find another window.
"""

import asyncio
import json
from collections import Counter
from collections.abc import Iterator
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
from machine.quantities import about, amount
from machine.workbench.printing.running_print import RunningPrint
from machine.workbench.session.base import Observable
from profiles.errors import OutputError, PrinterError
from profiles.folders import state_folder

FILE = "last-printer.json"  # in the state folder
MOST_OVER = 5  # finished prints that stay listed


class Prints(Observable):
    """Prints, used from one event loop; pages wait for `changed`."""

    def __init__(self) -> None:
        super().__init__()
        self.prints: list[RunningPrint] = []
        self._last = 0  # last number given
        self._last_printer = last_printer()
        self._pages: Counter[str] = Counter()
        self._ports: list[dict[str, Any]] | None = None
        self._journals: list[ResumableJournal] | None = None
        self._history = past_prints()
        self._reads_journals = False
        self._over: Flag | None = None  # cancels the running query of ports

    @property
    def running(self) -> list[RunningPrint]:
        """Prints that have not ended."""
        return [job for job in self.prints if not job.over]

    @property
    def ports_known(self) -> set[str]:
        """Ports that were found here, those of the listed prints, and the one used last."""
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
            "history": [past_row(past) for past in self._history],
            "prints": [
                {
                    **job.state.json(),
                    "webcam": bool(job.state.webcam),  # the page gets its picture from this server
                    "number": job.number,
                    "holder": job.holder,
                    "held": bool(self._pages[job.holder]),
                }
                for job in self.prints
            ],
        }

    @contextmanager
    def page(self, page: str) -> Iterator[None]:
        """Register a connected page. When it disconnects, its prints continue, and any page may take control of them."""
        self._pages[page] += 1
        self.notify()
        try:
            yield
        finally:
            self._pages[page] -= 1
            self.notify()

    def close(self) -> None:
        """Cancel the query of ports. Prints end by themselves, heaters off, when their pipes close with this process."""
        if self._over is not None:
            self._over.set()

    async def end_all(self) -> list[str]:
        """Cancel every print, or leave it to its print server, and wait for the ends; returns the last messages of each."""
        running = self.running
        for job in running:
            job.end()
        while any(not job.over for job in running):
            await self.changed(self.version)
        return [line for job in running for line in (*job.state.said[-2:], f"{job.state.port}: {job.state.sentence}")]

    def begin(self, page: str, job: PrintJob) -> None:
        """Start a print, controlled by a page. Raises PrinterError if the port or the journal is in use."""
        at = job.destination
        if job.starts and any(other.job.starts and _same(other.job.destination, at) for other in self.running):
            raise PrinterError(f"port {at.name} prints already: wait until that is done, or cancel it")
        if job.cut_off is not None and realpath(job.cut_off) in map(realpath, self._journals_in_use()):
            raise PrinterError(f"journal {job.cut_off}: its print has been resumed already, or has not ended")
        self._forget_old(at)
        self._last_printer = at
        keep_printer(at)
        self._last += 1
        begun = RunningPrint(self._last, job, page, self.notify)
        self.prints.append(begun)
        self.launch(self._print(begun))
        self.notify()

    def _forget_old(self, at: Destination) -> None:
        """Remove finished prints at a port that prints again, and all but the newest elsewhere. Running prints stay listed,
        because only listed ones can be stopped."""
        over = [job for job in self.prints if job.over and not _same(job.job.destination, at)][-MOST_OVER:]
        self.prints = [job for job in self.prints if not job.over or job in over]

    async def _print(self, begun: RunningPrint) -> None:
        try:
            await begun.run()
        except Exception as error:  # noqa: BLE001 - whatever happened, the print is marked as ended
            await begun.fail(error)
        self._history = await asyncio.to_thread(past_prints)
        self.notify()

    def stop_at_once(self, number: object) -> None:
        """Stop the print with this number, or all if the number is missing or was never used: when in doubt everything stops. The
        number of a finished print stops no other, because a button may be pressed twice or late."""
        known = isinstance(number, int) and 0 < number <= self._last
        for job in self.prints if known else self.running:
            if job.number == number or not known:
                job.stop_at_once()

    def numbered(self, number: object) -> RunningPrint:
        """The print with this number. Raises PrinterError if it is not listed."""
        for running in self.prints:
            if running.number == number:
                return running
        raise PrinterError("this print no longer exists")

    def _journals_state(self) -> list[dict[str, Any]] | None:
        """Journals that can be resumed, None before they have been requested."""
        if self._journals is None:
            return None
        in_use = self._journals_in_use()
        return [asdict(journal) | {"path": str(journal.path)} for journal in self._journals if str(journal.path) not in in_use]

    def _journals_in_use(self) -> set[str]:
        """Journals of running prints, and of those that they resume."""
        return {path for job in self.running for path in (job.state.journal, job.state.resumes) if path}

    def look_for_journals(self) -> None:
        """Read which prints can be resumed."""
        if not self._reads_journals:
            self._reads_journals = True
            self.launch(self._read_journals())

    async def _read_journals(self) -> None:
        try:
            self._journals = await asyncio.to_thread(resumable_journals)
        finally:
            self._reads_journals = False
            self.notify()

    def look_for_ports(self, baud: int) -> None:
        """Query all ports. Raises PrinterError for an impossible baud rate."""
        check_baud(baud)
        if self._over is None:
            self._over = Flag()
            self.launch(self._ask_ports(baud, self._over))

    async def _ask_ports(self, baud: int, over: Flag) -> None:
        try:
            used = [job.state.port for job in self.running]
            devices = await asyncio.to_thread(known_ports)
            reports = await asyncio.to_thread(ask_ports, devices, baud, over, [*used, *map(stable_name, used)])
            self._ports = [{**port_json(report), "words": answer_words(report)} for report in reports]
        finally:
            self._over = None
            self.notify()


def _same(a: Destination, b: Destination) -> bool:
    """Whether two destinations are the same port or print server."""
    if isinstance(a, Server) and isinstance(b, Server):
        return a.url == b.url
    return stable_name(a.name) == stable_name(b.name)


def past_row(past: dict[str, Any]) -> dict[str, Any]:
    """Name, outcome, time and filament of a past print as texts, and its start, which a browser shows in its own time zone."""
    seconds, metres = past["seconds"], past["filament_m"]
    time, filament = "–" if seconds is None else about(seconds), "–" if metres is None else f"{amount(metres, 1)} m"
    return {"cells": [past["name"], past["outcome"], time, filament], "begun": past["begun"]}


def last_printer() -> Destination | None:
    """The destination that was used last, as the default; None if it was not stored or is invalid."""
    try:
        port, baud, speed = (json.loads(_path().read_bytes())[key] for key in ("port", "baud", "sim_speed"))
        return parse_destination(str(port), int(baud), float(speed))
    except (OSError, ValueError, OverflowError, KeyError, TypeError, OutputError, PrinterError):
        return None


def keep_printer(at: Destination) -> None:
    """Store the destination as the next default. Errors are ignored, because a print must not fail for that."""
    with suppress(OSError, OutputError):
        write_bytes(_path(), json.dumps(printer_json(at)).encode(), private=True)


def printer_json(at: Destination) -> dict[str, Any]:
    """Values of the page's fields for a destination."""
    baud, speed = at.baud if isinstance(at, SerialPort) else BAUD, at.speed if isinstance(at, Simulated) else 0.0
    return {"port": at.name, "baud": baud, "sim_speed": speed}


def _path() -> Path:
    return state_folder() / FILE
