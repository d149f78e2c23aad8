"""Listening: the sockets of a workbench: at this computer alone, and at the same port of its addresses in the network."""

import os
import socket
from collections.abc import Iterable

from machine.view.serving.guard import HOST
from profiles.errors import OutputError, reason

TRIES = 20  # ports of the system's choice, each free here, until one is free at all addresses


def listen(port: int, host: str = HOST) -> socket.socket:
    """A socket at a port of an address of this computer, 0: any free one. Raises OutputError for one that cannot be had."""
    own = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        if os.name == "posix":  # lines of a server that died keep its port for a minute; a second listener is refused as ever
            own.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        elif hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # Windows keeps no port, and would let a second program listen there
            own.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        own.bind((host, port))
        own.listen()  # at once: of two that are bound so, the second is refused here
    except (OSError, OverflowError) as error:
        own.close()
        why = reason(error) if isinstance(error, OSError) else str(error)
        where = "" if host == HOST else f" at {host}"
        raise OutputError(f"--port {port} cannot be used{where}: {why}; without it any free one is taken") from None
    return own


def listen_at_all(port: int, hosts: Iterable[str]) -> tuple[socket.socket, list[socket.socket]]:
    """The socket at this computer alone, and one at the same port of every other address. Raises OutputError as `listen`."""
    hosts = tuple(hosts)
    for left in reversed(range(TRIES)):
        own = listen(port)
        others: list[socket.socket] = []
        try:
            for host in hosts:
                others.append(listen(own.getsockname()[1], host))
        except OutputError:
            for each in (own, *others):
                each.close()
            if port:
                raise
            if not left:
                raise OutputError(f"--lan: no port is free at all of {', '.join((HOST, *hosts))}") from None
        else:
            return own, others
    raise AssertionError("the last try returns or raises")
