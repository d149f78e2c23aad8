"""The camera at a print server: only pictures at the server's own host are asked for."""

from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import pytest

from machine.printing.destination import parse_server_address
from machine.printing.servers.http import fetch_picture, picture_address
from profiles.errors import ServerError

SERVER = parse_server_address("moonraker:printer.local")


@pytest.mark.parametrize(
    ("told", "address"),
    [
        ("/webcam/?action=snapshot", "http://printer.local/webcam/?action=snapshot"),
        ("webcam/snapshot", "http://printer.local/webcam/snapshot"),
        ("http://127.0.0.1:8080/?action=snapshot", "http://printer.local:8080/?action=snapshot"),
        ("http://printer.local:8080/shot.jpg", "http://printer.local:8080/shot.jpg"),
        ("http://elsewhere.org/shot.jpg", ""),
        ("http://me:secret@printer.local/shot.jpg", ""),
        ("file:///etc/passwd", ""),
        ("http://printer.local:port/", ""),
        ("", ""),
        (None, ""),
        (7, ""),
    ],
)
def test_a_picture_lies_with_its_server_or_nowhere(told: object, address: str) -> None:
    assert picture_address(told, SERVER) == address


@contextmanager
def camera(kind: str, body: bytes) -> Iterator[str]:
    class Camera(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Camera) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/"
        finally:
            server.shutdown()


def test_a_picture_is_fetched_and_what_is_none_is_refused() -> None:
    with camera("image/jpeg", b"jpeg") as address:
        assert fetch_picture(address) == (b"jpeg", "image/jpeg")
    with camera("text/html", b"<p>") as address, pytest.raises(ServerError, match="gives no picture: status 200, text/html"):
        fetch_picture(address)
    with pytest.raises(ServerError, match="the camera does not answer"):
        fetch_picture("http://127.0.0.1:1/")
