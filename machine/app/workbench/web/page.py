"""Page: the workbench's one HTML file, its scripts those that the view has and its own; it loads nothing from anywhere."""

import base64
import re
from hashlib import sha256
from importlib import resources

# What is taken over from machine/view/template: the scene, not the print.
SHARED = (
    "10-math.js", "12-block.js", "15-chain.js", "20-rows.js", "30-gl.js", "34-lines.js", "38-solids.js", "40-model.js",
    "42-bodies.js", "44-camera.js", "50-colours.js", "61-frames.js", "70-page.js", "71-tabs.js",
)  # fmt: skip
MARKER = re.compile(r"/\*(?:STYLE|SCRIPT)\*/")


def workbench_page(port: int) -> tuple[bytes, str]:
    """The page and its content security policy. port: of the server, to which alone the page may talk."""
    view, own = (
        resources.files("machine.view").joinpath("template"),
        resources.files("machine.app.workbench.web").joinpath("page"),
    )
    names = sorted(file.name for file in own.iterdir() if file.name.endswith(".js"))
    texts = [
        *(view.joinpath(name).read_text("utf-8") for name in SHARED),
        *(own.joinpath(name).read_text("utf-8") for name in names),
    ]
    script = "\n".join(texts)
    style = view.joinpath("style.css").read_text("utf-8") + own.joinpath("style.css").read_text("utf-8")
    put = {"/*STYLE*/": style, "/*SCRIPT*/": script}
    body = MARKER.sub(lambda match: put[match[0]], own.joinpath("page.html").read_text("utf-8"))
    return body.encode(), policy(style, script, port)


def policy(style: str, script: str, port: int) -> str:
    """What the page may do: its own script and style, pictures that it has made itself, and talk to its server."""
    line = " ".join(f"ws://{name}:{port}" for name in ("127.0.0.1", "localhost"))
    rest = "frame-src 'self'; img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    return f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; connect-src 'self' {line}; {rest}"


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(sha256(text.encode()).digest()).decode()
