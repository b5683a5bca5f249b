"""Every sample scene keeps what its figure promises, and the ground's invariants with every option on."""

from importlib import import_module
from pathlib import Path

import pytest

from sample_scenes.make_all import SCENES
from tests.scenes import promises

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]

QUICK = frozenset({"force_arrows", "craters"})
"""Scenes that show the same on coarse cells, in a few seconds."""

scenes = pytest.mark.parametrize("name", SCENES)


@scenes
def test_the_scene_keeps_what_its_figure_promises(addon, scene, name):
    module = import_module(f"sample_scenes.{name}")
    promises.keeps_its_claims(module, scene, promises.COARSE if name in QUICK else module.CELL_SIZE)


@scenes
def test_volumes_are_kept_and_compression_only_grows_with_every_option_on(addon, scene, name):
    promises.keeps_the_invariants(import_module(f"sample_scenes.{name}"), scene)


def test_scenes_in_the_repository_are_of_this_package():
    for blend in (ROOT / "sample_scenes").glob("*.blend"):
        assert blend.stem in SCENES, blend.name
