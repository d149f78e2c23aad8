"""Bench of the workbench: how long live numbers, the first ones, opening and stopping take: `python tools/bench_workbench.py`.

Starts `tiltprint edit` on models of its own, a figure with a wavy skin in 10,000 and 100,000 faces, and is a page of it: drags a
plane as a hand does, the next move when the figures of the one before are there. In Chromium, where it is installed, also
turns the model and drags the handle of the plane. --model FILE: a model of yours instead. --benches N ...: how many processes and
how much memory a number of benches take, each with the figure, planes tried on it, and a second figure after that.
"""

import argparse
import statistics
import tempfile
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import manifold3d as m3
import numpy as np
from numpy.typing import NDArray

from mdp.cut import mesh_of, solid_of
from mdp.mesh import Floats
from mdp.model_file import locate
from mdp.read import read_mesh
from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import Page, Running, workbench

FACES = (10_000, 100_000)
WAVE_MM, FOOT_MM = 0.02, 5.0  # of the skin, growing from the platform upwards
HEIGHT_SHARE, STEP_SHARE, LEAN = 0.3, 0.004, 0.01  # of the plane that is dragged
PAUSE_S = 0.016  # of a hand between two places, a picture of a screen
COLUMNS = ("faces", "open s", "first figures s", "live ms", "the same in a page", "risky while turning ms", "stopped / taken s")
SETTLED_S = 3.0  # until processes that are not needed any more are gone
SCREEN = "document.documentElement.dataset"


def figure(faces: int) -> m3.Manifold:
    """The demo figure with about `faces` faces of one size and a skin that waves a little, so that no two are alike."""
    solid, low, high = solid_of(read_mesh(locate("demo:figure"))[0]), 0.05, 20.0
    for _ in range(25):
        middle = (low * high) ** 0.5
        low, high = (middle, high) if solid.refine_to_length(middle).num_tri() > faces else (low, middle)

    def wave(points: Any) -> NDArray[np.float64]:
        p: Floats = np.asarray(points, dtype=np.float64)
        x, y, z = p.T
        waves = np.stack([np.sin(2.1 * y + 1.7 * z), np.sin(1.9 * x - 2.3 * z), np.sin(1.6 * x + 2.2 * y)], axis=1)
        return p + WAVE_MM * np.minimum(z / FOOT_MM, 1.0)[:, None] * waves

    return solid.refine_to_length(high).warp_batch(wave)


def planes(height_mm: float, moves: int) -> Iterator[tuple[list[float], float]]:
    """Normals and offsets of a level plane that goes up, then leans ever more."""
    for k in range(moves):
        yield [0.0, 0.0, 1.0], height_mm * (HEIGHT_SHARE + STEP_SHARE * (k + 1))
    top_mm = height_mm * (HEIGHT_SHARE + STEP_SHARE * moves)
    for k in range(moves):
        lean = LEAN * (k + 1)
        yield [float(np.sin(lean)), 0.0, float(np.cos(lean))], top_mm * float(np.cos(lean))


def waited(act: Callable[[], Any]) -> float:
    """Seconds that something takes."""
    began = monotonic()
    act()
    return monotonic() - began


def drag(page: Page, moves: int) -> list[float]:
    """Seconds from each move of a plane to its figures."""
    spent = []
    for normal, offset_mm in planes(page.state["model"]["size_mm"][2], moves):
        sleep(PAUSE_S)

        def there(state: dict[str, Any], normal: list[float] = normal, offset_mm: float = offset_mm) -> bool:
            cuts = state["trial"]["cuts"] if state["trial"] else []
            return bool(cuts) and abs(cuts[-1]["offset_mm"] - offset_mm) < 1e-9 and abs(cuts[-1]["normal"][0] - normal[0]) < 1e-9

        def move(normal: list[float] = normal, offset_mm: float = offset_mm, there: Any = there) -> None:
            page.do("try", part=page.state["parts"], normal=normal, offset_mm=offset_mm)
            page.until(there)

        spent.append(waited(move))
    return spent


def measure(model: str, moves: int) -> dict[str, float]:
    """Seconds of all that is measured over the line."""
    row, began = dict[str, float](), monotonic()
    with workbench(model) as running:
        with running.line() as page:
            page.until(lambda state: state["model"])
            row["open"] = monotonic() - began
            row["faces"] = page.state["model"]["faces"]
            height_mm = page.state["model"]["size_mm"][2]

            def add() -> None:
                page.do("add", normal=[0, 0, 1], offset_mm=height_mm * HEIGHT_SHARE)
                page.until(lambda state: state["problem"] or (state["parts"] == 2 and state["trial"]))

            row["first"] = waited(add)
            if page.state["problem"]:
                raise SystemExit(f"{model}: {page.state['problem']}")
            spent = drag(page, moves)
            row["live"], row["worst"] = statistics.median(spent), max(spent)
        if CHROMIUM is not None:
            turns, moved = in_page(running, moves)
            row |= {"turn": statistics.median(turns), "worst turn": max(turns)}
            row |= {"page": statistics.median(moved), "worst page": max(moved)}
        with running.line() as page:
            row |= stop(page)
    return row


