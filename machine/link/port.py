"""The serial port: the only place that knows pyserial. Every trouble becomes a PortError of one sentence."""

import errno
import os
import select
import stat
from time import monotonic
from types import TracebackType
from typing import Any, Self

import serial
from serial.tools import list_ports

from profiles.errors import PortError

READ_S = 0.05  # read() gives up after this, so that stops and time-outs are noticed
READ_BYTES = 4096
WRITE_S = 10.0  # a printer whose buffers stay full for longer has stopped reading
BAUDS = (1200, 4_000_000)  # slowest and fastest rate that an adapter is known to take

# termios.error is no OSError; pyserial lets it through when a setting is refused.
_TROUBLE: tuple[type[Exception], ...] = (serial.SerialException, OSError, ValueError)
if os.name == "posix":
    import termios

    _TROUBLE += (termios.error,)


class Port:
    """An open port: write all, read what is there.

    On POSIX the bytes go through pyserial's own file descriptor: its read() and write() add five system calls to a turn,
    as much time as all the rest of a turn takes.
    """

    def __init__(self, device: Any, name: str) -> None:
        self._device = device
        self._descriptor: int | None = getattr(device, "fd", None)
        self.name = name

    def write(self, data: bytes) -> None:
        """Send all bytes. PortError when the printer does not take them or the port is gone."""
        try:
            if self._descriptor is None:
                self._device.write(data)
            else:
                self._write_descriptor(self._descriptor, data)
        except serial.SerialTimeoutException:
            raise PortError(f"the printer at {self.name} has stopped reading: it took no bytes for {WRITE_S:g} s") from None
        except _TROUBLE as error:
            raise self._lost(error) from None

    def read(self) -> bytes:
        """The bytes that have come; waits up to READ_S for the first. PortError when the port is gone."""
        try:
            if self._descriptor is not None:
                return self._read_descriptor(self._descriptor)
            first: bytes = self._device.read(1)
            waiting = self._device.in_waiting if first else 0
            return first + self._device.read(waiting) if waiting else first
        except _TROUBLE as error:
            raise self._lost(error) from None

    def _write_descriptor(self, descriptor: int, data: bytes) -> None:
        until_s = monotonic() + WRITE_S
        while data:
            try:
                data = data[os.write(descriptor, data) :]
            except BlockingIOError:
                if not select.select([], [descriptor], [], max(0.0, until_s - monotonic()))[1]:
                    raise serial.SerialTimeoutException from None

    def _read_descriptor(self, descriptor: int) -> bytes:
        if not select.select([descriptor], [], [], READ_S)[0]:
            return b""
        try:
            data = os.read(descriptor, READ_BYTES)
        except BlockingIOError:
            return b""
        if not data:  # a descriptor that is always ready and gives nothing has lost its device
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return data

    def discard(self) -> None:
        """Forget bytes that were handed over but not sent yet."""
        try:
            self._device.reset_output_buffer()
        except _TROUBLE as error:
            raise self._lost(error) from None

    def close(self) -> None:
        """Close; a port that is gone already counts as closed."""
        try:
            self._device.close()
        except _TROUBLE:
            return

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _lost(self, error: Exception) -> PortError:
        return PortError(f"the connection at {self.name} was lost: is the cable or the printer unplugged? ({_reason(error)})")


def open_port(name: str, baud: int) -> Port:
    """Open a device path or a pyserial URL (socket://host:port, rfc2217://...) for this program alone.

    The modem lines are left as the system sets them on opening: a board with native USB sends only while DTR is up, one
    with a reset circuit restarts, which the greeting copes with. Raises PortError.
    """
    if not BAUDS[0] <= baud <= BAUDS[1]:
        raise PortError(f"baud rate {baud} is not possible: {BAUDS[0]} to {BAUDS[1]} is allowed, printers use 115200 or 250000")
    if "://" not in name:
        _check_path(name)
    try:
        device = serial.serial_for_url(
            name, baudrate=baud, timeout=READ_S, write_timeout=WRITE_S, exclusive=None if "://" in name else True
        )
    except _TROUBLE as error:
        raise PortError(refusal(name, baud, error)) from None
    return Port(device, name)


def port_names() -> list[str]:
    """Serial devices that exist, the stable names of USB adapters first."""
    folder = "/dev/serial/by-id"
    stable = [f"{folder}/{entry}" for entry in sorted(os.listdir(folder))] if os.path.isdir(folder) else []
    return stable + sorted(found.device for found in list_ports.comports())


def refusal(name: str, baud: int, error: Exception) -> str:
    """One sentence for a port that cannot be opened."""
    number = _number(error)
    text = str(error).lower()
    if "exclusively lock" in text or number in (errno.EBUSY, errno.EAGAIN):
        return f"port {name} is busy: another program holds it open"
    if number in (errno.EACCES, errno.EPERM):
        return f"port {name} may not be used by this user: {_owners(name)}"
    if number == errno.ENOENT:
        return missing(name)
    if number in (errno.ENOTTY, errno.EINVAL, errno.ENODEV, errno.ENXIO, errno.EIO):
        return f"port {name} is not a working serial device at {baud} baud ({_reason(error)})"
    return f"port {name} cannot be opened: {_reason(error)}"


def missing(name: str) -> str:
    """One sentence for a port that does not exist, with those that do."""
    there = port_names()
    return f"port {name} does not exist: {'there are ' + ', '.join(there) if there else 'no serial port was found'}"


def _check_path(name: str) -> None:
    if os.name != "posix":
        return
    try:
        mode = os.stat(name).st_mode
    except OSError as error:
        raise PortError(missing(name) if error.errno == errno.ENOENT else refusal(name, 0, error)) from None
    if not stat.S_ISCHR(mode):
        kind = "a folder" if stat.S_ISDIR(mode) else "a file"
        raise PortError(f"port {name} is {kind}, not a serial device")


def _owners(name: str) -> str:
    import grp

    try:
        group = grp.getgrgid(os.stat(name).st_gid).gr_name
    except (OSError, KeyError):
        return "its owner must allow it"
    return f"it belongs to group {group!r}; join that group (usermod -aG {group} USER) and log in again"


def _number(error: Exception) -> int | None:
    number = getattr(error, "errno", None)
    if number is None and error.args and isinstance(error.args[0], int):
        number = error.args[0]
    # pyserial wraps a failed tcgetattr as text only; the trouble itself is the one it was handling.
    return _number(error.__context__) if number is None and isinstance(error.__context__, Exception) else number


def _reason(error: Exception) -> str:
    """The system's own words in one line."""
    number = _number(error)
    return os.strerror(number).lower() if number else " ".join(str(error).split()).lower() or type(error).__name__
