"""Content that the page fetches by a key, as the marks on a model: the latest answer counts, a missing one is requested again."""

from machine.workbench.web.server import OWN
from tests.machine.fake_page import needs_node, on_fake_page

# Requests wait in `asked` until the test answers them.
FETCHED = """
    const asked = [], taken = [], later = () => new Promise((done) => setImmediate(done));
    const answerOf = (address, status) => ({ status, text: async () => address });
    globalThis.fetch = (address) => new Promise((answer) => asked.push((status) => answer(answerOf(address, status))));
    const read = (answer) => answer.text(), take = (text) => taken.push(text);
    const fetchMarks = modules["page/line"].newest({ read, take, insists: true });
    const answered = async (number, status) => { asked[number](status); await later(); };
"""


@needs_node
def test_an_empty_answer_that_was_overtaken_by_the_content_of_its_key_does_not_remove_it() -> None:
    act = f"""{FETCHED}
        for (const key of ["marks/a", "marks/b", "marks/a"]) fetchMarks(key, key);
        await answered(2, 200);
        await answered(0, 204);
        await answered(1, 204);
        return taken;"""
    assert on_fake_page(act, OWN / "line.js") == ["marks/a"]


@needs_node
def test_content_that_did_not_come_is_asked_for_again_although_nothing_changes() -> None:
    act = f"""{FETCHED}
        fetchMarks("marks/a", "marks/a");
        await answered(0, 204);
        fake.wait(1000);
        await answered(1, 200);
        fake.wait(5000);
        return [asked.length, taken];"""
    assert on_fake_page(act, OWN / "line.js") == [2, [None, "marks/a"]]
