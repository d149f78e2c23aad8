"""What is written as TOML is read back as it was."""

import tomllib

from hypothesis import given
from hypothesis import strategies as st

from profiles.toml import toml

LETTERS = st.characters(exclude_categories=["Cs"])
SCALARS = st.booleans() | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False) | st.text(LETTERS)
VALUES = SCALARS | st.lists(SCALARS, max_size=3)
KEYS = st.text(LETTERS, max_size=8)
TABLES = st.recursive(
    st.dictionaries(KEYS, VALUES, max_size=3),
    lambda inner: st.dictionaries(KEYS, VALUES | inner | st.lists(inner, min_size=1, max_size=2), max_size=3),
    max_leaves=6,
)


@given(TABLES)
def test_what_is_written_is_read_back(document: dict[str, object]) -> None:
    assert tomllib.loads(toml(document)) == document


def test_a_profile_reads_like_one_written_by_hand() -> None:
    text = toml({"inherits": "gen5x", "machine": {"name": "mine", "tilt": {"sign": 1, "point_mm": [0.0, 1.5, -3.25]}}})
    assert text == 'inherits = "gen5x"\n\n[machine]\nname = "mine"\n\n[machine.tilt]\nsign = 1\npoint_mm = [0.0, 1.5, -3.25]\n'
