"""The gate: responses to a device of the network before it is paired, when it is, and after it is removed."""

import asyncio
import re
from pathlib import Path
from typing import Any

import httpx
import pytest
import segno
from starlette.responses import PlainTextResponse
from starlette.types import Receive, Scope, Send

from machine.workbench.access.gate import UNPAIRED_CODE, Gate
from machine.workbench.access.limits import DEVICE
from machine.workbench.access.network import Certificate, Lan
from machine.workbench.access.pairing import Door

ADDRESS, PORT = "192.168.1.5", 8123
OWN = f"http://{ADDRESS}:{PORT}"
LAN = Lan((ADDRESS,), ("workshop", "workshop.local"))


async def workbench(scope: Scope, receive: Receive, send: Send) -> None:
    """Stands in for the workbench: reports the device from which a request comes."""
    await PlainTextResponse(f"the workbench, device {scope[DEVICE]}")(scope, receive, send)


class Network:
    """A gate and its output at the terminal; the test advances the time."""

    def __init__(self, lan: Lan = LAN) -> None:
        self.said: list[str] = []
        self.now_s = 1000.0
        self.door = Door(self.said.append, lan.urls(PORT), lan.certificate is not None, lambda: self.now_s)
        self.gate = Gate(workbench, self.door, lan, PORT)
        self.door.announce()

    @property
    def code(self) -> str:
        """The pairing code printed last."""
        return next(found[0] for line in reversed(self.said) if (found := re.search(r"[A-Z2-9]{4}-[A-Z2-9]{4}", line)))

    def device(self, own: str = OWN) -> httpx.AsyncClient:
        return httpx.AsyncClient(transport=httpx.ASGITransport(self.gate), base_url=own, headers={"accept": "text/html"})


async def pair(device: httpx.AsyncClient, code: str, origin: str | None = OWN) -> httpx.Response:
    headers = {} if origin is None else {"origin": origin}
    return await device.post("/pair", data={"code": code}, headers=headers)


def test_an_unpaired_device_gets_one_page_without_scripts_and_nothing_else() -> None:
    async def run() -> None:
        network = Network()
        async with network.device() as device:
            page = await device.get("/")
            assert page.status_code == 200
            assert re.findall(r'<label for="code">(.*?)</label>', page.text) == ["Code"]
            assert "<script" not in page.text
            assert network.code not in page.text
            assert "default-src 'none'" in page.headers["content-security-policy"]
            assert "others in this network can read along" in page.text
            for path in ("/paired/", "/paired/1/", "/paired/1/model/x", "/favicon.ico", "/pair"):
                assert (await device.get(path)).headers["location"] == "/"
                assert (await device.get(path, headers={"accept": "*/*"})).status_code == 403
            for method in ("POST", "DELETE", "PUT", "OPTIONS"):
                assert (await device.request(method, "/paired/1/", headers={"origin": OWN})).status_code == 403

    asyncio.run(run())


def test_the_page_of_the_computer_gets_the_address_without_the_code_as_a_picture_for_the_camera_of_a_phone() -> None:
    door = Network().door
    told = door.snapshot()
    assert told["qr_code"] == segno.make(told["addresses"][0], micro=False).svg_data_uri(border=1)
    assert told["qr_code"].startswith("data:image/svg+xml;charset=utf-8,%3Csvg")


def test_the_code_gives_a_device_its_own_cookie_and_is_used_up() -> None:
    async def run() -> None:
        network = Network()
        code = network.code
        async with network.device() as phone, network.device() as tablet:
            answer = await pair(phone, code)
            assert (answer.status_code, answer.headers["location"]) == (303, "/paired/")
            cookie = answer.headers["set-cookie"]
            assert re.fullmatch(r"tiltprint-8123=[\w-]{32}; HttpOnly; Path=/; SameSite=strict", cookie)
            assert (await phone.get("/paired/1/")).text == "the workbench, device 1"
            assert (await phone.get("/")).headers["location"] == "/paired/"
            assert (await phone.get("/other/1/")).status_code == 404
            assert (await pair(tablet, code)).status_code == 403
            assert (await pair(tablet, network.code)).status_code == 303
            assert (await tablet.get("/paired/1/")).text == "the workbench, device 2"
            assert [device["number"] for device in network.door.snapshot()["devices"]] == [1, 2]

    asyncio.run(run())


@pytest.mark.parametrize("cookie", ["tiltprint-8123=", "tiltprint-8123=x", "tiltprint-80=x", "=;=", "tiltprint-8123"])
def test_another_cookie_is_that_of_no_device(cookie: str) -> None:
    async def run() -> None:
        network = Network()
        async with network.device() as phone, network.device() as other:
            await pair(phone, network.code)
            assert (await other.get("/paired/1/", headers={"cookie": cookie})).headers["location"] == "/"

    asyncio.run(run())


@pytest.mark.parametrize("host", ["evil.example:8123", "127.0.0.1:8123", "localhost:8123", "192.168.1.5", "192.168.1.5:80", ""])
def test_requests_for_another_host_name_are_refused_even_from_paired_devices(host: str) -> None:
    async def run() -> None:
        network = Network()
        async with network.device() as phone:
            await pair(phone, network.code)
            for path in ("/", "/paired/1/"):
                assert (await phone.get(path, headers={"host": host})).status_code == 403

    asyncio.run(run())


