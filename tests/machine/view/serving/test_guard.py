"""Access to the workbench: its own pages at the secret address are answered, all other requests are refused."""

import pytest

from machine.view.serving.guard import is_foreign, own_hosts, refusal

PORT, TOKEN = 8123, "secret"
OWN = "http://127.0.0.1:8123"


def status(
    host: str | None = "127.0.0.1:8123",
    origin: str | None = None,
    method: str = "GET",
    path: str = "/secret/",
    port: int = PORT,
) -> int:
    """Status of the answer, 200 where the request is accepted."""
    headers = [(name, value.encode()) for name, value in ((b"host", host), (b"Origin", origin)) if value is not None]
    refused = refusal(headers, method, path, TOKEN, port)
    return 200 if refused is None else refused[0]


@pytest.mark.parametrize("host", ["127.0.0.1:8123", "localhost:8123", "LOCALHOST:8123"])
def test_this_computer_is_answered(host: str) -> None:
    assert status(host) == 200


@pytest.mark.parametrize("host", ["evil.example:8123", "127.0.0.1", "127.0.0.1:80", "127.0.0.1:8123.evil.example", "", None])
def test_another_name_is_refused(host: str | None) -> None:
    assert status(host) == 403


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "127.0.0.1:80"])
def test_browsers_leave_out_the_port_80(host: str) -> None:
    origin = f"http://{host.removesuffix(':80')}"
    assert status(host, port=80) == status(host, origin, "WEBSOCKET", port=80) == 200
    assert status(host, "http://evil.example", port=80) == 403
    assert status(host, f"http://{host.removesuffix(':80')}:8123", port=80) == 403
    assert status("evil.example", port=80) == 403


def test_the_port_443_is_left_out_of_https_alone() -> None:
    headers = [(b"host", b"192.168.0.2"), (b"origin", b"https://192.168.0.2")]
    assert not is_foreign(headers, "POST", own_hosts(["192.168.0.2"], 443, "https"), "https")
    assert is_foreign(headers, "POST", own_hosts(["192.168.0.2"], 443, "http"), "http")
    assert is_foreign(headers, "POST", own_hosts(["192.168.0.2"], 80, "https"), "https")


@pytest.mark.parametrize("method", ["GET", "POST", "WEBSOCKET"])
@pytest.mark.parametrize("origin", ["http://evil.example", "https://127.0.0.1:8123", "http://127.0.0.1:9", "null", ""])
def test_a_page_from_elsewhere_is_refused(origin: str, method: str) -> None:
    assert status(origin=origin, method=method) == 403


@pytest.mark.parametrize(("method", "answer"), [("GET", 200), ("HEAD", 200), ("POST", 403), ("DELETE", 403), ("WEBSOCKET", 403)])
def test_only_read_requests_may_omit_the_origin(method: str, answer: int) -> None:
    assert status(method=method) == answer
    assert status(method=method, origin=OWN) == 200


def test_a_page_under_one_name_may_not_ask_under_the_other() -> None:
    assert status("localhost:8123", OWN, "WEBSOCKET") == 403


@pytest.mark.parametrize(
    "path", ["/", "/secre/", "/secrets/", "/Secret/", "//secret/", "/x/secret/", "/s%65cret/", "/\N{SNOWMAN}/"]
)
def test_without_the_token_nothing_is_served(path: str) -> None:
    assert status(path=path) == 404


def test_a_number_of_thousands_of_digits_is_nothing_here() -> None:
    assert status(path=f"/secret/{'9' * 5000}/") == 404


def test_two_hosts_are_one_too_many() -> None:
    assert refusal([(b"host", b"127.0.0.1:8123")] * 2, "GET", "/secret/", TOKEN, PORT) is not None
