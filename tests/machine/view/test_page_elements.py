"""Elements of the pages: measures as the page writes them."""

from machine.view.page import TEMPLATE
from tests.machine.fake_page import needs_node, on_fake_page


@needs_node
def test_the_page_writes_a_measure_with_at_most_three_digits_like_the_command_line() -> None:
    act = """const { mm2, threeDigits } = modules["template/elements"];
        return [[9.996, 20.66, 99.96, 1234.5, 0].map((x) => threeDigits(x)), [86.94, 1784.9, -1e-9].map(mm2)];"""
    measures, areas = on_fake_page(act, TEMPLATE / "elements.js")
    assert measures == ["10.0", "20.7", "100", "1230", "0.00"]
    assert areas == ["86.9 mm²", "1780 mm²", "0.0 mm²"]
