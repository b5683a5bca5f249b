"""Every sample scene keeps what its figure promises, and the ground's invariants with every option on."""

from importlib import import_module
from pathlib import Path

import pytest

from sample_scenes.make_all import HEROES, SCENES
from sample_scenes.publish import LARGEST, PAGES, publish

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]

EVERY_OPTION = {
    "pressure": "CENTRE_OF_PRESSURE",
    "material.rim_bias": "0.5",
    "material.repose_angle": "0.5585",
    "material.shortest_time": "0.02",
    "material.hardening": "10",
    "material.crust_stress": "5000",
    "material.firm_depth": "0.02",
    "tilt.use": "true",
    "grounding.use": "true",
}
COARSE = 0.015  # m

QUICK = frozenset({"force_arrows", "craters"})
"""Scenes that are built in a few seconds."""

scenes = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow) for name in SCENES]
)


@pytest.fixture
def production(addon, scene):
    from sample_scenes import production

    return production


@pytest.mark.parametrize("name", [*SCENES, *HEROES])
def test_the_scene_keeps_what_its_figure_promises(production, name):
    import bpy

    module = import_module(f"sample_scenes.{name}")
    built = module.build(bpy.context.scene, cell_size=module.CELL_SIZE if name not in QUICK else COARSE)
    failed = [str(claim) for claim in module.claims(built) if not claim.holds]
    assert not failed
    for bake in built.bakes.values():
        assert bake.footprints


@scenes
def test_volumes_are_kept_and_compression_only_grows_with_every_option_on(production, name):
    import bpy

    module = import_module(f"sample_scenes.{name}")
    built = module.build(bpy.context.scene, cell_size=COARSE, options=EVERY_OPTION)
    failed = [str(claim) for bake in built.bakes.values() for claim in production.invariants(bake) if not claim.holds]
    assert not failed


def test_every_scene_is_shown_with_its_command():
    shown = "".join((ROOT / "docs" / page).read_text(encoding="utf-8") for page in PAGES)
    for name in (*SCENES, *HEROES):
        assert f"python -m sample_scenes.{name}" in shown


def test_pictures_of_the_gallery_and_small_scenes_are_published(tmp_path):
    built, project = tmp_path / "built", tmp_path / "project"
    for folder in (built, project / "docs" / "images", project / "sample_scenes"):
        folder.mkdir(parents=True)
    for page in PAGES:
        (project / "docs" / page).write_text("")
    (project / "docs" / "gallery.md").write_text("![One](images/craters.jpg) ![Two](images/not_built.png)")
    (project / "docs" / "figures.md").write_text("![Three](images/bicycle.jpg)")
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


def test_scenes_in_the_repository_are_small_and_of_this_package():
    for blend in (ROOT / "sample_scenes").glob("*.blend"):
        assert blend.stem in SCENES, blend.name
        assert blend.stat().st_size <= LARGEST, blend.name
