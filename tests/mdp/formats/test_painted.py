"""Triangles that are painted in part."""

import numpy as np
import pytest

from mdp.formats.slicer_file import painted_shares
from mdp.mesh import Floats


def area(corners: Floats) -> float:
    (a, b), (c, d) = corners[1] - corners[0], corners[2] - corners[0]
    return 0.5 * abs(a * d - b * c)


def drawn(rng: np.random.Generator, corners: Floats, depth: int, areas: dict[int, float]) -> str:
    """The digits of a triangle that is halved at random, the first to be read first; areas: by paint, to which it adds."""
    sides = int(rng.integers(4)) if depth else 0
    if not sides:
        paint = int(rng.integers(7))
        areas[paint] = areas.get(paint, 0.0) + area(corners)
        return f"{paint * 4:X}" if paint < 3 else f"C{paint - 3:X}"
    side = int(rng.integers(3)) if sides < 3 else 0
    a, b, c = np.roll(corners, -side, axis=0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    children = {
        1: [(a, b, bc), (bc, c, a)],
        2: [(a, ab, ca), (ab, b, ca), (b, c, ca)],
        3: [(a, ab, ca), (ab, b, bc), (bc, c, ca), (ab, bc, ca)],
    }[sides]
    return f"{4 * side + sides:X}" + "".join(drawn(rng, np.array(child), depth - 1, areas) for child in reversed(children))


@pytest.mark.parametrize("seed", range(20))
def test_shares_are_those_of_the_triangles_that_a_brush_has_made(seed: int) -> None:
    rng, areas = np.random.default_rng(seed), dict[int, float]()
    corners = rng.normal(size=(3, 2))
    shares = painted_shares(drawn(rng, corners, 4, areas)[::-1])
    assert shares == pytest.approx({paint: own / area(corners) for paint, own in areas.items()})
    assert sum(shares.values()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("digits", "shares"),
    [
        ("4", {1: 1.0}),
        ("8", {2: 1.0}),
        ("2C", {5: 1.0}),  # 3 more than the digit before
        ("041", {1: 0.5, 0: 0.5}),  # one side halved: the second half is painted
        ("0842", {1: 0.5, 2: 0.25, 0: 0.25}),  # two sides halved: the last of the three is half of it
        ("44", "1 of the digits belong to nothing"),
        ("41", "digits are missing"),
        ("C", "digits are missing"),
        ("4G", "invalid literal"),
    ],
)
def test_digits_are_read_from_the_last(digits: str, shares: dict[int, float] | str) -> None:
    if isinstance(shares, str):
        with pytest.raises(ValueError, match=shares):
            painted_shares(digits)
    else:
        assert painted_shares(digits) == shares
