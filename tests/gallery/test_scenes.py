"""Every scene of the gallery keeps what its picture promises, and is published with its command."""

from importlib import import_module
from pathlib import Path

import pytest
from PIL import Image

from gallery import scatters
from gallery.make_all import HEROES
from gallery.publish import LARGEST, PAGES, publish
from sample_scenes.make_all import SCENES
from tests.scenes import promises

ROOT = Path(__file__).parents[2]
SHORT = ("relief", "dune_runner", "powder_runner", "before_after")
"""Scenes that bake in seconds."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in SHORT else pytest.mark.marathon)
        for name in ("relief", *HEROES)
    ],
)
def test_the_scene_keeps_what_its_picture_promises(addon, scene, name):
    module = import_module(f"gallery.{name}")
    promises.keeps_its_claims(module, scene, module.CELL_SIZE)


@pytest.mark.slow
def test_volumes_are_kept_with_relief_and_every_option_on(addon, scene):
    promises.keeps_the_invariants(import_module("gallery.relief"), scene)


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "gallery").glob("*.py")))
def test_every_module_finds_what_it_imports(name):
    import_module(f"gallery.{name}")


def test_every_scene_is_shown_with_its_command():
    shown = "".join((ROOT / "docs" / page).read_text(encoding="utf-8") for page in PAGES)
    modules = [f"sample_scenes.{name}" for name in SCENES] + [f"gallery.{name}" for name in ("relief", *HEROES)]
    assert [module for module in modules if f"python -m {module}" not in shown] == []


def test_pictures_of_the_docs_and_small_scenes_are_published(tmp_path):
    built, project = tmp_path / "built", tmp_path / "project"
    for folder in (built, project / "docs" / "images", project / "sample_scenes"):
        folder.mkdir(parents=True)
    for page in PAGES:
        (project / "docs" / page).write_text("")
    (project / "docs" / "gallery.md").write_text("![One](images/craters.jpg) ![Two](images/not_built.png)")
    (project / "docs" / "figures.md").write_text("![Three](images/bicycle.jpg) ![Four](images/plot.png)")
    Image.new("RGBA", (4, 3), (10, 200, 30, 255)).save(built / "plot.png")
    for name, size in {
        "craters.jpg": 5,
        "bicycle.jpg": 5,
        "other.jpg": 5,
        "craters.blend": LARGEST,
        "stunts.blend": LARGEST + 1,
    }.items():
        (built / name).write_bytes(bytes(size))
    publish(built, project)
    published = {path.name for path in project.rglob("*") if path.suffix in (".jpg", ".blend")}
    assert published == {"craters.jpg", "bicycle.jpg", "craters.blend"}
    with Image.open(project / "docs" / "images" / "plot.png") as plot:
        assert (plot.mode, plot.convert("RGB").getpixel((2, 1))) == ("P", (10, 200, 30))


def test_the_sheet_of_scatters_is_whole_and_small():
    sheet = ROOT / "docs" / "images" / "scatters.jpg"
    with Image.open(sheet) as picture:
        assert picture.size == (sum(scatters.WIDTHS[0]), scatters.HEIGHT * len(scatters.WIDTHS))
    assert sheet.stat().st_size <= scatters.LARGEST


def test_scenes_in_the_repository_are_small():
    for blend in (ROOT / "sample_scenes").glob("*.blend"):
        assert blend.stat().st_size <= LARGEST, blend.name
