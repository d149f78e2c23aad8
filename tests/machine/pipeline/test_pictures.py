"""Pictures: PNG bytes, pixels against geometry, and the contents of the two sheets."""

import struct
from base64 import b64decode
from dataclasses import replace
from functools import cache
from io import BytesIO
from itertools import pairwise
from math import cos, pi, radians, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image as Pillow

from machine.gcode.lines import Lines
from machine.gcode.reader.parse import parse_gcode
from machine.pipeline.pictures import (
    BORDER,
    contact_sheet,
    front_picture,
    parts_picture,
    png_bytes,
    thumbnail,
    with_thumbnails,
    write_png,
)
from machine.pipeline.raster import corner_normals, draw, seen_from, z_buffer
from machine.view.parts import part_colours
from mdp.decomposition import Decomposition, FrontRow
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan, decompose
from profiles.errors import OutputError
from profiles.profile import load
from tests.machine.hand import printed, text
from tests.shapes import ball, box, branch

PROFILE = load()
FRONT = seen_from(-90.0, 0.0)


@cache
def example() -> Decomposition:
    return decompose(branch(70.0), "branch", PROFILE)


def decoded(content: bytes) -> NDArray[np.uint8]:
    """The pixels of a PNG file, which must be lossless RGB."""
    with Pillow.open(BytesIO(content)) as picture:
        assert (picture.format, picture.mode) == ("PNG", "RGB")
        return np.asarray(picture)


def share_like(image: NDArray[np.uint8], hue: NDArray[np.float64]) -> float:
    """Share of pixels with the hue of a colour, in any light."""
    pixels = image.reshape(-1, 3).astype(float)
    chroma, wanted = pixels - pixels.mean(axis=1, keepdims=True), hue - hue.mean()
    lengths = np.linalg.norm(chroma, axis=1)
    return float(((chroma @ wanted > 0.985 * lengths * np.linalg.norm(wanted)) & (lengths > 25)).mean())


RED = np.array([214.0, 39.0, 40.0])


def test_a_png_decodes_to_the_image_it_was_made_of() -> None:
    image = np.random.default_rng(1).integers(0, 256, (7, 5, 3), dtype=np.uint8)
    assert np.array_equal(decoded(png_bytes(image)), image)


def test_a_picture_that_cannot_be_written_leaves_nothing_and_says_where(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="missing"):
        write_png(tmp_path / "missing" / "a.png", np.zeros((2, 2, 3), dtype=np.uint8))
    assert list(tmp_path.iterdir()) == []


def test_a_box_seen_from_the_front_covers_its_share_of_the_picture() -> None:
    image = draw([box(20, 20, 10)], [(120, 120, 120)], axes=FRONT, size=(200, 200), span_mm=40.0)
    assert (image < 250).any(axis=2).mean() == pytest.approx(20 * 10 / 40**2, rel=0.03)


def test_a_ball_covers_the_area_of_its_disc() -> None:
    image = draw([ball(10.0, 96)], [(120, 120, 120)], axes=FRONT, size=(200, 200), span_mm=25.0)
    assert (image < 250).any(axis=2).mean() == pytest.approx(pi * 10**2 / 25**2, rel=0.03)


def test_the_nearer_mesh_hides_the_farther_one() -> None:
    near, far = box(10).transform(np.eye(3), (0, -30, 0)), box(10).transform(np.eye(3), (0, 30, 0))
    image = draw([near, far], [(0, 200, 0), (200, 0, 0)], axes=FRONT, size=(80, 80))
    assert image[40, 40, 1] > 2 * image[40, 40, 0]


def test_red_faces_are_red_and_the_others_are_not() -> None:
    mesh = box(10, 10, 10)
    image = draw([mesh], [(200, 200, 200)], reds=[mesh.normals[:, 1] < -0.5], axes=FRONT, size=(80, 80), span_mm=20.0)
    assert share_like(image, RED) == pytest.approx(0.25, rel=0.12)
    behind = draw([mesh], [(200, 200, 200)], reds=[mesh.normals[:, 1] > 0.5], axes=FRONT, size=(80, 80), span_mm=20.0)
    assert share_like(behind, RED) == 0.0


def test_normals_are_smooth_on_a_ball_and_separate_at_the_edges_of_a_box() -> None:
    sphere, cube = ball(10.0, 64), box()
    radial = (sphere.vertices - (0, 0, 10))[sphere.faces] / 10.0
    assert np.einsum("ijk,ijk->ij", corner_normals(sphere), radial).min() > 0.999
    assert np.allclose(corner_normals(cube), cube.normals[:, None, :])


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_every_pixel_shows_the_nearest_triangle_over_its_centre(seed: int) -> None:
    random = np.random.default_rng(seed)
    screen = np.concatenate([random.uniform(-2, 14, (12, 3, 2)), random.uniform(0, 1, (12, 3, 1))], axis=2)
    depth, _ = z_buffer(screen, 12, 12)
    row, column = random.integers(0, 12, 2)
    centre, seen = np.array([column + 0.5, row + 0.5]), [-np.inf]
    for corners in screen:
        weights = np.linalg.solve(np.vstack([corners[:, :2].T, np.ones(3)]), [*centre, 1.0])
        (x0, y0), (x1, y1), (x2, y2) = corners[:, :2]
        if (weights >= 0).all() and (x1 - x0) * (y2 - y0) < (x2 - x0) * (y1 - y0):
            seen.append(float(weights @ corners[:, 2]))
    assert depth[row, column] == pytest.approx(max(seen))


