"""The scripts of both pages: modules that keep their names to themselves, each imported by what uses it, put into one script."""

import shutil
import subprocess
from graphlib import CycleError
from pathlib import Path

import pytest

from machine.view.page import EXPORT, IMPORT, TEMPLATE, bundle
from machine.workbench.web.server import OWN

SCRIPTS = sorted([*TEMPLATE.glob("*.js"), *OWN.glob("*.js")])
NODE = shutil.which("node")


def written(folder: Path, **texts: str) -> Path:
    for name, text in texts.items():
        (folder / f"{name}.js").write_text(text)
    return folder / "main.js"


@pytest.mark.skipif(NODE is None, reason="Node is not installed")
def test_modules_of_the_same_names_inside_see_only_what_they_import(tmp_path: Path) -> None:
    main = written(
        tmp_path,
        base="const own = 1;\nexport const $ = () => own;\n",
        other='import { $ } from "./base.js";\n\nconst own = 10;\nexport async function twice() { return 2 * $() + own; }\n',
        main='import { $ } from "./base.js";\nimport { twice } from "./other.js";\n\n'
        "twice().then((x) => console.log(x, $(), typeof own));\n",
    )
    assert NODE is not None
    run = subprocess.run([NODE, "-"], input=bundle(main), capture_output=True, text=True, check=True)
    assert run.stdout == "12 1 undefined\n"


def test_modules_that_need_each_other_are_refused(tmp_path: Path) -> None:
    main = written(tmp_path, main='import { a } from "./a.js";\n', a='import { b } from "./main.js";\nexport const a = 1;\n')
    with pytest.raises(CycleError):
        bundle(main)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_a_script_imports_what_the_others_export_and_uses_it(script: Path) -> None:
    text = script.read_text("utf-8")
    assert sum(line.startswith("import ") for line in text.splitlines()) == len(IMPORT.findall(text))
    body = IMPORT.sub("", text)
    for names, path in IMPORT.findall(text):
        exported = {name for _, name in EXPORT.findall((script.parent / path).read_text("utf-8"))}
        assert set(names.split(", ")) <= exported
        assert [name for name in names.split(", ") if name not in body] == []


def test_every_script_is_part_of_a_page() -> None:
    pages = bundle(TEMPLATE / "main.js") + bundle(OWN / "main.js")
    assert [file for file in SCRIPTS if f'modules["{file.parent.name}/{file.stem}"] = ' not in pages] == []