@pytest.mark.parametrize("name", ["192.168.1.5", "workshop", "workshop.local", "WORKSHOP.local"])
def test_requests_may_name_the_computer_by_address_or_name(name: str) -> None:
    async def run() -> None:
        async with Network().device(f"http://{name}:{PORT}") as device:
            assert (await device.get("/")).status_code == 200

    asyncio.run(run())


@pytest.mark.parametrize("origin", ["http://evil.example", "https://192.168.1.5:8123", "http://workshop:8123", "null", None])
def test_a_page_from_elsewhere_can_neither_pair_nor_use_up_codes(origin: str | None) -> None:
    async def run() -> None:
        network = Network()
        async with network.device() as device:
            for _ in range(30):
                assert (await pair(device, "WRONG", origin)).status_code == 403
            assert (await pair(device, network.code, origin)).status_code == 403
            assert network.door.pairing.wrong_in_all == 0
            assert (await pair(device, network.code)).status_code == 303

    asyncio.run(run())


def test_a_hundred_codes_at_once_pair_no_device_close_pairing_and_leave_paired_devices() -> None:
    async def run() -> None:
        network = Network()
        async with network.device() as phone, network.device() as thief:
            await pair(phone, network.code)
            for _ in range(4):
                answers = await asyncio.gather(*(pair(thief, f"WRNG{k:04}") for k in range(100)))
                assert {answer.status_code for answer in answers} <= {403, 429}
                network.now_s += 1000.0
                assert (await phone.get("/paired/1/")).text == "the workbench, device 1"
            assert "20 wrong codes were typed: no further device can be paired" in network.said[-1]
            assert "the page on this computer" in network.said[-1]
            right = network.door.pairing.code
            assert (await pair(thief, right)).status_code == 403
            page = await thief.get("/")
            assert "no further device can be paired" in page.text
            assert "<form" not in page.text
            assert len(network.door.devices) == 1
            network.door.reopen()
            assert (await pair(thief, network.code)).status_code == 303

    asyncio.run(run())


def test_the_wait_is_shown_on_the_page_and_in_the_terminal_and_holds_for_the_right_code() -> None:
    async def run() -> None:
        network = Network()
        async with network.device() as device:
            wrong = [await pair(device, "WRONG") for _ in range(5)]
            assert [answer.status_code for answer in wrong] == [403] * 5
            assert 'role="alert">This is not the code' in wrong[0].text
            assert "5 wrong codes were typed: for 30 s none is taken, then a new one" in network.said[-1]
            network.now_s += 10.0
            waits = await pair(device, network.code)
            assert (waits.status_code, waits.headers["retry-after"]) == (429, "20")
            assert "Wait 20 seconds" in waits.text
            assert "Wait 20 seconds" in (await device.get("/")).text
            network.now_s += 20.0
            assert (await pair(device, network.code)).status_code == 303

    asyncio.run(run())


@pytest.mark.parametrize("body", [b"", b"code", b"other=x", b"\xff\xfe=", b"code=" + b"A" * 10_000, b"code=%FF%00"])
def test_an_invalid_code_is_refused(body: bytes) -> None:
    async def run() -> None:
        async with Network().device() as device:
            answer = await device.post("/pair", content=body, headers={"origin": OWN})
            assert answer.status_code in (400, 403)

    asyncio.run(run())


def test_encrypted_the_cookie_is_for_encrypted_lines_alone_and_no_page_says_that_others_read_along() -> None:
    async def run() -> None:
        lan = Lan((ADDRESS,), (), Certificate(Path("a.pem"), Path("b.pem")))
        network, own = Network(lan), OWN.replace("http", "https")
        async with network.device(own) as device:
            assert "read along" not in (await device.get("/")).text + " ".join(network.said)
            assert "Secure" in (await pair(device, network.code, own)).headers["set-cookie"]
            assert (await pair(device, network.code, OWN)).status_code == 403

    asyncio.run(run())


def test_a_device_that_is_let_go_loses_its_line_and_what_it_was_sending_at_once() -> None:
    heard: list[str] = []

    async def listening(scope: Scope, receive: Receive, send: Send) -> None:
        heard.append((await receive())["type"])

    async def run(kind: str) -> list[Any]:
        network, sent = Network(), list[Any]()
        async with network.device() as phone:
            cookie = (await pair(phone, network.code)).headers["set-cookie"].partition(";")[0]
        gate = Gate(listening, network.door, LAN, PORT)
        headers = [(b"host", f"{ADDRESS}:{PORT}".encode()), (b"origin", OWN.encode()), (b"cookie", cookie.encode())]

        async def send(message: Any) -> None:
            sent.append(message)

        scope = {"type": kind, "method": "POST", "path": "/paired/1/line", "headers": headers}
        line = asyncio.create_task(gate(scope, asyncio.Event().wait, send))  # type: ignore[arg-type]
        await asyncio.sleep(0)
        network.door.unpair(device=1)
        await asyncio.wait_for(line, 10.0)
        assert network.door.device_of(cookie.partition("=")[2]) is None
        return sent

    assert asyncio.run(run("websocket")) == [
        {"type": "websocket.close", "code": UNPAIRED_CODE, "reason": "this device is not paired"}
    ]
    assert asyncio.run(run("http")) == []
    assert heard == ["websocket.disconnect", "http.disconnect"]