def test_a_camera_on_plus_x_sees_plus_y_to_the_right_and_z_up() -> None:
    assert np.allclose(seen_from(0.0, 0.0), [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    assert np.allclose(seen_from(0.0, 30.0)[2], [cos(radians(30)), 0, sin(radians(30))])


def test_the_parts_picture_shows_the_model_red_and_the_parts_in_their_colours() -> None:
    image = parts_picture(example(), PROFILE, (400, 200))
    left, right = image[:, :200], image[:, 200:]
    assert image.shape == (200, 400, 3)
    assert share_like(left, RED) > 10 * share_like(right, RED)
    for colour in part_colours(len(example().parts)):
        assert share_like(right, colour) > 0.003


def test_the_contact_sheet_has_a_frame_for_every_part_with_that_part_in_colour() -> None:
    parts = len(example().parts)
    sheet = contact_sheet(example(), PROFILE.machine, 160)[160 // 12 :]
    assert sheet.shape[0] * sheet.shape[1] >= parts * 160**2
    assert share_like(sheet[:160, :160], part_colours(2)[0]) > 0.01
    assert share_like(sheet[:160, :160], part_colours(2)[1]) == 0.0


def ink(image: NDArray[np.uint8]) -> int:
    """Pixels that are grey and as dark as letters."""
    return int(((image.max(axis=2) < 200) & (np.ptp(image.astype(int), axis=2) == 0)).sum())


def test_a_frame_shows_its_number_and_the_table_s_pose() -> None:
    frames = contact_sheet(example(), PROFILE.machine, 480)[480 // 12 :]
    numbers = [frames[:60, left : left + 60] for left in (0, 480)]
    assert all(100 < ink(number) < 1000 for number in numbers)
    assert not np.array_equal(*numbers)
    still = contact_sheet(example(), load(machine="three_axis").machine, 480)[480 // 12 :]
    poses, none = (image[420:480, :120] for image in (frames, still))
    assert ink(poses) > 300 + ink(none)


def test_the_sheet_is_headed_by_the_model_s_name() -> None:
    tee, arm = (contact_sheet(replace(example(), name=name), PROFILE.machine, 160) for name in ("tee.stl", "arm.stl"))
    assert not np.array_equal(tee[: 160 // 12], arm[: 160 // 12])
    assert np.array_equal(tee[160 // 12 :], arm[160 // 12 :])


def test_the_same_scene_gives_the_same_bytes() -> None:
    first, second = (png_bytes(parts_picture(example(), PROFILE, (160, 80))) for _ in range(2))
    assert first == second


def test_colours_of_parts_differ_and_stay_inside_the_range() -> None:
    colours = part_colours(18)
    assert len(np.unique(colours.round(), axis=0)) == 18
    assert 0.0 <= colours.min() <= colours.max() <= 255.0


PIXELS, TITLE = 240, 20
ARM = PlannedPart((1.0, 0.0, 0.0), 10.0)


def test_every_row_has_a_frame_with_its_parts_in_colour_and_the_one_taken_a_border() -> None:
    tree = cut_by_plan(branch(70.0), "branch", PROFILE, SearchRequest(plan=PlanFile("", parts=(ARM,))))
    rows = (FrontRow((), 100.0, 0.0, 100.0), replace(tree.front[-1], chosen=True))
    sheet = front_picture(replace(tree, front=rows), PROFILE, PIXELS)
    assert sheet.shape == (PIXELS + TITLE, 2 * PIXELS, 3)
    whole, parts = sheet[TITLE:, :PIXELS], sheet[TITLE:, PIXELS:]
    second = part_colours(2)[1]
    assert (share_like(whole, second), share_like(parts, second) > 0.01) == (0.0, True)
    assert np.array_equal(parts[0], np.full((PIXELS, 3), BORDER))
    assert (whole[0] == 255).all()


def test_requested_thumbnails_follow_the_first_comments_and_are_png_of_the_given_size() -> None:
    profile, decomposition, _, _ = printed("generic_ac")
    asked = load(settings=["machine.thumbnails_px=[[32, 24], [160, 120]]"])
    lines = with_thumbnails(Lines.of(text("generic_ac")), decomposition, asked)
    begins = [k for k, line in enumerate(lines) if line.startswith("; thumbnail begin")]
    ends = [k for k, line in enumerate(lines) if line == "; thumbnail end"]
    pngs = [b64decode("".join(line[2:] for line in lines[a + 1 : b])) for a, b in zip(begins, ends, strict=True)]
    assert [struct.unpack(">II", png[16:24]) for png in pngs] == [(32, 24), (160, 120)]
    assert all(line.startswith("; ") for line in lines[: ends[-1] + 1])
    assert lines[ends[-1] + 1] == next(line for line in text("generic_ac") if not line.startswith("; "))
    assert len(parse_gcode(lines, profile.machine).line) == len(parse_gcode(text("generic_ac"), profile.machine).line)


def test_the_thumbnail_length_is_that_of_its_base64_and_lines_are_at_most_80_characters() -> None:
    lines = thumbnail(bytes(range(256)) * 3, 16, 16)
    assert lines[0] == "; thumbnail begin 16x16 1024"
    assert sum(len(line) - 2 for line in lines[1:-1]) == 1024
    assert {len(a) for a, _ in pairwise(lines[1:-1])} == {80}


def test_no_thumbnail_is_written_unless_requested() -> None:
    profile, decomposition, _, _ = printed("generic_ac")
    assert with_thumbnails(Lines.of(text("generic_ac")), decomposition, profile) == tuple(text("generic_ac"))
