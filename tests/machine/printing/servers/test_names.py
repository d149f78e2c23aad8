"""Server addresses, file names and the user's file of keys."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

from machine.printing.destination import (
    SerialPort,
    Server,
    Simulated,
    is_server_address,
    parse_destination,
    parse_printer,
    parse_server_address,
)
from machine.printing.servers.http import VARIABLE, HttpSession, fetch_picture, picture_address, servers_file
from machine.printing.servers.server import GcodeUpload, server_name
from machine.printing.servers.servers import read_credentials
from profiles.errors import PrinterError, ServerError


@pytest.mark.parametrize(
    ("text", "url"),
    [
        ("octoprint:octopi.local", "http://octopi.local:80"),
        ("octoprint:192.168.1.20:5000", "http://192.168.1.20:5000"),
        ("moonraker:voron", "http://voron:7125"),
        ("Moonraker:https://voron.example/printer/", "https://voron.example:443/printer"),
        ("duet:[fe80::1]", "http://[fe80::1]:80"),
    ],
)
def test_an_address_names_kind_host_and_port(text: str, url: str) -> None:
    assert is_server_address(text)
    assert parse_server_address(text).url == url


@pytest.mark.parametrize(("text", "kind"), [
    ("sim", Simulated), ("/dev/serial/by-path/pci-0000:00:14.0", SerialPort), ("COM3", SerialPort),
    ("/dev/ttyACM0", SerialPort), ("socket://host:1", SerialPort), ("Duet:printer", Server),
])  # fmt: skip
def test_a_destination_is_read_once_and_keeps_its_name(text: str, kind: type) -> None:
    destination = parse_destination(text, 250000, 2.0)
    assert isinstance(destination, kind)
    assert destination.name == text


@pytest.mark.parametrize("text", ["SIM", "Sim"])
def test_the_simulator_is_meant_in_capitals_too(text: str) -> None:
    assert isinstance(parse_destination(text), Simulated)


@pytest.mark.parametrize("text", ["junk:", "junk://host", "octopi:host", "", " ", " sim", "tty\0", "octopi:me:secret@host"])
def test_a_name_that_no_device_has_is_refused(text: str) -> None:
    with pytest.raises(PrinterError, match="is not a port: a device, sim, socket://HOST:PORT") as refused:
        parse_destination(text)
    assert "secret" not in str(refused.value)


@pytest.mark.parametrize(("given", "sentence"), [
    (("/dev/ttyS0", 7, 0.0), "baud rate 7 is not possible"), (("sim", 115200, float("nan")), "--sim-speed is nan"),
])  # fmt: skip
def test_a_line_that_is_not_possible_is_refused_at_the_door(given: tuple[str, int, float], sentence: str) -> None:
    with pytest.raises(PrinterError, match=sentence):
        parse_destination(*given)


def test_a_print_server_is_no_line_to_a_printer() -> None:
    with pytest.raises(ServerError, match="--port duet:printer is a print server, which takes whole files"):
        parse_printer("duet:printer")


@pytest.mark.parametrize("text", ["/dev/ttyACM0", "COM3", "sim", "socket://host:1", "rfc2217://host:1", "octoprint"])
def test_a_port_is_no_server(text: str) -> None:
    assert not is_server_address(text)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("prusalink:host", "octoprint:HOST, moonraker:HOST or duet:HOST"),
        ("octoprint:", "names no host"),
        ("octoprint:ftp://host", "http:// or https:// is expected"),
        ("octoprint:host:99999", "99999 is not a port number"),
        ("octoprint:host:0", "0 is not a port number"),
        ("octoprint:http://http://host", "names no host"),
        ("octoprint:host?apikey=1", "nothing may follow the path"),
        ("octoprint:host?", "nothing may follow the path"),
        ("octoprint:host%00", "names no host"),
        ("octoprint:[::1", "names no host"),
        ("octoprint:[fe80::g]", "names no host"),
        ("octoprint:[::1]x", "nothing may follow the path"),
        ("octoprint:a b", "names no host"),
        ("octoprint:ho\x1bst", "names no host"),
        ("octoprint:a..b", "names no host"),
        ("octoprint:" + "a" * 64, "names no host"),
    ],
)
def test_an_address_that_names_no_server_is_refused(text: str, sentence: str) -> None:
    with pytest.raises(ServerError, match=sentence) as refused:
        parse_server_address(text)
    assert str(refused.value).isprintable()


@pytest.mark.parametrize("text", ["octoprint:me:secret@host", "octoprint:me:secret@host:80x", "octopi:me:secret@host"])
def test_a_password_in_an_address_is_refused_and_not_repeated(text: str) -> None:
    with pytest.raises(ServerError, match="it must not hold a name or password") as refused:
        parse_server_address(text)
    assert "secret" not in str(refused.value)


@pytest.mark.parametrize("host", ["999.999.999.999", "\ufb01x", "xn--zz"])
def test_a_host_that_cannot_be_is_refused_in_a_sentence(host: str) -> None:
    with pytest.raises(ServerError, match="names no host"):
        HttpSession(parse_server_address(f"octoprint:{host}")).get("/")


@pytest.mark.parametrize(
    ("name", "there"),
    [
        ("box.gcode", "box.gcode"),
        ("demo:tree", "tree.gcode"),
        ("Prüfstück Größe 1.gco", "Prufstuck_Groe_1.gco"),
        ('a"b;c#d\n*.nc', "a_b_c_d.gcode"),
        ("../../etc/passwd", "etc_passwd.gcode"),
        ("日本.gcode", "print.gcode"),
        ("x" * 300 + ".G", "x" * 80 + ".g"),
        (".gcode", "print.gcode"),
    ],
)
def test_a_file_gets_a_name_that_every_server_can_keep(name: str, there: str) -> None:
    assert server_name(name) == there


def test_an_upload_knows_its_lines() -> None:
    upload = GcodeUpload("a.gcode", ("G28", "G1 X1"))
    assert upload.content == b"G28\nG1 X1\n"
    assert [upload.line_at(position) for position in (0, 3, 4, 10)] == [0, 0, 1, 2]


def write_servers(text: str, mode: int = 0o600) -> Path:
    file = servers_file()
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    file.chmod(mode)
    return file


@pytest.fixture(autouse=True)
def _own_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.delenv(VARIABLE, raising=False)


def test_a_key_for_host_and_port_takes_precedence_over_one_for_the_host() -> None:
    file = write_servers('[servers."octopi"]\nkey = "one"\nca_file = "ca.pem"\n[servers."octopi:5000"]\nkey = "two"\n')
    assert read_credentials(parse_server_address("octoprint:octopi")) == ("one", file.parent / "ca.pem")
    assert read_credentials(parse_server_address("octoprint:octopi:5000")) == ("two", None)
    assert read_credentials(parse_server_address("octoprint:other")) == ("", None)


def test_a_host_is_the_same_in_capitals() -> None:
    write_servers('[servers."OctoPi.local"]\nkey = "one"\n')
    assert read_credentials(parse_server_address("octoprint:octopi.LOCAL")) == ("one", None)


def test_the_environment_variable_overrides_the_file_and_no_key_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    write_servers('[servers."octopi"]\nkey = "one"\n')
    monkeypatch.setenv(VARIABLE, "other")
    key, _ = read_credentials(parse_server_address("octoprint:octopi"))
    assert key == "other"
    assert "other" not in repr(HttpSession(parse_server_address("octoprint:octopi"), key))


@pytest.mark.skipif(os.name != "posix", reason="Windows keeps a user's folders to the user")
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620])
def test_a_file_of_keys_that_others_can_read_is_refused(mode: int) -> None:
    file = write_servers('[servers."octopi"]\nkey = "one"\n', mode)
    with pytest.raises(ServerError, match=f"chmod 600 {file}"):
        read_credentials(parse_server_address("octoprint:octopi"))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('[server."octopi"]\nkey = "x"', "'server' is not known"),
        ('[servers."octopi"]\nkye = "x"', "'kye': key and ca_file are known"),
        ('[servers."octopi"]\nkey = 1234', "must be a text in quotes"),
        ("[servers]\nkey = 'x'", "must be tables of their own"),
        ('[servers."octopi"]\nca_file = "~nobody-of-that-name/ca.pem"', "no home folder of that user is known"),
        ('[servers."octopi"]\nkey = "a\\nb"', "has characters that no key has"),
    ],
)
def test_a_wrong_file_of_servers_is_refused(text: str, sentence: str) -> None:
    write_servers(text)
    with pytest.raises(ServerError, match=sentence):
        read_credentials(parse_server_address("octoprint:octopi"))


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
def test_a_camera_address_belongs_to_its_server(told: object, address: str) -> None:
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


def test_a_camera_picture_is_fetched_and_other_content_refused() -> None:
    with camera("image/jpeg", b"jpeg") as address:
        assert fetch_picture(address) == (b"jpeg", "image/jpeg")
    with camera("text/html", b"<p>") as address, pytest.raises(ServerError, match="gives no picture: status 200, text/html"):
        fetch_picture(address)
    with pytest.raises(ServerError, match="the camera does not answer"):
        fetch_picture("http://127.0.0.1:1/")
