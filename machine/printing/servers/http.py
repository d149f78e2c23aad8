"""HTTP client of one print server: requests, a sentence for each kind of failure, and values from its JSON.

Redirects are not followed and proxies of the environment are ignored: either would send the key to another host. Certificates are
always verified.
"""

from __future__ import annotations

import json
import logging
import re
import socket
import ssl
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO
from urllib.parse import urlsplit, urlunsplit

from machine.link.protocol.events import Temperature
from machine.printing.destination import NAMES, Server
from profiles.errors import NoAnswerError, ServerError, causes
from profiles.folders import settings_folder

if TYPE_CHECKING:
    import httpx

VARIABLE = "TILTPRINT_SERVER_KEY"
CONNECT_S, ANSWER_S, WRITE_S = 5.0, 10.0, 30.0
WHOLE_S = 30.0  # from an answer's first byte to its last; ANSWER_S limits the gap between two
ERRNO = re.compile(r"^\[errno -?\d+\] ")
MOST_BYTES = 16_000_000  # greatest size of an answer
FILE_TYPE = "application/octet-stream"
MOST_PICTURE, PICTURES = 8_000_000, ("image/jpeg", "image/png", "image/webp")  # limits for a camera's pictures
OWN_HOSTS = ("127.0.0.1", "localhost", "::1")  # names by which a server refers to itself
WORDS = 160  # characters of a server's message that are quoted
Tell = Callable[[str, bytes], None]  # direction and bytes, for a log


@dataclass(frozen=True)
class Reply:
    """A server's answer. path: of the request, for messages."""

    status: int
    body: bytes
    path: str
    location: str = ""

    def json(self) -> Any:
        """The body's JSON value; None when it is not JSON."""
        try:
            return json.loads(self.body)
        except (ValueError, RecursionError):
            return None


def servers_file() -> Path:
    """The user's file of print servers, which may not exist."""
    return settings_folder() / "servers.toml"


def how_to_give_a_key(address: Server) -> str:
    """Instruction for the user on where to put a server's key."""
    return f'give it as key = "..." below [servers."{address.host}"] in {servers_file()}, or in the variable {VARIABLE}'


