"""Who sees little or nothing: colours that stand out from their ground, light and dark, and a name for every control."""

import re
from pathlib import Path

import pytest

from tests.machine.browser import Browser
from tests.machine.workbench import Running

ROOT = Path(__file__).resolve().parents[2] / "machine"
STYLES = [ROOT / "view/template/style.css", ROOT / "app/workbench/web/page/style.css"]
LEAST_OF_TEXT = 4.5  # WCAG 2.2, 1.4.3
TABS = ("model", "parts", "slices", "printing", "settings")
OPERATED = {"button", "checkbox", "combobox", "radio", "searchbox", "slider", "spinbutton", "tab", "textbox", "menuitem", "link"}


def colours(theme: str) -> dict[str, str]:
    """The variables of both style sheets that are plain colours, as a theme has them."""
    text = "".join(path.read_text() for path in STYLES)
    blocks = re.findall(r":root(\[data-theme=\"dark\"\])? \{(.*?)\}", text, re.DOTALL)
    own = [block for dark, block in blocks if not dark or theme == "dark"]
    return dict(re.findall(r"--([a-z-]+): #([0-9a-f]{6})(?![0-9a-f])", " ".join(own)))


def luminance(colour: str) -> float:
    """Of sRGB as six hexadecimal digits, by WCAG 2.2."""
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
def test_text_stands_out_from_its_ground(theme: str) -> None:
    colour = colours(theme)
    on_ground = [(text, ground) for text in ("text", "soft", "accent", "error", "warning") for ground in ("panel", "press")]
    of_axes = [(axis, ground) for axis in ("axis-x", "axis-y", "axis-z") for ground in ("panel", "on-axis")]
    pairs = [*on_ground, *of_axes, ("on-accent", "accent"), ("soft", "back")]
    assert {pair: ratio for pair in pairs if (ratio := contrast(colour[pair[0]], colour[pair[1]])) < LEAST_OF_TEXT} == {}


def test_nothing_but_what_cannot_be_pressed_is_made_faint() -> None:
    """A share of opacity lessens the contrast of the text in it: only disabled controls need none."""
    faint = re.findall(r"^(.*?) \{[^}]*(?<!-)\bopacity: 0\.\d+[^}]*\}", STYLES[1].read_text(), re.MULTILINE)
    assert {rule for rule in faint if not re.search(r":disabled|#rings", rule)} == set()


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
        controls = [node for node in browser.accessible() if node["role"] in OPERATED]
        assert len(controls) > 10
        assert [node for node in controls if not node["name"].strip()] == []
        assert browser.value(SEEN_NOT_SAID) == []


# Of buttons: what is seen on them belongs into their name, or nobody can press them by voice.
SEEN_NOT_SAID = """[...document.querySelectorAll('button[aria-label]')].filter((button) => {
  const seen = button.textContent.trim().toLowerCase();
  return /[a-z0-9]/.test(seen) && button.checkVisibility() && !button.ariaLabel.toLowerCase().includes(seen);
}).map((button) => `${button.textContent}: ${button.ariaLabel}`)"""
