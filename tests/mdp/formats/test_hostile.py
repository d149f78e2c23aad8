"""Small files that would hang, exhaust memory or crash a reader are refused with a message; merely odd files are read."""

import json
import struct
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

from mdp.formats import threemf
from mdp.formats.surface import MOST_PLACED_MESHES
from mdp.read import MOST_BYTES, read_mesh
from tests.mdp import files
from tests.mdp.files import refusal, save

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def glb_of(document: bytes) -> bytes:
    document += b" " * (-len(document) % 4)
    return struct.pack("<IIIII", 0x46546C67, 2, 20 + len(document), len(document), 0x4E4F534A) + document


def test_a_few_hundred_bytes_place_no_thousands_of_meshes(tmp_path: Path) -> None:
    doubled = {k: f'<components>{2 * f"""<component objectid="{k - 1}"/>"""}</components>' for k in range(2, 14)}
    objects = {1: files.threemf_mesh(files.placed(5, 5, 5)), **doubled}
    sentence = refusal(files.threemf(tmp_path / "a.3mf", objects, '<item objectid="13"/>'))
    assert 2**12 > MOST_PLACED_MESHES == 2000
    assert sentence == "places more than 2000 meshes or 20000000 faces by reference"


def test_a_package_of_nothing_but_elements_is_refused_before_it_is_parsed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(threemf, "MOST_ELEMENTS", 1000)
    objects = {1: files.threemf_mesh(files.placed(5, 5, 5))}
    path = files.threemf(tmp_path / "a.3mf", objects, '<item objectid="1"/>' + "<a/>" * 1000)
    with zipfile.ZipFile(path) as archive:
        name = next(name for name in archive.namelist() if name.endswith(".model"))
    assert refusal(path) == f"its part {name} has more than 1000 elements or too many attributes"


def test_a_large_file_of_zeros_is_not_read_through(tmp_path: Path) -> None:
    for name, size, sentence in (
        ("a.stl", MOST_BYTES // 2, "holds no faces"),
        ("b.stl", MOST_BYTES + 1, "has 1073741825 bytes, at most 1073741824 are read: a model of fewer faces is needed"),
    ):
        with (tmp_path / name).open("wb") as file:
            file.truncate(size)
        assert refusal(tmp_path / name) == sentence


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.glb", glb_of(b"[" * 100_000), "is damaged: its glTF document is nested too deep"),
        ("a.glb", glb_of(json.dumps({"nodes": [{"matrix": [10**400] * 16}]}).encode()), "matrix of a node is [1000"),
        (
            "a.glb",
            glb_of(b'{"nodes": [{"mesh": ' + b"9" * 5000 + b"}]}"),
            "its glTF document holds text or a number that cannot be read",
        ),
        ("a.obj", (TRIANGLE + f"f 1 2 {'3' * 40}\n").encode(), "the face in line 4 names a vertex that does not exist"),
        ("a.obj", (TRIANGLE + f"f 1 2 {'3' * 5000}\n").encode(), "the face in line 4 is malformed"),
        ("a.obj", b"v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "has a coordinate that is not a finite number"),
        ("a.off", f"OFF\n{'9' * 5000} 4 0\n0 0 0\n".encode(), "the line of counts holds something that is not a whole number"),
        ("a.off", f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{'9' * 5000} 0 1 2\n".encode(), "the face in line 6 is malformed"),
        ("a.ply", f"ply\nformat ascii 1.0\nelement vertex {'9' * 5000}\nend_header\n".encode(), "is not understood"),
    ],
)
def test_numbers_and_nesting_without_end_are_a_sentence(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    assert words in refusal(save(tmp_path / name, content))


def test_a_face_of_six_hundred_concave_corners_is_read(tmp_path: Path) -> None:
    around = 2 * np.pi * np.arange(600) / 600
    star = np.where(np.arange(600) % 2, 20.0, 12.0)[:, None] * np.column_stack([np.cos(around), np.sin(around)])
    lines = [f"v {x:.9f} {y:.9f} {z}" for z in (0, 10) for x, y in star]
    lines += ["f " + " ".join(str(600 - k) for k in range(600)), "f " + " ".join(str(601 + k) for k in range(600))]
    lines += [f"f {k + 1} {(k + 1) % 600 + 1} {(k + 1) % 600 + 601} {k + 601}" for k in range(600)]
    mesh, notes = read_mesh(save(tmp_path / "a.obj", "\n".join(lines).encode()))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(600 * 0.5 * 20 * 12 * np.sin(2 * np.pi / 600) * 10)


@pytest.mark.parametrize("number", ["1e999", "nan", "1e308", "-1e308"])
def test_numbers_that_overflow_end_in_a_sentence_without_warnings_before_it(tmp_path: Path, number: str) -> None:
    box = files.placed(20, 20, 20)
    turned = f'<item objectid="1" transform="{number} 0 0 0 1 0 0 0 1 0 0 0"/>'
    paths = [
        save(tmp_path / "a.obj", files.obj(box).replace(b"20.0", number.encode(), 1)),
        save(tmp_path / "a.glb", files.glb(box, {"scale": [float(number), 1.0, 1.0]})),
        files.threemf(tmp_path / "a.3mf", {1: files.threemf_mesh(box)}, turned, "meter"),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for path in paths:
            assert "finite" in refusal(path) or "no common unit" in refusal(path)