class HttpSession:
    """Session for requests below a server's address, from any thread.

    Raises ServerError with a sentence for the user, NoAnswerError when the request may have been accepted. key: "" for none;
    ca_file: None: this computer's trusted authorities. key_header: header that carries the key; key_refused: statuses that mean a
    bad key. name: the server as the user wrote it.
    """

    key_header = ""
    key_refused: tuple[int, ...] = (401, 403)

    def __init__(self, address: Server, key: str = "", ca_file: Path | None = None, tell: Tell | None = None) -> None:
        import httpx

        for name in ("httpx", "httpcore"):  # they would log addresses, which contain a Duet's password
            logging.getLogger(name).setLevel(logging.WARNING)
        self.address, self.name, self.key = address, address.name, key
        self._tell = tell or (lambda direction, data: None)
        self._log_lock = threading.Lock()
        self._httpx = httpx
        headers = {"User-Agent": "tiltprint", "Accept": "application/json"}
        try:
            self.client = httpx.Client(
                base_url=address.url,
                verify=_certificates(address, ca_file),
                trust_env=False,
                follow_redirects=False,
                headers=headers | ({self.key_header: key} if self.key_header and key else {}),
                timeout=httpx.Timeout(ANSWER_S, connect=CONNECT_S),
            )
        except (httpx.InvalidURL, UnicodeError) as error:
            raise ServerError(f"server address {address.name!r} names no host: {plain(str(error)).lower()}") from None

    def close(self) -> None:
        """Close all connections."""
        self.client.close()

    def get(self, path: str, params: Mapping[str, str] | None = None, secret: bool = False) -> Reply:
        """GET. secret: do not log the parameters."""
        return self._request("GET", path, params=params, note=path if secret else _shown(path, params))

    def post(self, path: str, value: Any = None, answer_s: float = ANSWER_S) -> Reply:
        """POST a value as JSON, or an empty body."""
        note = path + ("" if value is None else f" {json.dumps(value)}")
        timeout = self._httpx.Timeout(answer_s, connect=CONNECT_S)
        return self._request("POST", path, json=value, timeout=timeout, note=note)

    def post_file(self, path: str, values: Mapping[str, str], file: BinaryIO, answer_s: float, form_name: str = "") -> Reply:
        """POST a file as the body, with the values as parameters; the answer may take answer_s after its last byte.

        form_name: send a multipart form instead, with the values and then the file under this name.
        """
        timeout = self._httpx.Timeout(answer_s, connect=CONNECT_S, write=WRITE_S)
        if form_name:
            files = {"file": (form_name, file, FILE_TYPE)}
            return self._request("POST", path, data=values, files=files, timeout=timeout, note=f"{path} ({form_name})")
        headers, note = {"Content-Type": FILE_TYPE}, _shown(path, values)
        return self._request("POST", path, params=values, content=file, headers=headers, timeout=timeout, note=note)

    def _request(self, method: str, path: str, note: str, **request: Any) -> Reply:
        self._log(">", f"{method} {note}")
        given = {key: value for key, value in request.items() if value is not None}
        try:
            with self.client.stream(method, path, **given) as answer:
                body = self._body(answer)
        except self._httpx.TransportError as error:
            sentence = _transport_sentence(error, self.address, self._httpx)
            self._log("#", sentence)
            reached = not isinstance(error, self._httpx.ConnectError | self._httpx.ConnectTimeout)
            raise (NoAnswerError if reached else ServerError)(sentence) from None
        except UnicodeError as error:  # idna's errors are UnicodeErrors, here and above
            raise ServerError(f"server address {self.name!r} names no host: {plain(str(error)).lower()}") from None
        except (self._httpx.InvalidURL, self._httpx.DecodingError) as error:
            raise ServerError(f"what answers at {self.address.url} speaks no proper HTTP: {plain(str(error))}") from None
        except RuntimeError:
            if not self.client.is_closed:
                raise
            raise ServerError(f"{self.name}: the session is over") from None
        reply = Reply(answer.status_code, body, path, answer.headers.get("location", ""))
        self._log("<", f"{reply.status} {self.words(reply)}")
        return reply

    def _body(self, answer: httpx.Response) -> bytes:
        """The whole body of an answer, limited in size and time. Raises ServerError."""
        body, until_s = b"", time.monotonic() + WHOLE_S
        for piece in answer.iter_bytes():
            body += piece
            if time.monotonic() > until_s:
                raise NoAnswerError(f"{self.name} sends an answer without an end: it is not a print server")
            if len(body) > MOST_BYTES:
                raise ServerError(f"{self.name} answers with more than {MOST_BYTES // 1_000_000} MB: it is not a print server")
        return body

    def _log(self, direction: str, text: str) -> None:
        with self._log_lock:
            self._tell(direction, f"{self._without_key(text)}\n".encode())

    def _without_key(self, text: str) -> str:
        return text.replace(self.key, "***") if self.key else text

    def check(self, reply: Reply, purpose: str, refusals: Mapping[int, str] | None = None) -> Any:
        """The value of a successful reply. Raises ServerError. purpose: the aim of the request, such as `starting the print`;
        refusals: sentences for statuses with a special meaning here."""
        status, address = reply.status, self.address
        if 200 <= status < 300:
            return reply.json()
        words = self.words(reply)
        if refusals and status in refusals:
            raise ServerError(refusals[status].format(words=words or f"status {status}"))
        if 300 <= status < 400:  # the query is omitted: it may repeat a Duet's password
            where = plain(self._without_key(reply.location.partition("?")[0])) or "nowhere"
            raise ServerError(f"{self.name} redirects to {where}: give that server's address, no key is carried there")
        if status in self.key_refused:
            refused = f"refuses the key or what its user may do ({words or status})" if self.key else "wants a key"
            raise ServerError(f"{self.name} {refused}: {how_to_give_a_key(address)}")
        if status == 404:
            raise ServerError(f"{address.url} is no {NAMES[address.kind].removeprefix('a ')}: it knows no {reply.path}")
        if status in (413, 507):
            raise ServerError(f"{self.name} has no room for it ({words or status}): delete files there")
        raise ServerError(f"{self.name} refuses {purpose}: {words or f'status {status}'}")

    def words(self, reply: Reply) -> str:
        """A server's own reason for a refusal, short and without the key; "" when it gives none."""
        value = reply.json()
        error = value.get("error", value.get("message")) if isinstance(value, dict) else None
        if isinstance(error, dict):
            error = error.get("message")
        if isinstance(value, str):
            error = value
        if error is None and not reply.body.lstrip().startswith(b"<"):  # an HTML page has no one-line message
            error = reply.body[: 4 * WORDS].decode("utf-8", "replace")
        return plain(self._without_key(str(error or "")))


def picture_address(reported: object, server: Server) -> str:
    """URL of a picture on the server's own host; "" if there is none or it is on another host.

    A server's answer must not make this computer contact other hosts.

    >>> from machine.printing.destination import parse_server_address
    >>> picture_address("/webcam/?action=snapshot", parse_server_address("moonraker:printer.local"))
    'http://printer.local/webcam/?action=snapshot'
    """
    try:
        parts = urlsplit(reported if isinstance(reported, str) else "")
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


