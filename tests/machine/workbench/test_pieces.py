"""The block with the separated parts that the page reads."""

from machine.workbench.work.cutting import pieces_block
from mdp.search.search import SearchRequest, decompose
from profiles.profile import load
from tests.machine.pages import unpacked
from tests.shapes import box


def test_parts_beyond_the_reach_of_the_machine_are_reported_in_page_words() -> None:
    slab = decompose(box(900.0), "slab", load(), SearchRequest(parts=1))
    header, _ = unpacked(pieces_block(slab, load()))
    assert "Scale of the model makes the model smaller" in header["fit"]
