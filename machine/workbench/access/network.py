"""Network: the addresses (IPv4 only, which all local networks support), sockets and encryption of the workbench."""

import os
import socket
import ssl
import struct
import sys
from collections.abc import Iterable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from ipaddress import AddressValueError, IPv4Address
from pathlib import Path

from machine.view.serving.guard import HOST, own_hosts
from profiles.errors import OutputError, reason
from profiles.messages import option

ELSEWHERE = "198.51.100.1"  # reserved for documentation (RFC 5737); nothing is sent to it
SIOCGIFADDR = 0x8915  # Linux, netdevice(7)
INTERFACES = Path("/sys/class/net")
TRIES = 20  # ports chosen by the system until one is free at all addresses


def network_addresses() -> tuple[str, ...]:
    """Addresses in private networks, that of the outgoing route first. Public addresses are left out: no router shields them."""
    found = dict.fromkeys([*_outgoing(), *_of_name(), *_of_interfaces()])
    return tuple(address for address in found if _is_private(address))


def host_names() -> tuple[str, ...]:
    """Names by which a network may know this computer, in lower case."""
    name = socket.gethostname().lower()
    first = name.partition(".")[0]
    return () if first in ("", "localhost") else tuple(dict.fromkeys([name, first, f"{first}.local"]))


def _is_private(address: str) -> bool:
    try:
        parsed = IPv4Address(address)
    except AddressValueError:
        return False
    return not (parsed.is_global or parsed.is_loopback or parsed.is_unspecified or parsed.is_multicast)


def _outgoing() -> Iterator[str]:
    """Source address of a packet to the internet; connecting a datagram socket sends nothing."""
    with suppress(OSError), closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as own:
        own.connect((ELSEWHERE, 9))
        yield own.getsockname()[0]


def _of_name() -> Iterator[str]:
    """Addresses that the system has for its host name; on Windows and macOS these are all."""
    with suppress(OSError):
        yield from socket.gethostbyname_ex(socket.gethostname())[2]


def _of_interfaces() -> Iterator[str]:
    """Addresses of network cards on Linux; virtual bridges and tunnels have no device."""
    if sys.platform != "linux":
        return
    from fcntl import ioctl

    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as own:
        for _, name in socket.if_nameindex():
            if (INTERFACES / name / "device").exists():
                with suppress(OSError):  # it has no address
                    answer = ioctl(own.fileno(), SIOCGIFADDR, struct.pack("256s", name.encode()[:15]))
                    yield socket.inet_ntoa(answer[20:24])


def listen(port: int, host: str = HOST) -> socket.socket:
    """Listen at a port of an address of this computer, 0: any free one. Raises OutputError if that is impossible."""
    own = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        if os.name == "posix":  # a dead server's connections block its port for a minute; a second listener is still refused
            own.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        elif hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # Windows blocks no port, but would let a second program listen there
            own.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        own.bind((host, port))
        own.listen()  # listen at once, so that a second bound socket is refused here
    except (OSError, OverflowError) as error:
        own.close()
        why = reason(error) if isinstance(error, OSError) else str(error)
        where = "" if host == HOST else f" at {host}"
        raise OutputError(f"{option('port', port)} cannot be used{where}: {why}; without it any free one is taken") from None
    return own


def listen_at_all(port: int, hosts: Iterable[str]) -> tuple[socket.socket, list[socket.socket]]:
    """Listen at this computer's own address, and at the same port of the others. Raises OutputError."""
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
                raise OutputError(f"{option('lan')}: no port is free at all of {', '.join((HOST, *hosts))}") from None
        else:
            return own, others
    raise AssertionError("the last try returns or raises")


@dataclass(frozen=True)
class Certificate:
    """PEM files."""

    chain: Path
    key: Path


@dataclass(frozen=True)
class Lan:
    """addresses: of this computer; names: further host names; certificate: None: not encrypted."""

    addresses: tuple[str, ...]
    names: tuple[str, ...] = ()
    certificate: Certificate | None = None

    @property
    def scheme(self) -> str:
        return "http" if self.certificate is None else "https"

    def hosts(self, port: int) -> tuple[str, ...]:
        """Allowed values of the Host header of requests to a port."""
        return own_hosts((*self.addresses, *self.names), port, self.scheme)

    def urls(self, port: int) -> tuple[str, ...]:
        return tuple(f"{self.scheme}://{address}:{port}/" for address in self.addresses)


def open_lan(chain: Path | None, key: Path | None) -> Lan:
    """Find the local network. Raises OutputError if there is none, or the certificate cannot be used."""
    certificate = None if chain is None and key is None else _checked(chain, key)
    addresses = network_addresses()
    if not addresses:
        raise OutputError(
            f"{option('lan')}: this computer has no address in a private network: join one, or leave {option('lan')} out"
        )
    return Lan(addresses, host_names(), certificate)


def _checked(chain: Path | None, key: Path | None) -> Certificate:
    if chain is None or key is None:
        given, other = (option("key"), option("certificate")) if chain is None else (option("certificate"), option("key"))
        raise OutputError(f"{given} needs {other}, too: a certificate and its key, each a PEM file")
    for name, file in (("certificate", chain), ("key", key)):
        try:
            file.read_bytes()
        except OSError as error:
            raise OutputError(f"{option(name, file)} cannot be read: {reason(error)}") from None
    _check_pair(chain, key)
    return Certificate(chain, key)


def _check_pair(chain: Path, key: Path) -> None:
    """Raise OutputError unless both files are PEM and the key is the certificate's."""
    asked = []

    def password() -> str:
        asked.append(True)
        return ""

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(chain, key, password)
    except (ssl.SSLError, ValueError) as error:
        if asked:
            raise OutputError(f"{option('key', key)} is encrypted by a password: one without is needed") from None
        if getattr(error, "reason", "") == "KEY_VALUES_MISMATCH":
            raise OutputError(f"{option('key', key)} does not belong to {option('certificate', chain)}") from None
        raise OutputError(
            f"{option('certificate', chain)} and {option('key', key)} cannot be used: both must be PEM files, of an "
            "X.509 certificate and its key"
        ) from None
