"""Writes the tables of keys in docs/profiles.md from the models: `python tools/profile_tables.py [--check]`."""

import json
import re
import sys
from pathlib import Path
from typing import Any

from profiles.profile import SECTIONS, load
from profiles.wording import allowed, keys

PAGE = Path(__file__).resolve().parents[1] / "docs" / "profiles.md"
MARKED = re.compile(r"(<!-- keys of (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(section: str) -> str:
    """A Markdown table of a section's keys: what each means, what it must be, what it is by default."""
    defaults = getattr(load(), section)
    lines = ["| key | meaning | must be | default |", "|---|---|---|---|"]
    for key, field in keys(SECTIONS[section], f"{section}."):
        shown = "" if field.is_required() else f"`{json.dumps(field.get_default(), default=str)}`"
        lines.append(f"| `{key}` | {field.description} | {allowed(field)} | {shown or _given(defaults, key)} |")
    return "\n".join(lines) + "\n"


def page(text: str) -> str:
    """The page with every marked table made anew."""
    return MARKED.sub(lambda match: match[1] + table(match[2]) + match[3], text)


def _given(model: Any, key: str) -> str:
    """What the default profile gives for a key that every profile must give; a block of text is not repeated."""
    for step in key.split(".")[1:]:
        model = getattr(model, step)
    if isinstance(model, str) and "\n" in model:
        return "given by the file"
    text = json.dumps(model, default=lambda value: value.model_dump())
    return f"given by the file: `{text}`" if len(text) < 80 else "given by the file"


def main(check: bool) -> int:
    """Write the page, or with check only say whether it is current."""
    old = PAGE.read_text(encoding="utf-8")
    new = page(old)
    if check and new != old:
        print(f"{PAGE.name} is not current: run python tools/profile_tables.py")
        return 1
    if not check:
        PAGE.write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv[1:]))
