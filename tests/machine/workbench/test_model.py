"""A model: its mesh file holds what was read, is not sent through a pipe, and exists while the model is used; its pose."""

import asyncio
import gc
import pickle
import weakref
import zipfile
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import manifold3d as m3
import numpy as np
import pytest

from machine.pipeline.project import Project, project_bytes
from machine.pipeline.requests import Given
from machine.workbench.bench.bench import Bench, plan_of_bench, with_model, with_rotation
from machine.workbench.bench.model import Model
from machine.workbench.session.commands import obey
from machine.workbench.session.keeping import AFTER_S
from machine.workbench.session.session import Session
from machine.workbench.web.snapshot import snapshot
from machine.workbench.work import models as work
from machine.workbench.work.cutting import cut_bench, make_folder
from machine.workbench.work.models import Standing, read_model, stand
from machine.workbench.work.plate import Plated, put_on_plate
from machine.workbench.work.worker_pool import WorkerPools
from mdp.mesh import Mesh
from mdp.pose import turned_by
from mdp.save import stl
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.plan_reading import read_plan
from mdp.zone import MeshVolume, Modifier, Zone, Zones
from profiles.errors import MeshError, PlanError
from profiles.profile import load
from tests.machine.workbench.models import model
from tests.mdp.slicer_files import AT_ORIGIN, Made, Object, prusaslicer
from tests.shapes import ball, tee


@pytest.mark.parametrize("colours", [None, np.arange(28, dtype=np.int32)])
def test_a_mesh_comes_back_from_its_file_as_it_was(colours: Any) -> None:
    mesh = Mesh(tee().vertices / 3.0, tee().faces, colours)
    stored = model(mesh=mesh)
    again = stored.mesh()
    assert (again.vertices == mesh.vertices).all()
    assert (again.faces == mesh.faces).all()
    assert (again.colours is None) if colours is None else (again.colours == colours).all()
    assert (stored.faces, stored.size_mm) == (28, pytest.approx((40.0 / 3.0, 10.0 / 3.0, 40.0 / 3.0)))
    assert stored.volume_mm3 == pytest.approx(7000.0 / 27.0)


def test_a_pickled_model_is_as_short_for_many_faces_as_for_few() -> None:
    few, many = model("a", tee()), model("a", ball(10.0, 480))
    assert many.faces > 100_000
    assert len(pickle.dumps(many)) < len(pickle.dumps(few)) + 100 < 1000


def read(work: Any, path: Path) -> Any:
    """The result of `work` with a session in which a model has been opened, whose tasks run in this process."""

    async def run() -> Any:
        session = Session(load(), Given(), WorkerPools())

        async def here(task: Any, *given: Any, **more: Any) -> Any:
            return task(lambda report: None, *given) if task in (read_model, stand) else ()

        for queue in (session.quick, session.long, session.hand):
            queue.run = here  # type: ignore[method-assign]
        await session.open_model(path, path.name)
        await until_idle(session)
        return await work(session)

    return asyncio.run(run())


async def until_idle(session: Session) -> None:
    while session._tasks:
        await asyncio.gather(*session._tasks)


def the_model(session: Session) -> Model:
    assert session.bench.model is not None
    return session.bench.model


def test_a_closed_bench_leaves_no_model_and_no_file(tmp_path: Path) -> None:
    (tmp_path / "tee.stl").write_bytes(stl(tee()))

    async def close(session: Session) -> tuple[weakref.ref[Model], Path]:
        assert snapshot(session)["overhang_mm2"] == pytest.approx(300.0)
        left = weakref.ref(the_model(session)), session.received.path
        assert the_model(session).mesh_file.is_file()
        await session.close()
        return left

    left, folder = read(close, tmp_path / "tee.stl")
    gc.collect()
    assert left() is None
    assert not folder.exists()


def test_the_mesh_of_a_model_that_no_step_can_reach_is_deleted(tmp_path: Path) -> None:
    (tmp_path / "tee.stl").write_bytes(stl(tee()))

    async def forget(session: Session) -> tuple[bool, bool]:
        file = the_model(session).mesh_file
        obey(session, {"do": "undo"})
        await until_idle(session)
        gc.collect()
        undone = file.is_file()
        obey(session, {"do": "redo"})
        obey(session, {"do": "undo"})
        await until_idle(session)
        session.do("something else", replace(session.bench, copies=2))
        await until_idle(session)
        await asyncio.sleep(1.2 * AFTER_S)  # in this time the autosave has nothing left to write
        gc.collect()
        return undone, file.is_file()

    assert read(forget, tmp_path / "tee.stl") == (True, False)


