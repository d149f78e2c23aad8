"""Serial port: the only module that uses pyserial. Every failure becomes a PortError with one sentence."""

import errno
import os
import select
import socket
import stat
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from time import monotonic
from typing import Any, Self
from urllib.parse import urlsplit

from machine.firmware.firmware import check_baud
from profiles.errors import PortError, causes

try:
    import serial
    from serial.tools import list_ports
except ImportError:  # pyserial does not support every system; socket:// remains
    serial = list_ports = None

READ_S = 0.02  # read() returns after this: an emergency stop must be on the wire within 50 ms
READ_BYTES = 4096
WRITE_S = 10.0  # a printer whose buffers stay full longer has stopped reading
CONNECT_S = 5.0

# termios.error is not an OSError, and pyserial raises it when a setting is refused. An rfc2217:// port that is closed or refuses
# a setting may raise AttributeError or NotImplementedError.
_TROUBLE: tuple[type[Exception], ...] = (OSError, ValueError, AttributeError, NotImplementedError)
_TIMEOUTS: tuple[type[Exception], ...] = (TimeoutError,)
if serial is not None:
    _TROUBLE, _TIMEOUTS = (*_TROUBLE, serial.SerialException), (*_TIMEOUTS, serial.SerialTimeoutException)
with suppress(ImportError):
    import termios

    _TROUBLE += (termios.error,)


@dataclass(frozen=True)
class SerialDevice:
    """A serial port of this computer."""

    name: str  # the stable name of a USB adapter, else the path
    path: str
    description: str
    serial_number: str
    model: str = ""  # vendor and product of a USB device, "" if unknown
    location: str = ""  # the USB socket


class RefusedPortError(PortError):
    """A port that cannot be opened. reason: the sentence without the port's name."""

    def __init__(self, name: str, reason: str) -> None:
        super().__init__(f"port {name} {reason}")
        self.reason = reason


class Port:
    """An open port with writes of all bytes and non-blocking reads.

    On POSIX devices and socket:// are read and written through the file descriptor: pyserial's read() and write() add five system
    calls, which double the time of a turn, and read a socket byte by byte.
    """

    def __init__(self, device: Any, name: str) -> None:
        self._device = device
        self._descriptor = _descriptor(device)
        self.name = name

    def set_baud(self, baud: int) -> None:
        """Change the rate, bits per second. Raises PortError when the device refuses it."""
        try:
            self._device.baudrate = baud
        except _TROUBLE as error:
            raise RefusedPortError(self.name, refusal(self.name, baud, error)) from None

    def write(self, data: bytes) -> None:
        """Send all bytes. Raises PortError when the printer does not accept them or the port is lost."""
        try:
            if self._descriptor is None:
                self._device.write(data)
            else:
                self._write_descriptor(self._descriptor, data)
        except _TROUBLE as error:
            if any(isinstance(cause, _TIMEOUTS) for cause in causes(error)):  # pyserial's own or its socket's
                raise PortError(f"the printer at {self.name} has stopped reading: it took no bytes for {WRITE_S:g} s") from None
            raise self._lost(error) from None

    def read(self) -> bytes:
        """The bytes received; waits up to READ_S for the first. Raises PortError when the port is lost."""
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
                    raise TimeoutError from None

    def _read_descriptor(self, descriptor: int) -> bytes:
        if not select.select([descriptor], [], [], READ_S)[0]:
            return b""
        try:
            data = os.read(descriptor, READ_BYTES)
        except BlockingIOError:
            return b""
        if not data:  # a descriptor that is ready but empty has lost its device
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return data

    def discard(self) -> None:
        """Discard bytes that are not sent yet."""
        try:
            self._device.reset_output_buffer()
        except _TROUBLE as error:
            raise self._lost(error) from None

    def close(self) -> None:
        """Close; a lost port counts as closed."""
        self._descriptor = None  # the system reuses its number for the next open file
        try:
            self._device.close()
        except _TROUBLE:
            return

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _lost(self, error: Exception) -> PortError:
        cause = "is the printer or the network down?" if "://" in self.name else "is the cable or the printer unplugged?"
        return PortError(f"the connection at {self.name} was lost: {cause} ({_reason(error)})")


