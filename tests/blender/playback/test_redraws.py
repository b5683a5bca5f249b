"""What is asked at each redraw does not depend on how much there is in the file."""

from unittest.mock import MagicMock

import bpy
import pytest

from softground_addon.blender import settings
from softground_addon.blender.debris import debris_object
from softground_addon.blender.operators import prediction
from softground_addon.blender.settings import exists
from tests.blender import grounds, responders
from tests.blender.redraws import empty, fill, least_seconds, redraw, walk_over_all_objects
from tests.tiers import slow_but_one

OBJECTS = 10_000


def nothing_baked(scene):
    grounds.field(scene)


def baked_on_a_copy(scene):
    grounds.field(scene)
    bpy.ops.softground.bake()


def baked_with_a_response(scene):
    responders.bake(scene)


def baked_with_debris(scene):
    scene.softground.debris = True
    grounds.field(scene)
    bpy.ops.softground.bake()
    assert debris_object.of(scene.softground.ground) is not None


def live(scene):
    grounds.field(scene)
    bpy.ops.softground.live()


def copy_deleted(scene):
    baked_on_a_copy(scene)
    bpy.context.active_object.select_set(True)
    bpy.ops.object.delete()


@pytest.mark.alone
@pytest.mark.parametrize(
    "set_up",
    slow_but_one([nothing_baked, baked_on_a_copy, baked_with_a_response, baked_with_debris, live, copy_deleted]),
)
def test_nothing_that_is_asked_at_a_redraw_walks_over_all_objects(short_walk, set_up):
    set_up(short_walk)
    bpy.ops.softground.predict_depth()
    redraw(bpy.context)
    longer = []  # in parts of such a walk; a machine that slows down between two looks would seem to depend on them
    while len(longer) < 4 and min(longer, default=1.0) > 1 / 5:
        before = least_seconds(redraw, bpy.context)
        fill(short_walk, OBJECTS)
        redraw(bpy.context)
        longer.append((least_seconds(redraw, bpy.context) - before) / least_seconds(walk_over_all_objects))
        empty()
        redraw(bpy.context)
    assert min(longer) < 1 / 5


def test_a_redraw_takes_the_settings_down_once(short_walk, monkeypatch):
    baked_on_a_copy(short_walk)
    bpy.ops.softground.predict_depth()
    snapshot = MagicMock(side_effect=settings.snapshot)
    monkeypatch.setattr(settings, "snapshot", snapshot)
    redraw(bpy.context)
    assert snapshot.call_count == 1
    short_walk.softground.material.youngs_modulus *= 2
    redraw(bpy.context)
    assert snapshot.call_count == 2
    assert not prediction.look(short_walk)[1].is_current


def test_who_is_deleted_in_the_viewport_and_comes_back_is_there_again(scene):
    thing = scene.softground.ground = bpy.data.objects.new("Field", bpy.data.meshes.new("Field"))
    assert not exists(thing)
    scene.collection.objects.link(thing)
    assert exists(thing)
    scene.collection.objects.unlink(thing)
    assert not exists(thing)
    scene.collection.objects.link(thing)
    assert exists(thing)
