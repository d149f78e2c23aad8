"""Addresses: those of this computer in networks around it. IPv4 only, which every such network has."""

import socket
import struct
import sys
from collections.abc import Iterator
from contextlib import closing, suppress
from ipaddress import AddressValueError, IPv4Address
from pathlib import Path

ELSEWHERE = "198.51.100.1"  # of documentation, RFC 5737: nobody is there, and nothing is sent
SIOCGIFADDR = 0x8915  # Linux, netdevice(7)
INTERFACES = Path("/sys/class/net")


def network_addresses() -> tuple[str, ...]:
    """Addresses of private networks, that by which this computer goes out first. None that the internet reaches: who has such a
    one has no door of his own before it."""
    found = dict.fromkeys([*_outgoing(), *_of_name(), *_of_interfaces()])
    return tuple(address for address in found if _is_private(address))


def host_names() -> tuple[str, ...]:
    """Names by which a network may know this computer, in small letters."""
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
    """The address that a packet to elsewhere would have; connecting a datagram socket sends none."""
    with suppress(OSError), closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as own:
        own.connect((ELSEWHERE, 9))
        yield own.getsockname()[0]


def _of_name() -> Iterator[str]:
    """Those that the system has for its own name: all of them where it is Windows or macOS."""
    with suppress(OSError):
        yield from socket.gethostbyname_ex(socket.gethostname())[2]


def _of_interfaces() -> Iterator[str]:
    """On Linux those of network cards; bridges and tunnels of programs have no device."""
    if sys.platform != "linux":
        return
    from fcntl import ioctl

    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as own:
        for _, name in socket.if_nameindex():
            if (INTERFACES / name / "device").exists():
                with suppress(OSError):  # it has none
                    answer = ioctl(own.fileno(), SIOCGIFADDR, struct.pack("256s", name.encode()[:15]))
                    yield socket.inet_ntoa(answer[20:24])