def fetch_picture(url: str) -> tuple[bytes, str]:
    """A picture and its media type. Raises ServerError when there is none."""
    import httpx

    try:
        with httpx.stream("GET", url, timeout=CONNECT_S, trust_env=False, follow_redirects=False) as answer:
            kind, body = answer.headers.get("content-type", "").partition(";")[0].strip().lower(), b""
            if answer.status_code != 200 or kind not in PICTURES:
                raise ServerError(f"the camera gives no picture: status {answer.status_code}, {plain(kind) or 'of no type'}")
            for piece in answer.iter_bytes():
                body += piece
                if len(body) > MOST_PICTURE:
                    raise ServerError(f"the camera gives more than {MOST_PICTURE // 1_000_000} MB: it is not a picture")
    except (httpx.HTTPError, httpx.InvalidURL, UnicodeError, OSError) as error:
        raise ServerError(f"the camera does not answer: {plain(str(error)).lower()}") from None
    return body, kind


def plain(text: str) -> str:
    """A server's text as part of one line, without control characters."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line if len(line) <= WORDS else line[: WORDS - 3] + "..."


def _shown(path: str, params: Mapping[str, str] | None) -> str:
    return path + ("?" + "&".join(f"{key}={value}" for key, value in params.items()) if params else "")


def _certificates(address: Server, ca_file: Path | None) -> ssl.SSLContext:
    if address.scheme == "http":
        return ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # trusts no certificate and need not: this connection has no TLS
    try:
        return ssl.create_default_context(cafile=ca_file)
    except OSError as error:  # includes ssl.SSLError
        raise ServerError(f"ca_file {ca_file} for {address.name} holds no certificates: {error.strerror or error}") from None


def _transport_sentence(error: httpx.TransportError, address: Server, httpx_: Any) -> str:
    """Sentence on a failure below HTTP, with what to check."""
    where, chain = f"{address.host} at port {address.port}", causes(error)
    if any(isinstance(cause, socket.gaierror) for cause in chain):
        return f"{address.name}: no computer of the name {address.host} is known here: an IP address will do, too"
    if trust := next((cause for cause in chain if isinstance(cause, ssl.SSLCertVerificationError)), None):
        return (
            f"{address.name}: its certificate cannot be trusted ({plain(trust.verify_message)}): for one of your own name "
            f'its authority as ca_file below [servers."{address.host}"] in {servers_file()}'
        )
    if any(isinstance(cause, ssl.SSLError) for cause in chain):
        return f"{address.name}: {where} speaks no TLS: is it http:// instead of https://?"
    if any(isinstance(cause, ConnectionRefusedError) for cause in chain):
        return f"{address.name}: nothing listens on {where}: is {NAMES[address.kind]} switched on and the port right?"
    if isinstance(error, httpx_.ConnectTimeout):
        doubt = ", and does it speak TLS" if address.scheme == "https" else ""
        return f"{address.name}: {where} does not answer within {CONNECT_S:g} s: is it switched on, in this network{doubt}?"
    if isinstance(error, httpx_.ConnectError):
        return f"{address.name}: {where} cannot be reached: {_reason(error)}"
    if isinstance(error, httpx_.TimeoutException):
        return f"{address.name}: {where} has stopped answering"
    if isinstance(error, httpx_.RemoteProtocolError):
        return f"{address.name}: what answers on {where} breaks off or speaks no HTTP ({_reason(error)})"
    return f"{address.name}: the connection to {where} broke off ({_reason(error)})"


def _reason(error: Exception) -> str:
    return ERRNO.sub("", plain(str(error)).lower()) or type(error).__name__


def temperature(nozzle: Any, bed: Any, now: str, target: str) -> Temperature:
    """Temperatures of nozzle and bed from two JSON objects, under these keys."""
    return Temperature(*(number(table(heater).get(key)) for heater in (nozzle, bed) for key in (now, target)))


def table(value: Any) -> Mapping[str, Any]:
    """A JSON object; any other value becomes an empty one."""
    return value if isinstance(value, dict) else {}


def entry(value: Any, index: Any) -> Any:
    """An entry of a JSON array, or None."""
    return value[index] if isinstance(value, list) and isinstance(index, int) and 0 <= index < len(value) else None


def number(value: Any) -> float | None:
    """A JSON number, or None."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        read = float(value)
    except OverflowError:  # an integer of hundreds of digits
        return None
    return read if isfinite(read) else None


def whole(value: Any) -> int | None:
    """A JSON number truncated to an integer, or None."""
    read = number(value)
    return None if read is None else int(read)
