"""The player of a print's page: how often it requests the next picture."""

from machine.view.page import TEMPLATE
from tests.machine.fake_page import needs_node, on_fake_page

PLAYER = """
    let frames = 0;
    globalThis.requestAnimationFrame = () => { frames++; };
    $("strip").style = {};
    const { courseOf } = modules["panel/sliders"], { bells } = modules["template/elements"];
    const print = { rows: { count: 2, time: [0, 60000] }, header: { parts: [] } };
    const player = courseOf(print, { row: 0, time: () => 0, goToTime() {} }, bells());
"""


@needs_node
def test_a_player_that_stops_asks_for_no_further_picture() -> None:
    act = f"{PLAYER} player.toggle(); const playing = frames; player.toggle(); player.toggle(); return [playing, frames];"
    assert on_fake_page(act, TEMPLATE / "panel" / "sliders.js") == [1, 1]
