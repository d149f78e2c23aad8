"""Bundle: ES modules that import each other, put together into one script that imports nothing, so that a page is one file."""

import base64
import re
from graphlib import TopologicalSorter
from hashlib import sha256
from pathlib import Path

IMPORT = re.compile(r'^import \{ (.*) \} from "(.*)";$', re.MULTILINE)
EXPORT = re.compile(r"^export ((?:async )?function|const|class) ([\w$]+)", re.MULTILINE)


def bundle(entry: Path) -> str:
    """The script of a module and of all that it imports. Each keeps its names to itself: it is a function that gives what it
    exports, known to the others as modules["FOLDER/NAME"]. Raises CycleError."""
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
    """How a content security policy names the one script or style that a page may have."""
    return f"'sha256-{base64.b64encode(sha256(text.encode()).digest()).decode()}'"
