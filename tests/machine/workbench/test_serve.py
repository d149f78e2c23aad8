"""The port of a workbench: its owner, and reuse after a workbench was killed, with the files that were on its benches."""

import json
import signal
import socket
import tempfile
import time
from pathlib import Path

import pytest

from machine.workbench.access.network import listen
from machine.workbench.work.folders import kept_folder
from mdp.save import stl
from profiles.errors import OutputError
from tests.machine.browser import Browser
from tests.machine.running_workbench import PATIENCE_S, Running, workbench
from tests.shapes import tee

TEE = stl(tee())
# Controls that send a request to the bench.
ASKING = """[...document.querySelectorAll(`:is([data-do], [data-demo], [data-save], [data-turn], #find, #slice, #again,
  #open, #save, #history, #file, #demo, #save-errors)`)]"""
ENABLED = f"{ASKING}.filter((control) => !control.matches(':disabled')).map((control) => control.outerHTML)"


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files of this process and its children."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


@pytest.fixture
def port() -> str:
    """A free port."""
    with socket.create_server(("127.0.0.1", 0)) as own:
        return str(own.getsockname()[1])


def kill(running: Running) -> None:
    running.process.send_signal(signal.SIGKILL)
    running.process.wait(PATIENCE_S)


def send(running: Running, folder: Path, name: str, content: bytes) -> int:
    (folder / name).write_bytes(content)
    return running.send(folder / name)[0]


def wait_until_kept(since_s: float) -> None:
    """Wait until a locked plane is saved in the state folder after this time."""
    end_s = time.monotonic() + 30.0
    folder = kept_folder()
    while not any(_is_locked(record, since_s) for record in folder.glob("*/work.json")):
        assert time.monotonic() < end_s
        time.sleep(0.05)


def _is_locked(record: Path, since_s: float) -> bool:
    return bool(json.loads(record.read_text())["locked"]) and record.stat().st_mtime > since_s


def test_the_port_of_a_server_with_open_connections_can_be_used_again_at_once() -> None:
    with listen(0) as own:
        at = own.getsockname()
        with socket.create_connection(at):
            line, _ = own.accept()
            line.close()  # closed by the server first, as when it dies: the port stays reserved for a minute
    listen(at[1]).close()


def test_two_servers_never_have_one_port() -> None:
    with listen(0) as own, pytest.raises(OutputError, match=r"--port \d+ cannot be used: address already in use"):
        listen(own.getsockname()[1])


def test_a_workbench_that_follows_a_killed_one_at_its_port_has_another_token_and_opens_its_files(
    temporary: Path, port: str
) -> None:
    began_s = time.time()
    with workbench("--port", port) as killed, killed.line() as page:
        assert send(killed, temporary, "tee.stl", TEE) == 200
        page.until(lambda state: state["model"])
        page.do("set", key="process.walls", value="4")
        page.do("add", normal=[0, 0, 1], offset_mm=8.0)
        page.until(lambda state: state["parts"] == 2)
        page.do("lock", part=2, locked=True)
        page.until(lambda state: state["locked"] == [True])
        wait_until_kept(began_s)
        kill(killed)
    with workbench("--port", port) as running, running.line() as page:
        assert running.port == killed.port
        assert killed.ask("")[0] == 404
        kept = next(work for work in json.loads(running.ask("kept")[1]) if work["name"] == "tee.stl")
        assert kept["parts"] == 2
        assert running.ask(f"kept/{kept['key']}", "POST", Origin=f"http://127.0.0.1:{running.port}")[0] == 200
        again = page.until(lambda state: state["locked"] == [True])
        assert (again["given"]["settings"], again["parts"], again["model"]["name"]) == (["process.walls=4"], 2, "tee.stl")
        assert kept["key"] not in [work["key"] for work in json.loads(running.ask("kept")[1])]  # the bench continues to keep it
        (left,) = json.loads(running.ask("left")[1])
        assert (left["name"], left["bytes"]) == ("tee.stl", len(TEE))
        own = f"http://127.0.0.1:{running.port}"
        assert running.ask(f"left/{left['key']}", "POST", Origin=own)[0] == 200
        model = page.until(lambda state: state["model"])["model"]
        assert (model["name"], model["faces"]) == ("tee.stl", len(tee().faces))
        assert running.ask("left/1", "POST", Origin=own)[0] == 422
        problem = page.until(lambda state: state["problem"])["problem"]
        assert problem == "no such file has been left by a workbench that was killed"
        page.do("set", key="process.scale", value="2")  # this reads the model again
        page.until(lambda state: state["model"]["size_mm"][0] > 79)
        assert json.loads(running.ask("left")[1]) == [left]  # it stays where it was
        assert running.ask(f"left/{left['key']}", "DELETE", Origin="http://evil.example")[0] == 403
        (file,) = (path for path in temporary.glob("tiltprint-edit-*/*/tee.stl") if path.stat().st_mtime == left["written_s"])
        file.unlink()
        assert running.ask(f"left/{left['key']}", "POST", Origin=own)[0] == 422
        problem = page.until(lambda state: state["problem"].startswith("tee.stl"))["problem"]
        assert problem == "tee.stl, left by a workbench that was killed, cannot be read: no such file or directory"
        file.write_bytes(TEE)
        assert running.ask(f"left/{left['key']}", "DELETE", Origin=own)[0] == 200
        assert json.loads(running.ask("left")[1]) == []
        assert not file.parent.exists()


def test_a_page_of_a_killed_workbench_says_what_to_do_and_the_next_one_offers_its_files(
    browser: Browser, temporary: Path, port: str
) -> None:
    with workbench("--port", port) as killed:
        assert send(killed, temporary, "tee.stl", TEE) == 200
        browser.open(killed.address)
        browser.wait("document.documentElement.dataset.line === 'open' && $('title').textContent === 'tee.stl'")
        assert browser.value("$('left-field').hidden")
        kill(killed)
        browser.wait("document.documentElement.dataset.line === 'ended'")
        assert browser.value("$('notice').textContent").startswith("tiltprint has ended. Start it again and open the address")
    with workbench("--port", port) as running:
        browser.wait("document.documentElement.dataset.line === 'replaced'")
        problem = browser.value("$('notice').checkVisibility() && $('notice').textContent")
        assert problem.endswith("Another one runs now: open the address in its terminal.")
        browser.open(running.address)
        browser.wait("!$('left-field').hidden")
        assert browser.value("$('left-list').querySelector('button span').textContent") == "tee.stl"
        browser.click("#left-list button")
        browser.wait("$('title').textContent === 'tee.stl'")
        assert browser.complaints == []


def test_a_page_of_a_workbench_that_hangs_waits_for_it(browser: Browser) -> None:
    with workbench() as running:
        browser.open(running.address)
        browser.wait("document.documentElement.dataset.line === 'open'")
        running.process.send_signal(signal.SIGSTOP)
        try:
            browser.value("{ window.whyUnanswered = modules['page/line'].whyUnanswered; window.why = whyUnanswered(); }")
            assert browser.value("window.why") == "lost"
            browser.wait("document.documentElement.dataset.line === 'silent'")
            assert browser.value("$('notice').textContent") == "tiltprint does not answer; waiting for it."
            assert browser.value(ENABLED) == []
        finally:
            running.process.send_signal(signal.SIGCONT)
        assert browser.value("whyUnanswered()") == "lost"  # it answers, so a line will open
        browser.wait("document.documentElement.dataset.line === 'open' && !$('demo').matches(':disabled')")
        assert browser.value("$('notice').hidden && ['find', 'open', 'add-opened'].every((id) => $(id).matches(':enabled'))")
