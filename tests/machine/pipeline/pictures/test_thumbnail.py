"""Pictures in the head of a G-code file: where they stand, and that what is read back is a picture of that size."""

import struct
from base64 import b64decode
from itertools import pairwise

from machine.gcode.lines import Lines
from machine.gcode.reader.parse import parse_gcode
from machine.pipeline.pictures.png import thumbnail, with_thumbnails
from profiles.profile import load
from tests.machine.hand import printed, text


def test_the_pictures_asked_for_stand_after_the_first_comments_and_are_png_of_that_size() -> None:
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


def test_the_length_told_is_that_of_the_base64_and_no_line_is_longer_than_80() -> None:
    lines = thumbnail(bytes(range(256)) * 3, 16, 16)
    assert lines[0] == "; thumbnail begin 16x16 1024"
    assert sum(len(line) - 2 for line in lines[1:-1]) == 1024
    assert {len(a) for a, _ in pairwise(lines[1:-1])} == {80}


def test_without_a_wish_there_is_no_picture() -> None:
    profile, decomposition, _, _ = printed("generic_ac")
    assert with_thumbnails(Lines.of(text("generic_ac")), decomposition, profile) == tuple(text("generic_ac"))
