"""The workbench from another device of the network: paired by a code, on a page of a phone's size, and removed again."""

import http.client
import json
import re
import shutil
import ssl
import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from machine.workbench.access.network import network_addresses
from mdp.save import stl
from tests.machine.browser import Browser
from tests.machine.prints import PrintPage
from tests.machine.running_workbench import PATIENCE_S, QUICK, OpenToNetwork, Page, open_workbench
from tests.machine.test_workbench_page import choose
from tests.shapes import box

pytestmark = pytest.mark.skipif(not network_addresses(), reason="this computer has no address in a network")
PHONE = (390, 780)
PRINTING, IDLE = "document.documentElement.dataset.printing", "document.documentElement.dataset.busy === ''"


@pytest.fixture(scope="module")
def bench() -> Iterator[OpenToNetwork]:
    with open_workbench(*QUICK) as running:
        yield running


class Device:
    """A device of the network without a browser."""

    def __init__(self, bench: OpenToNetwork) -> None:
        self._bench, self.cookie, self.said = bench, "", b""

    @property
    def origin(self) -> str:
        return self._bench.network.removesuffix("/")

    def ask(self, path: str, method: str = "GET", body: bytes | None = None, **headers: str) -> http.client.HTTPResponse:
        connection = http.client.HTTPConnection(self._bench.host, self._bench.port, timeout=PATIENCE_S)
        connection.request(method, path, body, {"Cookie": self.cookie, "Origin": self.origin, **headers})
        answer = connection.getresponse()
        self.said = answer.read()
        connection.close()
        return answer

    def pair(self, code: str) -> int:
        form = {"Content-Type": "application/x-www-form-urlencoded"}
        answer = self.ask("/pair", "POST", urlencode({"code": code}).encode(), **form)
        self.cookie = (answer.getheader("Set-Cookie") or "").partition(";")[0] or self.cookie
        return answer.status

    def connect(self, path: str) -> Any:
        address = f"ws://{self._bench.host}:{self._bench.port}{path}"
        headers = {"Cookie": self.cookie}
        return connect(address, origin=self.origin, additional_headers=headers, max_size=None, proxy=None)  # type: ignore[arg-type]


class DevicesPage:
    """The websocket of this computer's page for paired devices; state: the newest state received."""

    def __init__(self, line: ClientConnection) -> None:
        self._line = line
        self.state: dict[str, Any] = json.loads(line.recv(PATIENCE_S))

    def until(self, condition: Any) -> dict[str, Any]:
        while not condition(self.state):
            self.state = json.loads(self._line.recv(PATIENCE_S))
        return self.state

    def do(self, command: str, **given: Any) -> None:
        self._line.send(json.dumps({"do": command, **given}))


@contextmanager
def devices_page(bench: OpenToNetwork) -> Iterator[DevicesPage]:
    address = f"ws://127.0.0.1:{bench.port}{bench.place}devices"
    with connect(address, origin=f"http://127.0.0.1:{bench.port}", proxy=None) as line:  # type: ignore[arg-type]
        yield DevicesPage(line)


def test_an_unpaired_device_has_no_line_no_model_and_no_use_for_the_token(bench: OpenToNetwork) -> None:
    device = Device(bench)
    for path in (f"{bench.place}line", "/paired/1/line", "/paired/1/prints?page=x", "/paired/1/devices"):
        with pytest.raises(InvalidStatus, match="403"), device.connect(path):
            pass
    for path in (bench.place, "/paired/1/", "/paired/1/file?name=x.stl", "/paired/1/kept"):
        assert device.ask(path).status == 403
        assert device.ask(path, "POST", b"").status == 403
    assert bench.code() not in bench.ask("")[1].decode()