def stop(page: Page) -> dict[str, float]:
    """Seconds until a search that has found something has stopped, and until its best so far is taken."""
    page.do("search")
    page.until(lambda state: state["search"] and state["search"]["planes"])
    began = monotonic()
    page.do("stop")
    page.until(lambda state: not state["search"])
    stopped = monotonic() - began
    page.until(lambda state: state["undo"] == "stop the search")
    return {"stop": stopped, "taken": monotonic() - began}


def in_page(running: Running, moves: int) -> tuple[list[float], list[float]]:
    """Milliseconds that the page takes for what is risky while the model turns, and from a move of a plane to its figures."""
    with Browser((1280, 800)) as browser:
        browser.open(running.address)
        browser.wait(f"{SCREEN}.shown")
        turns = [_turned(browser, k) for k in range(moves, -1, -1)]
        browser.click("#tab-parts")
        browser.click("#parts-list input[value='2']")
        browser.wait("!$('handles').hidden")
        x, y = browser.value("(() => { const { x, y } = $('hand-along').getBoundingClientRect(); return [x + 15, y + 15]; })()")
        browser.hold((x, y))
        return turns, [_moved(browser, x, y - k - 1) for k in range(moves)]


def _turned(browser: Browser, deg: int) -> float:
    browser.value(f"(() => {{ $('turn-x').value = {deg}; $('turn-x').dispatchEvent(new Event('input')); }})()")
    return float(browser.value(f"{SCREEN}.liveMs"))


def _moved(browser: Browser, x: float, y: float) -> float:
    """The pointer that holds the handle along the plane's normal somewhere else."""
    at = f"{{ clientX: {x}, clientY: {y} }}"
    browser.value(f"{SCREEN}.triedMs = ''; $('hand-along').dispatchEvent(new PointerEvent('pointermove', {at}))")
    browser.wait(f"{SCREEN}.triedMs")
    return float(browser.value(f"{SCREEN}.triedMs"))


def on_benches(count: int, models: Sequence[Path]) -> str:
    """A row: processes and memory of a number of benches on each of which the models were opened one after the other and a plane
    tried, and of the first alone when the others are closed."""
    with workbench() as running:
        above, origin = f"/{running.place.split('/')[1]}/benches", f"http://127.0.0.1:{running.port}"
        for _ in range(count - 1):
            running.ask(f"{above}?like=1", "POST", Origin=origin)
        benches = [Running(running.process, running.address.replace("/1/", f"/{k + 1}/")) for k in range(count)]
        for model, bench in product(models, benches):
            bench.send(model)
            with bench.line() as page:
                page.do("add", normal=[0, 0, 1], offset_mm=page.state["model"]["size_mm"][2] * HEIGHT_SHARE)
                page.until(lambda state: state["trial"] and state["parts"] == 2 and state["resting"] and not state["preparing"])
        filled = memory(running)
        for k in range(2, count + 1):
            running.ask(f"{above}/{k}", "DELETE", Origin=origin)
        sleep(SETTLED_S)
        return f"| {count} | {filled} | {memory(running)} |"


def memory(running: Running) -> str:
    """How many processes a workbench is, and how much memory they take together; what they share is counted once."""
    processes = [running.process.pid, *running.children()]
    rolls = [Path(f"/proc/{pid}/smaps_rollup").read_text() for pid in processes]
    kib = sum(int(line.split()[1]) for roll in rolls for line in roll.splitlines() if line.startswith("Pss:"))
    return f"{len(processes)}, {kib / 2**20:.2f} GiB"


def sentence(row: dict[str, float]) -> str:
    """A row of the table."""
    live = f"{1000 * row['live']:.0f} / {1000 * row['worst']:.0f}"
    page, turn = (f"{row[of]:.0f} / {row[f'worst {of}']:.0f}" if of in row else "-" for of in ("page", "turn"))
    ends = f"{row['stop']:.2f} / {row['taken']:.1f}"
    return f"| {row['faces']:.0f} | {row['open']:.1f} | {row['first']:.2f} | {live} | {page} | {turn} | {ends} |"


def measure_benches(counts: Sequence[int], faces: int) -> None:
    """Print the table of memory."""
    print("| benches | processes, memory | the same when all but one are closed |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        models = [Path(folder) / f"{name}.stl" for name in ("first", "second")]
        for model in models:
            model.write_bytes(stl(mesh_of(figure(faces))))
        for count in counts:
            print(on_benches(count, models), flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", action="append", default=[])
    parser.add_argument("--faces", action="append", default=[], type=int)
    parser.add_argument("--moves", type=int, default=20)
    parser.add_argument("--benches", nargs="+", default=[], type=int)
    options = parser.parse_args(arguments)
    if options.benches:
        measure_benches(options.benches, (options.faces or FACES)[-1])
        return
    print(f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}")
    with tempfile.TemporaryDirectory() as folder:
        models = list(options.model)
        for faces in options.faces or ([] if models else FACES):
            models.append(f"{folder}/figure-{faces}.stl")
            Path(models[-1]).write_bytes(stl(mesh_of(figure(faces))))
        for model in models:
            print(sentence(measure(model, options.moves)), flush=True)


if __name__ == "__main__":
    main()
