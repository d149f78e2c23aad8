"""One folder: tiltprint with its own Python and all libraries, for a Linux without Python.

    python .ci/one_folder.py -o dist/tiltprint-linux [--wheel FILE.whl]

Copies the Python that runs this script, without unneeded parts, installs the wheel (built first by default) and its libraries
into it, adds the system libraries to which its modules are linked, and compiles the kernels. `tiltprint` in the folder starts the
program; the folder may be moved. LICENSES has the licence texts of everything bundled. It runs with a C library as new as here,
or newer. The program starts interpreters of its own (the workbench's workers, prints, compilers), so it is a Python in a folder
and not a program frozen by PyInstaller or Briefcase, which has none to start.
"""

import argparse
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
from collections.abc import Iterator
from importlib.metadata import PathDistribution
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSION = f"python{sys.version_info.major}.{sys.version_info.minor}"
LEFT_OUT = ["test", "idlelib", "tkinter", "turtledemo", "lib2to3", "ensurepip", "_tkinter*", "_test*", "site-packages"]
LEFT_OUT += ["__pycache__", "config-*", "*.a"]
# Libraries that every Linux has in its own version.
SYSTEM = re.compile(r"^(linux-vdso|ld-linux|lib(c|m|dl|rt|util|pthread|resolv|nsl)\.so)")
LICENCE = re.compile(r"(?i)(^|/)(licen[cs]e|copying|notice|authors)[^/]*$")
LAUNCHER = f"""#!/bin/sh
here=$(dirname "$(readlink -f "$0")")
unset PYTHONHOME PYTHONPATH
exec "$here/bin/{VERSION}" -I -c "import sys; from machine.cli.start import main; sys.exit(main())" "$@"
"""


def main() -> None:
    """Make the folder and its archive."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("-o", "--out", type=Path, required=True, metavar="FOLDER")
    options.add_argument("--wheel", type=Path, metavar="FILE")
    given = options.parse_args()
    if sys.platform != "linux":
        sys.exit("one_folder.py: made for Linux only; docs/install.md tells what there is for other systems")
    if given.out.exists():
        sys.exit(f"one_folder.py: {given.out} exists: remove it first")
    wheel = given.wheel or _wheel(given.out.parent)
    _copy_python(given.out)
    packages = given.out / "lib" / VERSION / "site-packages"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-compile", "--target", str(packages), f"{wheel}[step]"]
    subprocess.run(pip, check=True)
    shutil.rmtree(packages / "bin", ignore_errors=True)
    _copy_libraries(given.out)
    subprocess.run([given.out / "bin" / VERSION, "-I", ROOT / ".ci" / "ship_kernels.py"], check=True)
    _write_licences(given.out, packages)
    launcher = given.out / "tiltprint"
    launcher.write_text(LAUNCHER)
    launcher.chmod(0o755)
    archive = given.out.with_name(f"{given.out.name}-{platform.machine()}.tar.gz")
    with tarfile.open(archive, "w:gz", compresslevel=6) as tar:
        tar.add(given.out, given.out.name)
    print(f"{given.out}\n{archive}: {archive.stat().st_size / 2**20:.0f} MiB, C library {platform.libc_ver()[1]} or newer")


def _wheel(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run([sys.executable, "-m", "build", "--quiet", "--wheel", "--outdir", str(folder), str(ROOT)], check=True)
    return max(folder.glob("tiltprint-*.whl"), key=lambda path: path.stat().st_mtime)


def _copy_python(folder: Path) -> None:
    """Copy the interpreter and the standard library; it finds itself by lib/pythonX.Y/os.py beside bin."""
    base = Path(sys.base_prefix)
    (folder / "bin").mkdir(parents=True)
    shutil.copy2(Path(sys.executable).resolve(), folder / "bin" / VERSION)
    shutil.copytree(sysconfig.get_path("stdlib"), folder / "lib" / VERSION, ignore=shutil.ignore_patterns(*LEFT_OUT))
    for library in sorted(Path(base / "lib").glob(f"lib{VERSION}*.so*")):
        shutil.copy2(library, folder / "lib" / library.name)


def _copy_libraries(folder: Path) -> None:
    """Copy the system libraries to which Python and its modules are linked."""
    native = folder / "lib" / "native"
    native.mkdir()
    modules = [folder / "bin" / VERSION, *sorted((folder / "lib" / VERSION / "lib-dynload").glob("*.so"))]
    for module in modules:
        for library in _linked(module):
            if not (native / library.name).exists():
                shutil.copy2(library, native / library.name)
        path = "$ORIGIN/../lib:$ORIGIN/../lib/native" if module.parent.name == "bin" else "$ORIGIN/../../native"
        subprocess.run(["patchelf", "--set-rpath", path, str(module)], check=True)
    for library in native.iterdir():
        subprocess.run(["patchelf", "--set-rpath", "$ORIGIN", str(library)], check=True)


def _linked(module: Path) -> Iterator[Path]:
    listed = subprocess.run(["ldd", str(module)], check=True, capture_output=True, text=True).stdout
    for name, path in re.findall(r"^\s*(\S+) => (/\S+)", listed, re.MULTILINE):
        if not SYSTEM.match(name):
            yield Path(path)


def _write_licences(folder: Path, packages: Path) -> None:
    """Write the licence texts of Python and of every package, and a list of them."""
    licences, rows = folder / "LICENSES", []
    licences.mkdir()
    for text in sorted({*Path(sysconfig.get_path("stdlib")).glob("LICENSE*"), *Path(sys.base_prefix).glob("LICENSE*")}):
        shutil.copy2(text, licences / f"Python-{text.name}")
    for info in sorted(packages.glob("*.dist-info")):
        package = PathDistribution(info)
        name = package.metadata["Name"]
        terms = package.metadata.get("License-Expression") or (package.metadata.get("License") or "see its text").splitlines()[0]
        rows.append(f"{name} {package.version}: {terms[:80]}")
        for file in package.files or ():
            if LICENCE.search(str(file)) and (packages / file).is_file():
                shutil.copy2(packages / file, licences / f"{name}-{Path(file).name}")
    for library in sorted((folder / "lib" / "native").iterdir()):
        rows.append(f"{library.name}: of the system that this was built on, {platform.platform()}")
    (folder / "THIRD_PARTY.txt").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
