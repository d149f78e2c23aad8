"""Webcam: where a print server's camera gives a picture, as the server tells it."""

from urllib.parse import urlsplit, urlunsplit

from machine.printing.servers.address import ServerAddress

OWN_HOSTS = ("127.0.0.1", "localhost", "::1")  # as a server calls itself


def picture_address(told: object, server: ServerAddress) -> str:
    """The URL of a picture at the server's own host; "" where there is none, or it lies with somebody else: what a server tells
    must not have this computer ask others.

    >>> from machine.printing.servers.address import parse_server_address
    >>> picture_address("/webcam/?action=snapshot", parse_server_address("moonraker:printer.local"))
    'http://printer.local/webcam/?action=snapshot'
    """
    try:
        parts = urlsplit(told if isinstance(told, str) else "")
        host, port = parts.hostname, parts.port
    except ValueError:
        return ""
    if not parts.path or "@" in parts.netloc or parts.scheme not in ("", "http", "https"):
        return ""
    if host not in (None, server.host, *OWN_HOSTS):
        return ""
    name = f"[{server.host}]" if ":" in server.host else server.host
    place = name if port is None else f"{name}:{port}"
    path = parts.path if parts.path.startswith("/") else f"/{parts.path}"
    return urlunsplit((parts.scheme or server.scheme, place, path, parts.query, ""))
