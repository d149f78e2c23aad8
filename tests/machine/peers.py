"""Peers for tests of the link, at a pseudo-terminal, at a socket and behind RFC 2217, and a port with a patient clock."""

import os
import pty
import select
import socket
import termios
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from time import monotonic
from types import ModuleType

import pytest
import serial
import serial.rfc2217

from machine.link import identification
from machine.link.port import Port
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.record import Record

RATES = {getattr(termios, f"B{rate}"): rate for rate in (9600, 57600, 115200, 230400, 1000000)}
Answer = Callable[[bytes, int], bytes]  # bytes received, baud rate set by the host -> answer
PATIENCE_S = 60.0  # timeout for bytes that must arrive, long enough for a busy machine


@contextmanager
def on_terminal(answer: Answer, greeting: bytes = b"") -> Iterator[str]:
    """The path of a pseudo-terminal with a peer that answers by a function."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    over, end = os.pipe()

    def serve() -> None:
        os.write(master, greeting)
        while over not in (ready := select.select([master, over], [], [])[0]):
            if master in ready:
                baud = RATES.get(termios.tcgetattr(slave)[5], 0)
                os.write(master, answer(os.read(master, 4096), baud))

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        os.write(end, b"x")
        thread.join(PATIENCE_S)
        for descriptor in (master, slave, over, end):
            os.close(descriptor)


def scripted(words: dict[str, str], otherwise: str = "ok") -> Answer:
    """A peer that answers each line that begins with a word of the table by its entry, any other line by a default."""
    half = [b""]

    def answer(data: bytes, _baud: int) -> bytes:
        *lines, half[0] = (half[0] + data).split(b"\n")
        said = [_said(line.decode("ascii", "replace"), words, otherwise) for line in lines if line.strip()]
        return "".join(said).encode("ascii")

    return answer


def _said(line: str, words: dict[str, str], otherwise: str) -> str:
    command = line.partition(" ")[2].partition("*")[0] if line.startswith("N") else line
    text = next((answer for word, answer in words.items() if command.startswith(word)), otherwise)
    return f"{text}\n" if text else ""


@contextmanager
def on_socket(firmware: SimulatedFirmware) -> Iterator[str]:
    """The socket:// address of an infinitely fast firmware; it accepts one host after the other."""
    server = socket.create_server(("localhost", 0))

    def serve() -> None:
        while True:
            try:
                host, _ = server.accept()
            except OSError:
                return
            host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with host:
                try:
                    while data := host.recv(4096):
                        firmware.receive(data)
                        host.sendall(firmware.advance())
                except OSError:
                    continue

    threading.Thread(target=serve, daemon=True).start()
    try:
        yield f"socket://localhost:{server.getsockname()[1]}"
    finally:
        server.shutdown(socket.SHUT_RDWR)
        server.close()


class _WithoutModemLines(serial.Serial):  # type: ignore[misc]
    """A pseudo-terminal has no modem lines and reports an error."""

    cts = dsr = ri = cd = True

    def _update_dtr_state(self) -> None:
        return

    def _update_rts_state(self) -> None:
        return


class _Wire:
    """The object to which pyserial's PortManager writes its own messages."""

    def __init__(self, host: socket.socket) -> None:
        self.write = host.sendall


@contextmanager
def behind_rfc2217(path: str) -> Iterator[str]:
    """The rfc2217:// address of a server for one host, made of pyserial's own PortManager, in front of a serial device."""
    server = socket.create_server(("localhost", 0))

    def serve() -> None:
        host, _ = server.accept()
        host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            with host, _WithoutModemLines(path, timeout=0) as device:
                _serve_rfc2217(host, device)
        except OSError:  # the device behind it has disappeared
            return

    threading.Thread(target=serve, daemon=True).start()
    try:
        yield f"rfc2217://localhost:{server.getsockname()[1]}"
    finally:
        server.close()


def _serve_rfc2217(host: socket.socket, device: serial.Serial) -> None:
    """Forward both directions until the host hangs up."""
    manager = serial.rfc2217.PortManager(device, _Wire(host))
    while True:
        ready = select.select([host, device], [], [], 5.0)[0]
        if host in ready:
            data = host.recv(4096)
            if not data:
                return
            device.write(b"".join(manager.filter(data)))
        if device in ready:
            host.sendall(b"".join(manager.escape(device.read(4096))))


class Ear:
    """A port and the clock of its reader: once the other end has answered and is silent again, every timeout has expired.

    Thus a late answer, on a busy machine, is not taken for silence, and there is no wait after an answer.
    """

    _ahead = threading.local()  # ports are queried at the same time, each in its own thread

    def __init__(self, port: Port) -> None:
        self._port, self.name, self.set_baud = port, port.name, port.set_baud
        self._spoke = False

    def write(self, data: bytes) -> None:
        """Send a query."""
        self._spoke = False
        self._port.write(data)

    def read(self) -> bytes:
        """Read an answer."""
        data = self._port.read()
        if self._spoke and not data:
            self._ahead.s = self._ahead_s() + 10 * PATIENCE_S
        self._spoke = bool(data)
        return data

    @classmethod
    def now_s(cls) -> float:
        """The clock."""
        return monotonic() + cls._ahead_s()

    @classmethod
    def _ahead_s(cls) -> float:
        return float(getattr(cls._ahead, "s", 0.0))


def hear_out(monkeypatch: pytest.MonkeyPatch, asker: ModuleType, *mute: str) -> None:
    """Let a module query its ports once through an Ear; mute: ports on which no answer will come, which time out soon."""
    monkeypatch.setattr(identification, "SERIAL", replace(identification.SERIAL, now_s=Ear.now_s))
    monkeypatch.setattr(identification, "ASK_S", 10 * PATIENCE_S)
    monkeypatch.setattr(identification, "POSITION_S", PATIENCE_S)
    monkeypatch.setattr(identification, "QUICK_S", 0.1 if mute else PATIENCE_S)
    asked = identification.ask_at_any_rate

    def patiently(port: Port, baud: int, _patience_s: float = 0.0, over: threading.Event | None = None) -> object:
        return asked(Ear(port), baud, 0.1 if port.name in mute else PATIENCE_S, over)  # type: ignore[arg-type]

    monkeypatch.setattr(asker, "ask_at_any_rate", patiently)


def happened(record: Record, what: str) -> bool:
    """Whether a simulated printer's record has an event that begins with these words."""
    return any(text.startswith(what) for _, text in record.events)
