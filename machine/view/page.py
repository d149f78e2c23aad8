"""Page: the template, its scripts and a packed block put together into one HTML file that fetches nothing."""

import base64
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

from machine.program import Alternative, Program
from machine.view.bundle import bundle, hash_source
from machine.view.contents import compared, of_parts, of_print
from machine.view.encoding import with_header
from mdp.decomposition import Decomposition
from profiles.profile import Profile

TEMPLATE = Path(__file__).parent / "template"
MARKER = re.compile(r"<!--(?:TITLE|CSP|DATA)-->|/\*(?:STYLE|SCRIPT)\*/")
DATA = b'<script type="application/octet-stream" id="tiltprint">'


def parts_page(decomposition: Decomposition, profile: Profile, alternatives: Sequence[Alternative] = ()) -> bytes:
    """The page of parts alone; arguments as of_parts takes them."""
    return page(decomposition.name, of_parts(decomposition, profile, alternatives))


def print_page(
    name: str,
    program: Program,
    profile: Profile,
    *,
    known: bool = True,
    alternatives: Sequence[Alternative] = (),
    live: bool = False,
) -> bytes:
    """The page of a whole print; arguments as of_print takes them."""
    return page(name, of_print(name, program, profile, known=known, alternatives=alternatives, live=live), live)


def with_comparison(content: bytes, alternatives: Sequence[Alternative]) -> bytes:
    """A page that print_page has written without alternatives, with them: the same bytes as if it had known them."""
    begin = content.index(DATA) + len(DATA)
    end = content.index(b"</script>", begin)
    block = with_header(base64.b64decode(content[begin:end]), lambda header: compared(header, alternatives))
    return content[:begin] + base64.b64encode(block) + content[end:]


def page(title: str, block: bytes, live: bool = False) -> bytes:
    """The HTML file. title: any text; block: from machine.view.bundle import bundle, hash_source
    from machine.view.contents; live: it may ask its own server for the state."""
    style, script, body = _template()
    put = {
        "<!--TITLE-->": escape(title),
        "<!--CSP-->": f'<meta http-equiv="Content-Security-Policy" content="{policy(style, script, live)}">',
        "<!--DATA-->": f"{DATA.decode()}{base64.b64encode(block).decode()}</script>",
        "/*STYLE*/": style,
        "/*SCRIPT*/": script,
    }
    return MARKER.sub(lambda match: put[match[0]], body).encode(errors="replace")


def policy(style: str, script: str, live: bool) -> str:
    """What the page may do: run its own script, use its own style, draw pictures that it has made itself."""
    asks = "; connect-src 'self'" if live else ""
    pictures = "img-src data: blob:; base-uri 'none'; form-action 'none'"
    return f"default-src 'none'; script-src {hash_source(script)}; style-src {hash_source(style)}; {pictures}{asks}"


def _template() -> tuple[str, str, str]:
    """Style, scripts as one, and the page around them."""
    return (TEMPLATE / "style.css").read_text("utf-8"), bundle(TEMPLATE / "main.js"), (TEMPLATE / "page.html").read_text("utf-8")
