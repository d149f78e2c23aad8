"""Page: puts the template, its scripts and a packed block together into one HTML file that loads nothing.

ES modules that import each other become one script without imports.
"""

import base64
import re
from collections.abc import Sequence
from graphlib import TopologicalSorter
from hashlib import sha256
from html import escape
from pathlib import Path

from machine.program import Alternative, Program
from machine.view.contents import compared, of_parts, of_print
from machine.view.encoding import with_header
from mdp.decomposition import Decomposition
from profiles.profile import Profile

TEMPLATE = Path(__file__).parent / "template"
MARKER = re.compile(r"<!--(?:TITLE|CSP|DATA)-->|/\*(?:STYLE|SCRIPT)\*/")
DATA = b'<script type="application/octet-stream" id="tiltprint">'
IMPORT = re.compile(r'^import \{ (.*) \} from "(.*)";$', re.MULTILINE)
EXPORT = re.compile(r"^export ((?:async )?function|const|class) ([\w$]+)", re.MULTILINE)


def parts_page(decomposition: Decomposition, profile: Profile, alternatives: Sequence[Alternative] = ()) -> bytes:
    """The page of parts alone; arguments as for of_parts."""
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
    """The page of a whole print; arguments as for of_print."""
    return page(name, of_print(name, program, profile, known, alternatives, live), live)


def with_comparison(content: bytes, alternatives: Sequence[Alternative]) -> bytes:
    """Add alternatives to a page of print_page; same bytes as if print_page had been given them."""
    begin = content.index(DATA) + len(DATA)
    end = content.index(b"</script>", begin)
    block = with_header(base64.b64decode(content[begin:end]), lambda header: compared(header, alternatives))
    return content[:begin] + base64.b64encode(block) + content[end:]


def page(title: str, block: bytes, live: bool = False) -> bytes:
    """The HTML file. title: any text; block: from machine.view.contents; live: the page may fetch the state from its server."""
    style, body = ((TEMPLATE / name).read_text("utf-8") for name in ("style.css", "page.html"))
    script = bundle(TEMPLATE / "main.js")
    put = {
        "<!--TITLE-->": escape(title),
        "<!--CSP-->": f'<meta http-equiv="Content-Security-Policy" content="{policy(style, script, live)}">',
        "<!--DATA-->": f"{DATA.decode()}{base64.b64encode(block).decode()}</script>",
        "/*STYLE*/": style,
        "/*SCRIPT*/": script,
    }
    return MARKER.sub(lambda match: put[match[0]], body).encode(errors="replace")


def policy(style: str, script: str, live: bool) -> str:
    """Content security policy: only the page's own script and style, and images that it creates."""
    asks = "; connect-src 'self'" if live else ""
    pictures = "img-src data: blob:; base-uri 'none'; form-action 'none'"
    return f"default-src 'none'; script-src {hash_source(script)}; style-src {hash_source(style)}; {pictures}{asks}"


def bundle(entry: Path) -> str:
    """Bundle a module and its imports into one script; modules["FOLDER/NAME"] has the exports of each. Raises CycleError."""
    texts, waiting = dict[Path, str](), [entry.resolve()]
    while waiting:
        file = waiting.pop()
        if file not in texts:
            texts[file] = file.read_text("utf-8")
            waiting += _imported(file, texts[file])
    order = TopologicalSorter({file: sorted(_imported(file, text)) for file, text in sorted(texts.items())}).static_order()
    return "\n".join(['"use strict";', "const modules = {};", *(_module(file, texts[file]) for file in order)])


def _imported(file: Path, text: str) -> list[Path]:
    return [(file.parent / name).resolve() for _, name in IMPORT.findall(text)]


def _module(file: Path, text: str) -> str:
    exported = ", ".join(name for _, name in EXPORT.findall(text))
    text = IMPORT.sub(lambda taken: f"const {{ {taken[1]} }} = {_known(file.parent / taken[2])};", EXPORT.sub(r"\1 \2", text))
    return f"{_known(file)} = (() => {{\n{text}return {{ {exported} }};\n}})();"


def _known(file: Path) -> str:
    return f'modules["{file.resolve().parent.name}/{file.stem}"]'


def hash_source(text: str) -> str:
    """The hash source of an inline script or style in a content security policy."""
    return f"'sha256-{base64.b64encode(sha256(text.encode()).digest()).decode()}'"
