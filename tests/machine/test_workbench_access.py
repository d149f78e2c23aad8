"""Accessibility of the workbench and of the page of a print: contrast in the light and the dark theme, a name for every
control, and no name that is never read out."""

import re
from pathlib import Path

import pytest

from machine.dryrun.dryrun import dry_run
from machine.program import Program
from machine.view.page import print_page
from tests.machine import hand
from tests.machine.browser import Browser
from tests.machine.running_workbench import Running

ROOT = Path(__file__).resolve().parents[2] / "machine"
STYLES = [ROOT / "view/template/style.css", ROOT / "workbench/web/page/style.css"]
LEAST_OF_TEXT = 4.5  # WCAG 2.2, 1.4.3
TABS = ("model", "parts", "slices", "printing", "settings")
TABS_OF_PRINT = ("show", "report", "findings", "code")
OPERATED = {"button", "checkbox", "combobox", "radio", "searchbox", "slider", "spinbutton", "tab", "textbox", "menuitem", "link"}


def colours(theme: str) -> dict[str, str]:
    """The variables of both style sheets that are plain colours, with the values of a theme."""
    text = "".join(path.read_text() for path in STYLES)
    blocks = re.findall(r":root(\[data-theme=\"dark\"\])? \{(.*?)\}", text, re.DOTALL)
    own = [block for dark, block in blocks if not dark or theme == "dark"]
    return dict(re.findall(r"--([a-z-]+): #([0-9a-f]{6})(?![0-9a-f])", " ".join(own)))


def luminance(colour: str) -> float:
    """Relative luminance of an sRGB colour in six hexadecimal digits, by WCAG 2.2."""
    shares = [int(colour[k : k + 2], 16) / 255.0 for k in (0, 2, 4)]
    red, green, blue = (share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(first: str, second: str) -> float:
    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_that_of_its_definition() -> None:
    assert contrast("ffffff", "000000") == pytest.approx(21.0)
    assert contrast("777777", "ffffff") == pytest.approx(4.48, abs=0.005)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_has_enough_contrast(theme: str) -> None:
    colour = colours(theme)
    on_ground = [(text, ground) for text in ("text", "soft", "accent", "error", "warning") for ground in ("panel", "press")]
    of_axes = [(axis, ground) for axis in ("axis-x", "axis-y", "axis-z") for ground in ("panel", "on-axis")]
    pairs = [*on_ground, *of_axes, ("on-accent", "accent"), ("soft", "back")]
    assert {pair: ratio for pair in pairs if (ratio := contrast(colour[pair[0]], colour[pair[1]])) < LEAST_OF_TEXT} == {}


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("behind", [0, 255])
def test_text_over_the_picture_has_enough_contrast_on_any_background(theme: str, behind: int) -> None:
    colour = colours(theme)
    (card,) = re.findall(r"--card: #([0-9a-f]{8})", STYLES[0].read_text().split(":root")[1 if theme == "light" else 2])
    *channels, opaque = (int(card[k : k + 2], 16) for k in (0, 2, 4, 6))
    ground = "".join(f"{round(channel * opaque / 255 + behind * (1 - opaque / 255)):02x}" for channel in channels)
    faint = {text: contrast(colour[text], ground) for text in ("text", "soft")}
    assert {text: ratio for text, ratio in faint.items() if ratio < LEAST_OF_TEXT} == {}


def test_only_disabled_controls_are_faint() -> None:
    """Partial opacity lowers the contrast of text: only disabled controls and pictures may use it."""
    faint = re.findall(r"^(.*?) \{[^}]*(?<!-)\bopacity: 0\.\d+[^}]*\}", STYLES[1].read_text(), re.MULTILINE)
    assert {rule for rule in faint if not re.search(r":disabled|#rings|#canvas", rule)} == set()


def test_every_control_of_every_tab_has_a_name(bench: Running, browser: Browser) -> None:
    browser.open(bench.address)
    browser.wait("document.documentElement.dataset.line === 'open'")
    browser.value("{ $('demo').value = 'demo:bracket'; $('demo').dispatchEvent(new Event('change')); }")
    browser.wait("document.documentElement.dataset.shown && document.documentElement.dataset.busy === ''")
    browser.click("#level-all")
    for tab in TABS:
        browser.click(f"#tab-{tab}")
        if tab == "settings":
            browser.wait("document.querySelectorAll('[data-key]').length > 100")
        check_names(browser, at_least=11)


def test_every_control_of_the_page_of_a_print_has_a_name(browser: Browser, tmp_path: Path) -> None:
    profile, decomposition, _, _ = hand.printed()
    lines = hand.text("generic_ac")
    printed = Program(lines, dry_run(lines, profile), decomposition)  # its arm begins in air, which is reported
    (tmp_path / "print.html").write_bytes(print_page("post and arm", printed, profile))
    browser.open((tmp_path / "print.html").as_uri())
    assert browser.value("document.querySelectorAll('#findings button').length") > 0
    for tab in TABS_OF_PRINT:
        browser.click(f"#tab-{tab}")
        check_names(browser, at_least=11)


def check_names(browser: Browser, at_least: int) -> None:
    """At least this number of controls exist, all have names, and no element without a role has a name that is never read out."""
    browser.value(
        "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    )  # elements drawn now have names
    controls = [node for node in browser.accessible() if node["role"] in OPERATED]
    assert len(controls) >= at_least
    assert [node for node in controls if not node["name"].strip()] == []
    assert browser.value(SEEN_NOT_SAID) == []
    assert browser.value(NOT_READ_OUT) == []


NOT_READ_OUT = """[...document.querySelectorAll(':is(div, p, span)[aria-label]:not([role])')]
  .map(({ outerHTML }) => outerHTML.slice(0, 80))"""


# Buttons whose visible text is missing from their name, so that they cannot be pressed by voice.
SEEN_NOT_SAID = """[...document.querySelectorAll('button[aria-label]')].filter((button) => {
  const seen = button.textContent.trim().toLowerCase();
  return /[a-z0-9]/.test(seen) && button.checkVisibility() && !button.ariaLabel.toLowerCase().includes(seen);
}).map((button) => `${button.textContent}: ${button.ariaLabel}`)"""
