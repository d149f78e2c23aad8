"""Uploads of a page: one file after the other, each with its own progress and Cancel."""

from machine.workbench.web.server import OWN
from tests.machine.fake_page import needs_node, on_fake_page

REQUESTS = """
    const requests = [], settle = () => new Promise((done) => setImmediate(done));
    globalThis.XMLHttpRequest = class {
      constructor() { this.upload = {}; requests.push(this); }
      open() {}
      send(file) { this.file = file; this.upload.onprogress({ loaded: 1e6, total: 2e6 }); }
      abort() { this.aborted = true; this.upload.onloadend(); this.onloadend(); }
    };
    const { takeFiles } = modules["model/benches"], names = () => requests.map(({ file }) => file.name);
    const all = ["a.toml", "b.toml"].map((name) => takeFiles([{ name }]));
    await settle();
"""


@needs_node
def test_a_second_upload_waits_until_the_first_is_sent() -> None:
    act = f"""{REQUESTS} const before = [names(), $("sending-told").textContent];
        requests[0].upload.onloadend(); await settle(); return [before, names(), $("sending-told").textContent];"""
    before, names, progress = on_fake_page(act, OWN / "model" / "benches.js")
    assert before == [["a.toml"], "Sending a.toml: 1.0 of 2.0 MB"]
    assert (names, progress) == (["a.toml", "b.toml"], "Sending b.toml: 1.0 of 2.0 MB")


@needs_node
def test_cancel_ends_the_upload_that_is_shown_and_the_next_one_begins() -> None:
    act = f"""{REQUESTS} $("sending-cancel").onclick(); await all[0]; await settle();
        return [requests.map(({{ aborted = false }}) => aborted), $("sending-told").textContent, $("sending").hidden];"""
    assert on_fake_page(act, OWN / "model" / "benches.js") == [[True, False], "Sending b.toml: 1.0 of 2.0 MB", False]
