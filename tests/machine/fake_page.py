"""The workbench's own scripts run by Node on a fake page, without a browser, to test the messages that they send and show."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from machine.view.page import bundle
from machine.workbench.web.server import OWN

NODE = shutil.which("node")
FAKE = Path(__file__).with_suffix(".js")
needs_node = pytest.mark.skipif(NODE is None, reason="Node is not installed: the page's script is not tried without a browser")


def on_fake_page(act: str, script: Path = OWN / "print" / "print-panel.js") -> Any:
    """The value of a function body that runs in place of the page's `main`. It can use `$`, the definitions of fake_page.js and
    the exports of the script, by default those of the workbench's `printPanel`."""
    assert NODE is not None
    ends = "given.then((value) => process.stdout.write(JSON.stringify(value), () => process.exit(0)));"
    names = 'const { printPanel } = modules["print/print-panel"] ?? {}, { $ } = modules["template/elements"];'
    whole = "\n".join([FAKE.read_text("utf-8"), bundle(script), names, f"const given = (async () => {{ {act} }})();", ends])
    run = subprocess.run([NODE, "-"], input=whole, capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)
