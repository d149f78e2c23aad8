"""Pairing page: all that a device gets that is not paired: one field for the code, without scripts, told light and dark."""

from html import escape

from starlette.responses import HTMLResponse

from machine.view.page import hash_source
from machine.workbench.access.door import Door
from machine.workbench.access.pairing import CODE_LENGTH, Verdict

STYLE = """
:root { color-scheme: light dark; --back: #eef0f3; --panel: #fff; --text: #1d232b; --soft: #5c6672; --line: #6c7783; --accent: #0067a8; --on: #fff; --error: #c01822; }
@media (prefers-color-scheme: dark) { :root { --back: #14171b; --panel: #191c21; --text: #e6e9ed; --soft: #9aa4b0; --line: #8a95a1; --accent: #56b4e9; --on: #0b1117; --error: #ff7b7f; } }
* { box-sizing: border-box; }
body { margin: 0; padding: 24px 16px; background: var(--back); color: var(--text); font: 17px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif; }
main { max-width: 26rem; margin: 0 auto; padding: 20px; background: var(--panel); border-radius: 12px; }
h1 { margin: 0 0 8px; font-size: 22px; }
p { margin: 0 0 14px; }
label { display: block; font-weight: 600; }
input, button { display: block; width: 100%; margin: 6px 0 14px; padding: 12px; border-radius: 8px; font: inherit; }
input { border: 1px solid var(--line); background: var(--back); color: inherit; font-size: 24px; letter-spacing: 0.12em; text-transform: uppercase; }
button { border: 0; background: var(--accent); color: var(--on); font-weight: 600; }
:is(input, button):focus-visible { outline: 3px solid var(--accent); outline-offset: 2px; }
.error { color: var(--error); }
.soft { color: var(--soft); font-size: 15px; }
"""  # noqa: E501 - a rule a line
ICON = "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 16 16'%3E%3Crect x='4' y='7' width='8' height='3' rx='1.2' fill='%23e69f00'/%3E%3C/svg%3E"  # noqa: E501
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Pair with tiltprint</title><link rel="icon" href="{icon}"><style>{style}</style></head>
<body><main><h1>Pair with tiltprint</h1>
{told}{form}{open_network}</main></body></html>
"""
FORM = """<form method="post" action="/pair">
<label for="code">Code</label>
<input id="code" name="code" required autofocus maxlength="20" autocomplete="off" autocapitalize="characters" autocorrect="off"
 spellcheck="false" enterkeyhint="go" aria-describedby="{described}"{invalid}>
<p class="soft" id="hint">{length} letters and digits, in the terminal in which <kbd>tiltprint edit</kbd> runs.</p>
<button>Pair this device</button></form>
"""
OPEN_NETWORK = """<p class="soft">This line is not encrypted: whoever is in this network can read along.
Use it in a network of your own only.</p>
"""
STATUS = {Verdict.WRONG: 403, Verdict.SPENT: 403, Verdict.WAITS: 429, Verdict.CLOSED: 403}


def pairing_page(door: Door, verdict: Verdict | None = None) -> HTMLResponse:
    """The page. verdict: on the code that this device has typed, None where it has typed none."""
    told, wait_s = _told(door, verdict), door.wait_s
    error = f'<p class="error" id="told" role="alert">{escape(told)}</p>\n' if told else ""
    described, invalid = ("told hint", ' aria-invalid="true"') if told else ("hint", "")
    form = "" if door.pairing.closed else FORM.format(described=described, invalid=invalid, length=CODE_LENGTH)
    body = PAGE.format(icon=ICON, style=STYLE, told=error, form=form, open_network="" if door.encrypted else OPEN_NETWORK)
    headers = {
        "content-security-policy": _policy(),
        "referrer-policy": "same-origin",  # else the form would be sent without its origin
        **({"retry-after": f"{wait_s:.0f}"} if wait_s else {}),
    }
    return HTMLResponse(body, 200 if verdict is None else STATUS[verdict], headers)


def _told(door: Door, verdict: Verdict | None) -> str:
    """What keeps this device from being paired, "" where nothing does."""
    if door.pairing.closed:
        return "Too many wrong codes were typed: no device is paired any more. The page on the computer can let them again."
    if door.wait_s:
        return f"Too many wrong codes were typed. Wait {door.wait_s:.0f} seconds; the terminal shows a new code."
    return "This is not the code that the terminal shows now." if verdict == Verdict.WRONG else ""


def _policy() -> str:
    rest = "img-src data:; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
    return f"default-src 'none'; style-src {hash_source(STYLE)}; {rest}"
