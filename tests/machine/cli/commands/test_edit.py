"""The edit command: how it starts a browser."""

import stat
import webbrowser
from collections.abc import Callable
from pathlib import Path
from threading import Event
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

from machine.cli.cli import main
from machine.cli.commands import edit

ADDRESS = "http://127.0.0.1:8123/secret/1/"


def test_a_browser_is_started_with_a_file_of_this_user_alone_that_leads_to_the_address(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    started_with: list[str] = []
    started = Event()

    def start(address: str) -> bool:
        started_with.append(address)
        started.set()
        return True

    monkeypatch.setattr(webbrowser, "open", start)

    def serve(make: object, begin: object, announce: Callable[[str], None], *rest: Any) -> None:
        announce(ADDRESS)
        assert started.wait(60.0)
        file = Path(unquote(urlsplit(started_with[0]).path))
        assert oct(stat.S_IMODE(file.stat().st_mode)) == "0o600"
        assert f'content="0; url={ADDRESS}"' in file.read_text()

    monkeypatch.setattr(edit, "serve_workbench", serve)
    assert main(["edit"]) == 0
    (address,) = started_with
    assert address.startswith("file:///")
    assert "secret" not in address
    assert not Path(unquote(urlsplit(address).path)).exists()
    assert capsys.readouterr().out == f"{ADDRESS}\n"
