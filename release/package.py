"""The extension as users install it: `python -m release.package build/softground.zip`.

Blender's own tool builds the zip and finds it valid. In between, the manual is added, and the entries are put in order
and lose the times and rights that they have on this machine: the same sources give the same bytes everywhere.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

from softground_addon.core.files import files

from . import manual

REPOSITORY = Path(__file__).parents[1]

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip can hold."""


def build(target: Path, sources: Path = REPOSITORY) -> None:
    """Build the package and validate it; exits with a message if the sources are not fit for it."""
    _check_changelog(sources)
    target.parent.mkdir(parents=True, exist_ok=True)
    with files.replacing(target.resolve()) as package:
        _run("build", "--source-dir", str(sources), "--output-filepath", str(package))
        _complete(package, manual.files(sources))
        _run("validate", str(package))


def _check_changelog(sources: Path) -> None:
    version = tomllib.loads((sources / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
    changelog = (sources / "CHANGELOG.md").read_text(encoding="utf-8")
    if not re.search(rf"^## {re.escape(version)}\b", changelog, re.MULTILINE):
        sys.exit(f"CHANGELOG.md has no section '## {version}', which blender_manifest.toml names: write it.")


def _run(*arguments: str) -> None:
    """Run Blender's extension tool, which the bpy module comes with."""
    tool = next(Path(sys.prefix).rglob("bl_pkg/cli/blender_ext.py"), None)
    if tool is None:
        sys.exit("There is no bpy module in this environment: run `make package`.")
    done = subprocess.run([sys.executable, str(tool), *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stdout + done.stderr)


def _complete(package: Path, added: dict[str, bytes]) -> None:
    """Add files, and write all in an order and with times and rights that are the same everywhere."""
    with zipfile.ZipFile(package) as built:
        content = {name: built.read(name) for name in built.namelist()} | added
    with zipfile.ZipFile(package, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, text in sorted(content.items()):
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.create_system, entry.external_attr = zipfile.ZIP_DEFLATED, 3, 0o100644 << 16
            archive.writestr(entry, text)


if __name__ == "__main__":
    build(Path(sys.argv[1]))
