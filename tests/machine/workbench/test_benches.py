"""Several models in one run of the workbench: each has a bench, which is closed with its work and leaves the others alone."""

import json
import time
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed

from mdp.save import stl
from tests.machine.running_workbench import PATIENCE_S, Running
from tests.shapes import tee


def above(bench: Running, path: str) -> str:
    """A path below the token that belongs to no bench."""
    return f"/{bench.place.split('/')[1]}/{path}"


def benches(bench: Running) -> list[dict[str, Any]]:
    with bench.line() as page:
        listed: list[dict[str, Any]] = page.state["benches"]
    return listed


def change(bench: Running, path: str, method: str) -> tuple[int, bytes]:
    return bench.ask(above(bench, path), method, Origin=f"http://127.0.0.1:{bench.port}")


def test_a_second_model_has_its_own_bench_that_is_closed_with_its_processes(bench: Running, tmp_path: Path) -> None:
    bench.send(_file(tmp_path, "first.stl"))
    with bench.line() as page:
        page.do("set", key="process.walls", value="5")
        page.until(lambda state: state["given"]["settings"][-1:] == ["process.walls=5"])
    before = set(bench.children())
    number = json.loads(change(bench, "benches?like=1", "POST")[1])["number"]
    second = Running(bench.process, bench.address.replace("/1/", f"/{number}/"))
    with bench.line() as page:  # it receives news of the other bench over its own line
        page.until(lambda state: [entry["name"] for entry in state["benches"]] == ["first.stl", ""])
        second.send(_file(tmp_path, "second.stl"))
        page.until(lambda state: [entry["name"] for entry in state["benches"]] == ["first.stl", "second.stl"])
    with second.line() as page:
        assert page.state["given"]["settings"][-1] == "process.walls=5"
        assert set(bench.children()) - before
        assert change(bench, f"benches/{number}", "DELETE")[0] == 200
        with pytest.raises(ConnectionClosed) as closed:
            page.until(lambda state: False)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4404
    assert [entry["name"] for entry in benches(bench)] == ["first.stl"]
    assert second.ask("")[0] == 404
    end_s = time.monotonic() + PATIENCE_S
    while set(bench.children()) - before and time.monotonic() < end_s:
        time.sleep(0.02)
    assert not set(bench.children()) - before


def test_another_origin_opens_and_closes_nothing_and_the_address_without_a_number_leads_to_a_bench(bench: Running) -> None:
    before = benches(bench)
    assert bench.ask(above(bench, "benches"), "POST")[0] == 403
    assert bench.ask(above(bench, "benches/1"), "DELETE", Origin="http://evil.example")[0] == 403
    assert benches(bench) == before
    assert bench.ask(above(bench, ""))[0] == 307


def _file(folder: Path, name: str) -> Path:
    (folder / name).write_bytes(stl(tee()))
    return folder / name
