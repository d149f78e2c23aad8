"""Page: the workbench's one HTML file, its scripts those that the view has and its own; it loads nothing from anywhere."""

import re
from pathlib import Path

from machine.view.bundle import bundle, hash_source
from machine.view.page import TEMPLATE

OWN = Path(__file__).parent / "page"
MARKER = re.compile(r"/\*(?:STYLE|SCRIPT)\*/")


def workbench_page(port: int) -> tuple[bytes, str]:
    """The page and its content security policy. port: of the server, to which alone the page may talk."""
    style, script = "".join((folder / "style.css").read_text("utf-8") for folder in (TEMPLATE, OWN)), bundle(OWN / "main.js")
    put = {"/*STYLE*/": style, "/*SCRIPT*/": script}
    body = MARKER.sub(lambda match: put[match[0]], (OWN / "page.html").read_text("utf-8"))
    return body.encode(), policy(style, script, port)


def policy(style: str, script: str, port: int) -> str:
    """What the page may do: its own script and style, pictures that it has made itself, and talk to its server."""
    line = " ".join(f"ws://{name}:{port}" for name in ("127.0.0.1", "localhost"))
    own = f"script-src {hash_source(script)}; style-src {hash_source(style)}; connect-src 'self' {line}"
    rest = "frame-src 'self'; img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    return f"default-src 'none'; {own}; {rest}"