def test_the_parts_folder_has_the_meshes_that_its_plan_names(tmp_path: Path) -> None:
    (tmp_path / "insert.stl").write_bytes(stl(ball(4.0, 16)))
    insert = Modifier(MeshVolume(tmp_path / "insert.stl", ball(4.0, 16)), {"walls": 4})
    bench = replace(with_model(Bench(load()), model(mesh=tee())), cuts=(), zones=Zones(modifiers=(insert,)))
    make_folder(lambda report: None, bench, tmp_path / "parts.zip")
    with zipfile.ZipFile(tmp_path / "parts.zip") as archive:
        archive.extractall(tmp_path / "parts")
    (read_back,) = read_plan(tmp_path / "parts" / "plan.toml").zones.modifiers
    assert isinstance(read_back.volume, MeshVolume)
    assert read_back.volume.file.parent == tmp_path / "parts"
    assert read_back.volume.file.read_bytes() == stl(ball(4.0, 16))


def project(path: Path, mesh: Mesh, given: Given, plan: PlanFile | None = None) -> Path:
    """A project file with its model beside it."""
    (path.parent / "own.stl").write_bytes(stl(mesh))
    made = Project("own.stl", path.parent / "own.stl", given, parts=1)
    path.write_bytes(project_bytes(made, [plan or PlanFile("own.stl")], mesh, b""))
    return path


def test_a_project_opens_over_any_bench_in_one_step(tmp_path: Path) -> None:
    (tmp_path / "large.stl").write_bytes(stl(Mesh(tee().vertices * 10.0, tee().faces)))  # 400 mm, 10 m at the project's scale
    path = project(tmp_path / "p.3mf", Mesh(tee().vertices / 25.4, tee().faces), Given(settings=("process.scale=25.4",)))

    async def work(session: Session) -> Any:
        await session.open_project(path, "p.3mf")
        return the_model(session).size_mm, [step.word for step in session.history.before]

    size_mm, before = read(work, tmp_path / "large.stl")
    assert size_mm == pytest.approx((40.0, 10.0, 40.0), abs=1e-4)
    assert before == ["", "open large.stl"]


