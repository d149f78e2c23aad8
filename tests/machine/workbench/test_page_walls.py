"""Walls of sliced parts on the page."""

from machine.workbench.web.server import OWN
from tests.machine.fake_page import needs_node, on_fake_page


@needs_node
def test_the_walls_of_parts_whose_contents_arrive_at_once_are_all_drawn() -> None:
    act = """
        const { store, update } = modules["page/store"], contents = [], later = () => new Promise((done) => setImmediate(done));
        const arrayBuffer = () => new Promise((done) => contents.push(() => done(new ArrayBuffer(12))));
        globalThis.fetch = async () => ({ ok: true, arrayBuffer });
        modules["slice/slices-panel"].wallsOf({ walls() {} });
        const state = { colours: ["#ff0000", "#00ff00"], sliced: { number: 3, ready: [1, 2] } };
        update({ tab: "slices", triangles: {}, state });
        await later();
        contents.forEach((arrive) => arrive());
        await later();
        return [...store.walls.keys()];"""
    assert on_fake_page(act, OWN / "slice" / "slices-panel.js") == [1, 2]