def test_a_paired_device_commands_the_bench_until_it_is_let_go(bench: OpenToNetwork) -> None:
    device = Device(bench)
    assert device.pair(bench.code()) == 303
    with devices_page(bench) as own:
        number = own.until(lambda state: state["devices"])["devices"][-1]["number"]
        with device.connect("/paired/1/line") as line:
            page = Page(line)
            page.do("demo", name="demo:bracket")
            page.until(lambda state: state["model"])
            page.do("search", ranker="/etc/hostname")
            problem = page.until(lambda state: state["problem"])["problem"]
            assert problem.startswith("a paired device chooses classic or learned as ranker, no file")
            with pytest.raises(InvalidStatus, match="403"), device.connect("/paired/1/devices"):
                pass
            assert device.ask("/paired/1/file?name=a.gltf", "POST", b"{}").status == 422
            assert b"may name files of the computer" in device.said
            profile = b'inherits = "/etc/hostname"\n[process]\nwalls = 3\n'
            assert device.ask("/paired/1/file?name=own.toml", "POST", profile).status == 422
            assert b"own.toml: the profile of a paired device inherits one that is known here" in device.said
            own.do("unpair", device=number)
            with pytest.raises(ConnectionClosed) as closed:
                page.until(lambda state: False)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 4403
        assert own.until(lambda state: not state["devices"])["devices"] == []
    assert device.ask("/paired/1/").status == 403


def test_a_hundred_parallel_codes_pair_no_device_and_leave_the_others_connected() -> None:
    with open_workbench(*QUICK) as bench:
        paired = Device(bench)
        assert paired.pair(bench.code()) == 303
        with paired.connect("/paired/1/line") as line, ThreadPoolExecutor(16) as pool:
            page = Page(line)
            answers = list(pool.map(lambda k: Device(bench).pair(f"WRNG{k:04}"), range(100)))
            assert sorted({*answers}) == [403, 429]
            assert answers.count(403) == 5
            assert Device(bench).pair(bench.code()) == 429  # the right code has to wait, too
            page.do("demo", name="demo:bracket")
            page.until(lambda state: state["model"])
            assert bench.ask("")[0] == 200
        assert "5 wrong codes were typed: for 30 s none is taken" in bench.told.read_text()


def test_a_device_stops_the_print_of_another_page_and_the_print_outlives_its_device(bench: OpenToNetwork, tmp_path: Path) -> None:
    (tmp_path / "box.stl").write_bytes(stl(box(12.0, 12.0, 8.0)))
    device = Device(bench)
    assert device.pair(bench.code()) == 303
    with bench.line() as page:
        assert bench.send(tmp_path / "box.stl")[0] == 200
        page.until(lambda state: state["model"] and state["model"]["name"] == "box.stl")
        page.do("slice")
        page.until(lambda state: state["sliced"])
    with device.connect("/paired/1/prints?page=phone") as line:
        phone = PrintPage(line)
        phone.do("check", port="/etc/hostname")
        assert phone.refused().startswith("a paired device chooses among the ports that were found here")
        phone.do("check", port="sim", sim_speed=1)
        phone.until(lambda job: job["state"] == "ready")
        phone.command("begin")
        phone.until(lambda job: job["state"] == "printing")
    with device.connect("/paired/1/prints?page=other") as line:
        other = PrintPage(line)
        assert other.until(lambda job: not job.get("held", True))["state"] == "printing"
        other.command("emergency")
        assert other.until(lambda job: job["is_over"])["state"] == "failed"


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificate")
def test_with_a_certificate_the_network_uses_https_and_this_computer_http(tmp_path: Path) -> None:
    own = [str(tmp_path / name) for name in ("own.pem", "own.key")]
    new = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    subprocess.run([*new, "-out", own[0], "-keyout", own[1], "-subj", "/CN=workshop"], check=True, capture_output=True)
    with open_workbench(*QUICK, "--certificate", own[0], "--key", own[1]) as bench:
        assert bench.network == f"https://{bench.host}:{bench.port}/"
        assert bench.ask("")[0] == 200
        context = ssl._create_unverified_context()
        connection = http.client.HTTPSConnection(bench.host, bench.port, timeout=PATIENCE_S, context=context)
        headers = {"Origin": bench.network.removesuffix("/"), "Content-Type": "application/x-www-form-urlencoded"}
        connection.request("POST", "/pair", urlencode({"code": bench.code()}), headers)
        answer = connection.getresponse()
        cookie = answer.getheader("Set-Cookie") or ""
        connection.close()
        assert answer.status == 303
        assert re.search(r"; Secure\b", cookie)
        headers = {"Cookie": cookie.partition(";")[0]}
        address = f"wss://{bench.host}:{bench.port}/paired/1/line"
        own_origin: Any = bench.network.removesuffix("/")
        with connect(address, origin=own_origin, additional_headers=headers, ssl=context, max_size=None, proxy=None) as line:
            assert Page(line).state["model"] is None
        with pytest.raises(OSError, match=r"reset|closed|EOF|aborted"):
            Device(bench).ask("/")  # unencrypted
        assert "read along" not in bench.told.read_text()
        assert "Traceback" not in bench.told.read_text()


