"""Where a simulated printer is reached: a pseudo-terminal with a device path, or a TCP port for socket:// addresses."""

import os
import socket
from collections import deque
from contextlib import suppress
from pathlib import Path

from profiles.errors import PortError, reason

READ_BYTES = 4096
TAKEN, MOST_OTHERS = b"echo:busy: another program talks to this simulated printer\n", 8
TERMINALS = ("/dev/pts/", "/dev/tty")


class Terminal:
    """A raw pseudo-terminal. link: a symbolic link to keep on its path; PortError when something else is there."""

    def __init__(self, link: Path | None = None) -> None:
        if link is not None and (link.exists() or link.is_symlink()) and not _leads_to_a_terminal(link):
            raise PortError(f"{link} exists and is no link to a terminal: the simulated printer does not replace it")
        self._link = link
        self._master = self._slave = -1
        self._device = self.path = ""

    def open(self) -> None:
        """Open it; after close() again, at another path unless a link leads to it. PortError where there are none."""
        try:
            import tty

            self._master, self._slave = os.openpty()
        except (ImportError, AttributeError, OSError) as error:
            raise PortError(f"the simulated printer needs a pseudo-terminal, which this system does not give ({error})") from None
        # Raw: no echo, no change of newlines. The own slave end stays open, so that the terminal outlives each host.
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._device = os.ttyname(self._slave)
        if self._link is not None:
            self._make_link(self._link)
        self.path = str(self._link or self._device)  # at once: another thread may look

    def close(self) -> None:
        """The cable is out: a host's next reading or writing fails."""
        if self._master < 0:
            return
        self._unlink()
        for descriptor in (self._master, self._slave):
            os.close(descriptor)
        self._master = self._slave = -1

    def readable_ends(self) -> list[int]:
        """Descriptors that become readable when the host says something."""
        return [self._master] if self._master >= 0 else []

    def writable_ends(self) -> list[int]:
        """Descriptors that become writable when the host has read."""
        return self.readable_ends()

    def read(self) -> bytes:
        """What the host has written."""
        try:
            return os.read(self._master, READ_BYTES)
        except (BlockingIOError, OSError):
            return b""

    def write(self, data: bytes) -> int:
        """How many bytes the terminal took."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def _make_link(self, link: Path) -> None:
        beside = link.with_name(f".{link.name}.{os.getpid()}")
        try:
            beside.symlink_to(self._device)
            beside.replace(link)
        except OSError as error:
            self.close()
            raise PortError(f"the link {link} cannot be made: {reason(error)}") from None

    def _unlink(self) -> None:
        """Remove the link, unless another simulated printer has taken it over."""
        if self._link is not None and self._link.is_symlink() and os.readlink(self._link) == self._device:
            self._link.unlink()


def terminals_exist() -> bool:
    """Whether this system has pseudo-terminals; Windows has none."""
    try:
        import tty  # noqa: F401 - not there without termios
    except ImportError:
        return False
    return hasattr(os, "openpty")


def _leads_to_a_terminal(link: Path) -> bool:
    """Whether it is a link to a terminal, of which perhaps nothing is left."""
    return link.is_symlink() and os.readlink(link).startswith(TERMINALS)


class Server:
    """A TCP port of this computer for one host at a time, others are told so; number 0 takes a free one."""

    def __init__(self, number: int) -> None:
        try:
            self._server = socket.create_server(("localhost", number))
        except OSError as error:
            raise PortError(f"TCP port {number} cannot be listened on: {reason(error)}") from None
        self._server.setblocking(False)
        self._host: socket.socket | None = None
        self._others: deque[socket.socket] = deque()  # that are turned away
        self._open = False
        self.path = f"socket://localhost:{self._server.getsockname()[1]}"

    def open(self) -> None:
        """Let a host in."""
        self._open = True

    def close(self) -> None:
        """The host is cut off."""
        self._open = False
        self._hang_up()

    def end(self) -> None:
        """Close the port for good."""
        self.close()
        self._server.close()

    def readable_ends(self) -> list[int]:
        """Descriptors that become readable when a host comes or says something."""
        if not self._open:
            return []
        hosts = [*self._others, *([] if self._host is None else [self._host])]
        return [self._server.fileno(), *(host.fileno() for host in hosts)]

    def writable_ends(self) -> list[int]:
        """Descriptors that become writable when the host has read."""
        return [] if self._host is None else [self._host.fileno()]

    def read(self) -> bytes:
        """What the host has written; a host that comes or goes writes nothing."""
        try:
            if self._host is None:
                self._host, _ = self._server.accept()
                self._host.setblocking(False)
                self._host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                return b""
            self._turn_away()
            data = self._host.recv(READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._hang_up()
        return data

    def _turn_away(self) -> None:
        """Tell other hosts, as soon as they ask something, that the printer is taken."""
        with suppress(OSError):
            host, _ = self._server.accept()
            host.setblocking(False)
            self._others.append(host)
        for host in [*self._others]:
            with suppress(OSError):
                if host.recv(READ_BYTES):
                    host.sendall(TAKEN)
                    continue
                self._others.remove(host)
                host.close()
        while len(self._others) > MOST_OTHERS:
            self._others.popleft().close()

    def write(self, data: bytes) -> int:
        """How many bytes the connection took; without a host they are lost."""
        try:
            return len(data) if self._host is None else self._host.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self._hang_up()
            return len(data)

    def _hang_up(self) -> None:
        for gone in [*([] if self._host is None else [self._host]), *self._others]:
            gone.close()
        self._host = None
        self._others.clear()  # the next one to come has the printer for itself