def open_port(name: str, baud: int) -> Port:
    """Open a device path or a pyserial URL (socket://host:port, rfc2217://...) exclusively. Raises PortError.

    The modem lines keep the system's state at opening: a board with native USB sends only while DTR is set; a board with a reset
    circuit restarts, which the greeting handles.
    """
    check_baud(baud)
    if "://" in name:
        _check_address(name)
    else:
        _check_path(name)
    try:
        return Port(_open_device(name, baud), name)
    except _TROUBLE as error:
        raise RefusedPortError(name, refusal(name, baud, error)) from None


def _open_device(name: str, baud: int) -> Any:
    if name.startswith("socket://"):
        return _Socket(name)
    if serial is None:
        raise RefusedPortError(
            name, "cannot be opened: serial ports of this system are not known to pyserial, socket://HOST:PORT is left"
        )
    # pyserial's rfc2217:// has no write timeout
    write_s = None if name.startswith("rfc2217://") else WRITE_S
    return serial.serial_for_url(name, baudrate=baud, timeout=READ_S, write_timeout=write_s, exclusive=True)


class _Socket:
    """A socket:// address with the methods of pyserial's devices that Port calls, on every system. pyserial's own class reads
    byte by byte without a descriptor, and is missing where it supports no serial ports."""

    baudrate = 0  # accepted, without effect on a socket
    in_waiting = 0  # read() returns all bytes there are

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        self._socket = socket.create_connection((parts.hostname or "", parts.port or 0), CONNECT_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # a short line must not wait for the last answer
        self._socket.settimeout(0.0 if os.name == "posix" else WRITE_S)  # on POSIX a port reads and writes the descriptor itself
        self.fileno = self._socket.fileno

    def write(self, data: bytes) -> None:
        """Send all bytes. Raises OSError; TimeoutError after WRITE_S."""
        self._socket.sendall(data)

    def read(self, size: int) -> bytes:
        """All bytes received, whatever the size; waits up to READ_S. Raises OSError."""
        del size
        if not select.select([self._socket], [], [], READ_S)[0]:
            return b""
        data = self._socket.recv(READ_BYTES)
        if not data:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return data

    def reset_output_buffer(self) -> None:
        """Do nothing: bytes handed over belong to the system."""

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


def _descriptor(device: Any) -> int | None:
    """The file descriptor of a POSIX device or socket; None when pyserial has none."""
    if os.name != "posix":
        return None
    try:
        descriptor: int = device.fileno()
    except OSError:  # io.UnsupportedOperation: rfc2217:// and loop:// have none
        return None
    return descriptor


def serial_devices() -> tuple[SerialDevice, ...]:
    """The serial ports of this computer, each once, those with a stable name first."""
    stable = _stable_names()
    devices = [
        SerialDevice(
            name=stable.get(os.path.realpath(port.device), port.device),
            path=port.device,
            description=_description(port),
            serial_number=port.serial_number or "",
            model=_model(port),
            location=port.location or "",
        )
        for port in (() if list_ports is None else list_ports.comports())
    ]
    return tuple(sorted(devices, key=lambda device: (device.name == device.path, device.name)))


def _stable_names() -> dict[str, str]:
    """Device path -> its name under /dev/serial/by-id, which does not depend on the socket."""
    folder, names = "/dev/serial/by-id", list[str]()
    with suppress(OSError):
        names = sorted(os.listdir(folder), reverse=True)
    return {os.path.realpath(f"{folder}/{name}"): f"{folder}/{name}" for name in names}


def stable_name(port: str) -> str:
    """The name under which a device is found again: after replugging, its /dev/tty may differ."""
    return _stable_names().get(os.path.realpath(port), port)


def _description(port: Any) -> str:
    """Manufacturer and product as the adapter reports them over USB."""
    words = [word for word in (port.manufacturer, port.product or port.description) if word and word != "n/a"]
    ids = _model(port)
    return " ".join([*dict.fromkeys(words), *([f"({ids})"] if ids else [])])


def _model(port: Any) -> str:
    return f"{port.vid:04x}:{port.pid:04x}" if port.vid is not None and port.pid is not None else ""


def find_device(port: str, devices: Sequence[SerialDevice]) -> SerialDevice | None:
    """The device open under a name; None for an address, a pseudo-terminal, or a device that the system does not list."""
    path = os.path.realpath(port)
    return next((device for device in devices if port == device.name or path == os.path.realpath(device.path)), None)


def find_again(lost: SerialDevice, devices: Sequence[SerialDevice]) -> SerialDevice | None:
    """A lost USB device under its current name; None while it is missing.

    It has the same model and serial number; without a number, or when several share it, the same socket; without a socket, the
    same path. A different device at the old name is never returned.
    """
    same = [device for device in devices if (device.model, device.serial_number) == (lost.model, lost.serial_number)]
    if not lost.serial_number or len(same) > 1:
        same = [device for device in same if device.location == lost.location and (lost.location or device.path == lost.path)]
    return same[0] if len(same) == 1 else None


def refusal(name: str, baud: int, error: Exception) -> str:
    """Why a port cannot be opened, without its name."""
    number = _number(error)
    text = str(error).lower()
    if "exclusively lock" in text or number in (errno.EBUSY, errno.EAGAIN):
        return "is busy: another program holds it open"
    if "://" in name:
        return f"cannot be opened: {_reason(error)}"
    if number in (errno.EACCES, errno.EPERM):
        return f"may not be used by this user: {_owners(name)}"
    if number == errno.ENOENT:
        return _absence()
    if number in (errno.ENOTTY, errno.EINVAL, errno.ENODEV, errno.ENXIO, errno.EIO):
        return f"is not a working serial device at {baud} baud ({_reason(error)})"
    return f"cannot be opened: {_reason(error)}"


def _absence() -> str:
    """The sentence for a missing port, with the ports that exist."""
    names = [device.name for device in serial_devices()]
    return f"does not exist: {'there are ' + ', '.join(names) if names else 'no serial port was found'}"


def _check_address(name: str) -> None:
    """Refuse socket:// and rfc2217:// without a host and a port number."""
    scheme = name.partition("://")[0]
    if scheme not in ("socket", "rfc2217"):
        return
    try:
        parts = urlsplit(name)
        whole = bool(parts.hostname and parts.port)
    except ValueError:  # a port that is not a number, or is too large
        whole = False
    if not whole:
        raise RefusedPortError(name, f"is not complete: {scheme}://HOST:PORT is expected, PORT from 1 to 65535")


def _check_path(name: str) -> None:
    if os.name != "posix":
        return
    try:
        mode = os.stat(name).st_mode
    except OSError as error:
        raise RefusedPortError(name, refusal(name, 0, error)) from None
    if not stat.S_ISCHR(mode):
        kind = "a folder" if stat.S_ISDIR(mode) else "a file"
        raise RefusedPortError(name, f"is {kind}, not a serial device")


def _owners(name: str) -> str:
    import grp

    try:
        group = grp.getgrgid(os.stat(name).st_gid).gr_name
    except (OSError, KeyError):
        return "its owner must allow it"
    return f"it belongs to group {group!r}; add your user to that group (sudo usermod -aG {group} $USER) and log in again"


def _number(error: BaseException) -> int | None:
    """The system's error number. pyserial wraps a failed tcgetattr or connect as text; the number is in its cause."""
    numbers = (getattr(cause, "errno", None) or next(iter(cause.args), None) for cause in causes(error))
    return next((number for number in numbers if isinstance(number, int)), None)


def _reason(error: Exception) -> str:
    """The system's own message on one line."""
    number = _number(error)
    if number is not None and number > 0:
        return os.strerror(number).lower()
    if number is not None:  # getaddrinfo has numbers of its own
        return "there is no such host"
    return " ".join(str(error).split()).lower() or type(error).__name__