def test_a_project_with_a_damaged_plan_leaves_the_bench_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "tee.stl").write_bytes(stl(tee()))
    wrong = PlanFile("own.stl", zones=Zones(support=(Zone((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),)))
    path = project(tmp_path / "p.3mf", tee(), Given(settings=("process.walls=5",)), wrong)

    async def work(session: Session) -> Any:
        before = session.bench
        with pytest.raises(PlanError, match="support 1: min_mm is"):
            await session.open_project(path, "p.3mf")
        return session.bench is before

    assert read(work, tmp_path / "tee.stl")


def test_marks_of_a_slicer_file_are_on_the_bench_boxes_and_other_shapes(tmp_path: Path) -> None:
    block, ball = m3.Manifold.cube((20.0, 20.0, 20.0), True), m3.Manifold.sphere(4.0, 16)
    insert = Made(m3.Manifold.cube((4.0, 6.0, 8.0), True), "modifier", {"perimeters": "4"})
    path = prusaslicer(
        tmp_path / "a.3mf", [Object([Made(block), insert, Made(ball.translate((1.0, 0.0, 0.0)), "support")], [AT_ORIGIN])]
    )

    async def work(session: Session) -> Any:
        bench = with_rotation(session.bench, [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        return session.bench, cut_bench(bench, plan_of_bench(bench, "plan.toml")).parts[0].support.volumes

    bench, (held,) = read(work, path)
    assert bench.zones == Zones(modifiers=(Modifier(Zone((-2.0, -3.0, 6.0), (2.0, 3.0, 14.0)), {"walls": 4}),))
    assert isinstance(held, MeshVolume)
    assert held.mesh.bounds_mm == pytest.approx(np.array([[-4.0, -3.0, 6.0], [4.0, 5.0, 14.0]]), abs=0.1)


def standing(mesh: Mesh, turns_deg: tuple[float, float, float] = (0.0, 0.0, 0.0), **settings: Any) -> Standing:
    profile = load(settings=[f"{key.replace('__', '.')}={value}" for key, value in settings.items()])
    bench = replace(with_model(Bench(profile), model(mesh=mesh)), rotation=turned_by(turns_deg).tolist())
    return stand(lambda report: None, bench)


def plated(bench: Bench) -> Plated:
    """The plate of a bench; the folder of its files is removed afterwards."""
    with TemporaryDirectory() as folder:
        return put_on_plate(lambda report: None, bench, Path(folder) / "drawn")


# A tee is 10 mm thick: its bar of 40 mm extends beyond its stem by 15 mm at each side; along its thickness its area is 700 mm2.
@pytest.mark.parametrize(("turns_deg", "overhang_mm2", "size_mm"), [
    ((0.0, 0.0, 0.0), 300.0, (40.0, 10.0, 40.0)),
    ((180.0, 0.0, 0.0), 0.0, (40.0, 10.0, 40.0)),
    ((90.0, 0.0, 0.0), 0.0, (40.0, 40.0, 10.0)),
    ((0.0, 90.0, 0.0), 300.0, (40.0, 10.0, 40.0)),
    ((0.0, 37.0, 0.0), 300.0 + 100.0, None),
    ((90.0, 37.0, 11.0), 700.0, None),
])  # fmt: skip
def test_overhangs_are_faces_seen_from_below_that_are_not_on_the_build_plate(
    turns_deg: tuple[float, float, float], overhang_mm2: float, size_mm: tuple[float, float, float] | None
) -> None:
    stood = standing(tee(), turns_deg)
    assert stood.overhang_mm2 == pytest.approx(overhang_mm2)
    assert stood.size_mm == pytest.approx(size_mm or stood.size_mm)
    assert (stood.problem, stood.pedestal, stood.refusal) == ("", b"", "")


def test_a_model_beyond_the_reach_of_the_machine_is_reported_as_by_export() -> None:
    assert standing(tee(height=300.0)).problem.startswith("part 1 reaches Z 300.0 mm at A0.0 C0.0, Z goes from ")


def test_copies_have_places_also_in_parts_and_a_lack_of_room_is_reported_as_by_export() -> None:
    bench = replace(with_model(Bench(load(settings=["process.place_mm=[10, 5]"])), model(mesh=tee())), copies=3)
    stood = plated(bench)
    assert (len(stood.copies_mm), stood.copies_mm[0], stood.problem) == (3, (0.0, 0.0), "")
    crowd = plated(replace(bench, copies=500))
    assert crowd.problem.startswith("500 copies: ")
    assert (len(crowd.copies_mm), crowd.copies_mm[0]) == (500, (0.0, 0.0))
    assert min(x for x, _ in crowd.copies_mm[1:]) + 10.0 > bench.profile.machine.table.radius_mm + 20.0  # beside the plate
    cut = replace(bench, cuts=(PlannedPart((0.0, 0.0, 1.0), 20.0),))
    apart = plated(cut)
    assert (len(apart.copies_mm), apart.problem) == (3, "")


def test_models_that_cannot_be_put_on_a_pedestal_have_places_and_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(mesh: Mesh, height_mm: float) -> Mesh:
        raise MeshError("no feet")

    monkeypatch.setattr("machine.workbench.work.plate.cut_bench", refuse)
    bench = replace(with_model(Bench(load()), model(mesh=tee())), copies=2, cuts=(PlannedPart((0.0, 0.0, 1.0), 20.0),))
    stood = plated(bench)
    assert (len(stood.copies_mm), stood.problem) == (2, "no feet")


def test_a_model_stands_on_a_pedestal_whose_triangles_have_its_height() -> None:
    stood = standing(tee(), search__pedestal_mm=10)
    points, faces = np.frombuffer(stood.pedestal, "<u4", 2)
    places = np.frombuffer(stood.pedestal, "<f8", 3 * points, 8).reshape(-1, 3)
    assert len(stood.pedestal) == 8 + 24 * points + 12 * faces
    assert np.ptp(places, axis=0) == pytest.approx((14.0, 14.0, 10.3), abs=0.01)  # feet + 2 mm; height with its sunk part
    assert (stood.overhang_mm2, stood.size_mm[2]) == (pytest.approx(300.0), pytest.approx(40.0))


def test_a_model_that_cannot_be_put_on_a_pedestal_is_shown_without_one_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(mesh: Mesh, height_mm: float) -> Mesh:
        raise MeshError("no feet")

    monkeypatch.setattr(work, "pedestal_under", refuse)
    stood = standing(tee(), search__pedestal_mm=10)
    assert (stood.pedestal, stood.refusal, stood.overhang_mm2) == (b"", "no feet", pytest.approx(300.0))
