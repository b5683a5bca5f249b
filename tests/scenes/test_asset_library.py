"""The asset library: everything in it is marked, shown and free, and plays in a file without the add-on."""

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from sample_scenes import asset_library
from softground_addon.blender.weather import ground_weather as weather
from softground_addon.core.ground.surfaces import SURFACES
from tests.blender.playback.test_playback import world_positions

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("assets")
    command = [sys.executable, "-m", "sample_scenes.asset_library", str(folder)]
    subprocess.run(command, cwd=Path(__file__).parents[2], check=True, timeout=800)
    return folder


@pytest.fixture
def opened(library):
    bpy.ops.wm.open_mainfile(filepath=str(library / asset_library.BLEND))
    yield assets()
    bpy.ops.wm.read_factory_settings(use_empty=True)


def assets():
    every = (*bpy.data.materials, *bpy.data.collections, *bpy.data.objects)
    return [thing for thing in every if thing.asset_data]


def test_each_kind_is_there_in_a_catalogue_of_its_own(library, opened):
    said = (library / asset_library.CATALOGUES).read_text()
    counts = dict.fromkeys(asset_library.KINDS, 0)
    for thing in opened:
        kind = next(kind for kind in counts if asset_library.catalogue_of(kind) == thing.asset_data.catalog_id)
        assert f"{thing.asset_data.catalog_id}:SoftGround/{kind}:" in said
        counts[kind] += 1
    assert counts == {
        "Materials": len(SURFACES),
        "Debris": len(SURFACES),
        "Weather": len(weather.PRESETS),
        "Characters": 2,
    }


def test_all_are_free_described_and_shown(opened):
    for thing in opened:
        about = thing.asset_data
        assert (about.license, about.author) == (asset_library.LICENCE, asset_library.AUTHORS)
        assert about.description
        pixels = np.empty(4 * np.prod(thing.preview.image_size), dtype=np.float32)
        thing.preview.image_pixels_float.foreach_get(pixels)
        red, opaque = pixels[::4], pixels[3::4] > 0.5
        assert opaque.sum() > 500, thing.name
        assert red[opaque].std() > 0.01, thing.name


def test_nothing_lies_outside_the_file(opened):
    assert not bpy.data.libraries
    assert not [image.name for image in bpy.data.images if image.filepath]


def test_a_print_under_weather_plays_in_a_file_of_the_user_s(library):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    title = weather.PRESETS["SNOWFALL"][0]
    with bpy.data.libraries.load(str(library / asset_library.BLEND)) as (stored, wanted):
        wanted.objects = [name for name in stored.objects if name == f"Print in {title}"]
    (tile,) = wanted.objects
    bpy.context.scene.collection.objects.link(tile)
    depth = {}
    for frame in (1, asset_library.FRAMES, asset_library.NIGHT):
        bpy.context.scene.frame_set(frame)
        height = world_positions(tile.evaluated_get(bpy.context.evaluated_depsgraph_get()))[:, 2]
        depth[frame] = np.median(height) - height.min()
    assert depth[1] < 1e-4
    assert depth[asset_library.FRAMES] > 0.02, "the foot has pressed"
    assert depth[asset_library.NIGHT] < 0.8 * depth[asset_library.FRAMES], "the snow has filled it"
