"""The package: what is in it, that it is the same everywhere, and that it installs without a word."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from PIL import Image

from release import manual, package

ROOT = Path(__file__).parents[2]
ABOUT = tomllib.loads((ROOT / "blender_manifest.toml").read_text())


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    path = tmp_path_factory.mktemp("build") / "softground.zip"
    package.build(path)
    return path


def sources(folder):
    """A copy of the repository as another machine might have it."""
    left_out = shutil.ignore_patterns(".venv*", ".git", "build", ".mypy_cache", ".ruff_cache", ".hypothesis")
    shutil.copytree(ROOT, folder, ignore=left_out, copy_function=shutil.copyfile)
    return folder


@pytest.mark.slow
def test_it_holds_the_extension_and_nothing_else(built):
    code = [path for kind in ("*.py", "*.json", "*.png") for path in (ROOT / "softground_addon").rglob(kind)]
    about = ("blender_manifest.toml", "__init__.py", "README.md", "LICENSE", "CHANGELOG.md")
    with zipfile.ZipFile(built) as archive:
        pages = manual.files(ROOT)
        files = [*about, *(path.relative_to(ROOT).as_posix() for path in code)]
        assert archive.namelist() == sorted([*files, *pages])
        assert all(archive.read(name) == (ROOT / name).read_bytes() for name in files)
        assert all(archive.read(name) == pages[name] for name in pages)


def test_it_is_small_and_so_are_the_pictures_of_its_page(built):
    assert built.stat().st_size < 6_000_000
    assert all(path.stat().st_size < 500_000 for path in (ROOT / "docs/images").glob("*.jpg"))


def test_pages_show_pictures_of_the_package_that_fit(built):
    with zipfile.ZipFile(built) as archive:
        pages = "".join(archive.read(name).decode() for name in archive.namelist() if name.endswith(".html"))
        shown = {f"manual/{source}" for source in re.findall(r'<img src="([^"]+)"', pages)}
        assert shown == {name for name in archive.namelist() if name.startswith("manual/images/")}
        for name in (name for name in shown if not name.endswith(".svg")):
            picture = Image.open(archive.open(name))
            assert picture.mode != "RGB" or picture.width <= manual.WIDEST, name
            assert (picture.format == "JPEG") == name.endswith(".jpg")


def test_the_page_has_an_icon_a_featured_picture_and_six_more():
    sizes = {}
    for row in (ROOT / "docs" / "publishing.md").read_text(encoding="utf-8").splitlines():
        if row.startswith(("| icon", "| featured picture", "| six pictures")):
            names = re.findall(r"\(images/([\w.]+)\)", row)
            sizes[row[2:6]] = [Image.open(ROOT / "docs" / "images" / name).size for name in names]
    assert sizes["icon"] == [(256, 256)]
    assert sizes["feat"] == [(1920, 1080)]
    assert len(sizes["six "]) == 6
    assert all(width >= 1280 for width, _ in sizes["six "])


@pytest.mark.slow
def test_the_same_sources_give_the_same_bytes_whatever_their_times_and_rights(built, tmp_path):
    copy = sources(tmp_path / "copy")
    for number, path in enumerate(sorted(copy.rglob("*.py"), reverse=True)):
        path.chmod(0o600)
        os.utime(path, (10**9 + number, 10**9 + number))
    (copy / "softground_addon" / "__pycache__").mkdir(exist_ok=True)
    (copy / "softground_addon" / "__pycache__" / "x.pyc").touch()
    (copy / ".hidden").touch()
    package.build(tmp_path / "again.zip", copy)
    assert (tmp_path / "again.zip").read_bytes() == built.read_bytes()


def test_a_version_without_a_section_in_the_changelog_is_not_built(tmp_path):
    copy = sources(tmp_path / "copy")
    about = copy / "blender_manifest.toml"
    about.write_text(re.sub(r'(?m)^version = ".*"$', 'version = "98.7.6"', about.read_text()))
    with pytest.raises(SystemExit, match=r"no section '## 98\.7\.6'"):
        package.build(tmp_path / "x.zip", copy)
    assert not (tmp_path / "x.zip").exists()


def test_the_version_stands_in_the_manifest_only():
    files = [ROOT / "pyproject.toml", ROOT / "__init__.py", *(ROOT / "softground_addon").rglob("*.py")]
    assert ABOUT["version"] not in "".join(path.read_text(encoding="utf-8") for path in files)


INSTALL = """
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit
import bpy
import addon_utils
import bl_operators
assert bpy.ops.extensions.package_install_files(
    filepath=sys.argv[1], repo="user_default", enable_on_install=True) == {"FINISHED"}
assert "bl_ext.user_default.softground" in bpy.context.preferences.addons
assert bpy.context.scene.softground is not None
page = bl_operators.wm.WM_OT_doc_view_manual._lookup_rna_url("bpy.ops.softground.live", verbose=False)
assert Path(unquote(urlsplit(page).path)).is_file(), page
assert bpy.ops.softground.open_manual.poll()
addon_utils.disable("bl_ext.user_default.softground", default_set=True)
assert not hasattr(bpy.types.Scene, "softground")
addon_utils.enable("bl_ext.user_default.softground", default_set=True)
assert bpy.context.scene.softground is not None
addon_utils.disable("bl_ext.user_default.softground", default_set=True)
"""


def run_installed(script, built, folder):
    """A script in a Python of its own, in which Blender finds the extension where users have theirs."""
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(folder), "PYTHONWARNINGS": "default"}
    environment.pop("OCIO", None)  # left by a Blender 5 further up; the one that finds it says so
    command = [sys.executable, "-c", script, str(built)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.slow
def test_installing_enabling_and_disabling_it_prints_nothing(built, tmp_path):
    done = run_installed(INSTALL, built, tmp_path)
    assert done.stdout.replace('STATUS Installed "softground"\n', "") == ""  # Blender's own word
    assert done.stderr == ""


BAKE = """
import sys
import bpy
import addon_utils
bpy.ops.wm.read_homefile(use_empty=True)
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
bpy.ops.softground.add_sample_scene()
bpy.ops.softground.add_character()
bpy.ops.softground.bake()
assert not [name for name in sys.modules if name.split(".")[0] == "softground_addon"]
summary = bpy.context.scene.softground.ground.data["softground_summary"]
print("steps", summary["steps"])
addon_utils.disable("bl_ext.user_default.softground", default_set=True)
"""


def test_what_is_installed_bakes(built, tmp_path):
    steps = re.search(r"^steps (\d+)$", run_installed(BAKE, built, tmp_path).stdout, re.MULTILINE)
    assert int(steps[1]) >= 6
