"""Address: which print server is meant, as `octoprint:HOST`, `moonraker:http://HOST:7125` or `duet:192.168.1.20`."""

from dataclasses import dataclass
from urllib.parse import SplitResult, urlsplit

from profiles.errors import ServerError

# The port that a server listens at where none is given: haproxy before OctoPrint (OctoPi), Moonraker's [server] port, a Duet.
PORTS = {"octoprint": 80, "moonraker": 7125, "duet": 80}
NAMES = {"octoprint": "OctoPrint", "moonraker": "Moonraker", "duet": "a Duet"}
TLS_PORT = 443
SCHEMES = ("http", "https")
EXPECTED = "octoprint:HOST, moonraker:HOST or duet:HOST, HOST being a name, an IP address or http(s)://HOST:PORT, is expected"


@dataclass(frozen=True)
class ServerAddress:
    """kind: octoprint, moonraker or duet; text: the address as it was given, for messages; path: before that of every request."""

    kind: str
    scheme: str
    host: str
    port: int
    path: str
    text: str

    @property
    def url(self) -> str:
        """Without a slash at its end."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}{self.path}"

    @property
    def names(self) -> tuple[str, str]:
        """What the user's file of servers may call it: host and port, or the host alone."""
        return f"{self.host}:{self.port}", self.host


def is_server_address(text: str) -> bool:
    """Whether a port is meant to be a print server."""
    return text.partition(":")[0].lower() in PORTS and ":" in text


def parse_server_address(text: str) -> ServerAddress:
    """The server that is meant. Raises ServerError."""
    kind, colon, rest = text.partition(":")
    kind = kind.lower()
    if "@" in rest:  # never repeated: what stands before it may be a password
        raise ServerError("server address: names and passwords do not belong into it: keys have a file of their own")
    if not colon or kind not in PORTS:
        raise ServerError(f"server address {_plain(text)!r}: {EXPECTED}")
    has_scheme = "://" in rest
    try:
        parts = urlsplit(rest if has_scheme else f"//{rest}")
        port = parts.port
    except ValueError as error:
        raise ServerError(f"server address {_plain(text)!r}: {str(error).lower()}: {EXPECTED}") from None
    if port == 0:
        raise ServerError(f"server address {_plain(text)!r}: port 0 is none: {EXPECTED}")
    _check(parts, text, has_scheme)
    scheme = parts.scheme or "http"
    usual = TLS_PORT if scheme == "https" else PORTS[kind]
    return ServerAddress(kind, scheme, parts.hostname or "", port or usual, parts.path.rstrip("/"), text)


def _check(parts: SplitResult, text: str, has_scheme: bool) -> None:
    if has_scheme and parts.scheme not in SCHEMES:
        raise ServerError(f"server address {_plain(text)!r} begins with {parts.scheme}://: http:// or https:// is expected")
    host = parts.hostname or ""
    if not all(c.isalnum() or c in ".-_:%" for c in host) or not all(
        0 < len(label) < 64 for label in host.rstrip(".").split(".")
    ):
        raise ServerError(f"server address {_plain(text)!r} names no host: {EXPECTED}")
    if parts.query or parts.fragment:
        raise ServerError(f"server address {_plain(text)!r}: nothing may follow the path: {EXPECTED}")


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:100])
