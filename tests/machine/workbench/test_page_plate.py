"""The list of the models on the plate: a row for each, even if a file is there twice."""

from machine.workbench.web.server import OWN
from tests.machine.fake_page import needs_node, on_fake_page


@needs_node
def test_a_file_that_is_on_the_plate_twice_has_two_rows() -> None:
    same = '{ name: "tee.stl", copies: 1, size_mm: [40, 10, 40] }'
    act = f"""
        modules["model/benches"].platePanel();
        modules["page/store"].update({{ state: {{ addable: "", model: {same}, copies: 1, beside: [{same}], problem: "" }} }});
        return $("plate-list").children.map((row) => row.dataset.id);"""
    assert on_fake_page(act, OWN / "model" / "benches.js") == ["0 tee.stl", "1 tee.stl"]
