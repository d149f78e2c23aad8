"""Page: the workbench's one HTML file, its scripts those that the view has and its own; it loads nothing from anywhere."""

import re
from collections.abc import Iterable
from pathlib import Path

from machine.view.page import TEMPLATE, bundle, hash_source

OWN = Path(__file__).parent / "page"
MARKER = re.compile(r"/\*(?:STYLE|SCRIPT|NETWORK)\*/")


def workbench_page(lines: Iterable[str], network: str = "") -> tuple[bytes, str]:
    """The page and its content security policy. lines: origins of websockets of the server, to which alone the page may talk;
    network: "open" for this computer's own page where others are let in, "paired" for that of a device that is."""
    style, script = "".join((folder / "style.css").read_text("utf-8") for folder in (TEMPLATE, OWN)), bundle(OWN / "main.js")
    put = {"/*STYLE*/": style, "/*SCRIPT*/": script, "/*NETWORK*/": network}
    body = MARKER.sub(lambda match: put[match[0]], (OWN / "page.html").read_text("utf-8"))
    return body.encode(), policy(style, script, lines)


def policy(style: str, script: str, lines: Iterable[str]) -> str:
    """What the page may do: its own script and style, pictures that it has made itself, and talk to its server."""
    server = " ".join(("'self'", *lines))
    own = f"script-src {hash_source(script)}; style-src {hash_source(style)}; connect-src {server}"
    rest = "frame-src 'self'; img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    return f"default-src 'none'; {own}; {rest}"
