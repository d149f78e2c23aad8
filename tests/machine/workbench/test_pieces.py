"""The block with the separated parts that the page reads."""

from machine.workbench.work.cutting import pieces_block
from mdp.search.search import SearchRequest, decompose
from profiles.profile import load
from tests.machine.pages import unpacked
from tests.shapes import box


def test_what_the_machine_does_not_reach_is_told_in_the_words_of_the_page() -> None:
    slab = decompose(box(900.0), "slab", load(), SearchRequest(parts=1))
    header, _ = unpacked(pieces_block(slab, load()))
    assert "Scale of the model makes the model smaller" in header["fit"]