def test_from_the_phone_a_model_is_turned_and_a_print_stopped(bench: OpenToNetwork, browser: Browser, tmp_path: Path) -> None:
    browser.resize(*PHONE, mobile=True)
    browser.value(f"location.assign('{bench.network}')")
    browser.wait("document.getElementById('code')")
    browser.value("document.getElementById('code').value = 'WRONG'")
    browser.value("document.querySelector('button').click()")
    browser.wait("document.getElementById('refusal')")
    roles = [node for node in browser.accessible() if node["role"] in ("textbox", "button", "alert", "heading")]
    assert [node["role"] for node in roles] == ["heading", "alert", "textbox", "button"]
    assert [node["name"] for node in roles if node["role"] in ("textbox", "button")] == ["Code", "Pair this device"]
    assert browser.value("document.documentElement.scrollWidth <= innerWidth")
    browser.screenshot(tmp_path / "pairing.png")
    browser.complaints.clear()  # about the answer to a wrong code
    browser.value(f"document.getElementById('code').value = '{bench.code().lower()}'")
    browser.value("document.querySelector('button').click()")
    browser.wait("document.documentElement?.dataset.line === 'open' && document.documentElement.dataset.state === 'ready'")
    assert browser.complaints == []
    choose(browser, "post.stl", stl(box(8.0, 8.0, 12.0)))
    browser.wait(f"$('title').textContent === 'post.stl' && {IDLE}")
    browser.click("[data-turn=x][data-deg='90']")
    browser.wait(f"$('undo').ariaLabel === 'undo: turn the model' && {IDLE}")
    browser.screenshot(tmp_path / "model.png")
    browser.click("#tab-slices")
    browser.click("#slice")
    browser.wait("!document.body.classList.contains('no-slices')")
    browser.click("#leave-print")
    browser.click("#tab-printing")
    browser.value("$('sim-speed').value = '1'")
    browser.click("#check")
    browser.wait(f"{PRINTING} === 'ready'")
    browser.click("#begin")
    browser.wait(f"{PRINTING} === 'printing'")
    browser.screenshot(tmp_path / "printing.png")
    browser.click("#emergency")
    browser.wait(f"{PRINTING} === 'over'")
    browser.screenshot(tmp_path / "stopped.png")
    with devices_page(bench) as own:
        own.do("unpair", device=own.state["devices"][-1]["number"])
        browser.wait("document.documentElement.dataset.line === 'unpaired'")
    assert browser.value("$('notice').checkVisibility() && $('notice').textContent").startswith("This device is no longer paired")
    browser.value("location.reload()")
    browser.wait("document.getElementById('code')")


def test_the_page_of_the_computer_lists_devices_and_lets_them_go(bench: OpenToNetwork, browser: Browser, tmp_path: Path) -> None:
    device = Device(bench)
    assert device.pair(bench.code()) == 303
    browser.resize(900, 760)
    browser.open(bench.address)
    browser.wait("$('devices').querySelector('li')")
    assert "is asked for the code that the terminal shows" in browser.value("$('network-told').textContent")
    browser.wait("$('network-code').checkVisibility() && $('network-code').naturalWidth > 20")  # the address as a QR code
    assert bench.code() not in browser.value("document.documentElement.outerHTML")
    browser.value("$('network').scrollIntoView()")
    browser.screenshot(tmp_path / "devices.png")
    count = browser.value("$('devices').children.length")
    for _ in range(5):
        Device(bench).pair("WRONG")
    browser.wait("$('pairing-told').textContent.startsWith('Wrong codes were typed: no code is taken before')")
    browser.click("#devices li:last-child button")
    browser.wait(f"$('devices').children.length === {count} - 1")
    end_s = time.monotonic() + PATIENCE_S
    while device.ask("/paired/1/").status != 403:
        assert time.monotonic() < end_s
