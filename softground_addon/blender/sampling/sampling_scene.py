"""The scene in which a rig is read, and what is looked up in it by name after each pause."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, cast

import bpy

from ...core.errors import InputError
from ..compat import remove_scene
from ..rigs.object_data import mesh_of
from .frame_handlers import handlers_silent, let_handlers_act

TEMPORARY = "SoftGround Sampling"
"""Name of what exists only while a rig is read."""

IS_TEMPORARY = "softground_is_temporary"
"""Property of the scenes in which rigs are read, by which those that were left over are told from the user's."""

_SCENE_TIME = ("fps", "fps_base", "frame_map_old", "frame_map_new")
"""Render settings that decide which time a frame number means."""


@contextmanager
def temporary_scene() -> Iterator[bpy.types.Scene]:
    """A new scene, marked as ours and gone afterwards, unless an undo or a new file has taken it away before."""
    scene = bpy.data.scenes.new(TEMPORARY)
    name = scene.name
    scene[IS_TEMPORARY] = True
    try:
        yield scene
    finally:
        if (remaining := bpy.data.scenes.get(name)) is not None:
            with handlers_silent():
                remove_scene(remaining)


@contextmanager
def sampling_scene(
    scene: bpy.types.Scene,
    armature: str,
    bones: Sequence[str],
    props: Sequence[str],
    shapes: Sequence[tuple[str, str]] = (),
    *,
    meshes: Sequence[str] = (),
    handled: bool = False,
) -> Iterator[str]:
    """Name of a scene in which only the given bones, objects and shape keys are evaluated, and the meshes of some.

    It is gone afterwards, whatever happens.

    It holds a probe that depends on them instead of themselves: so they are evaluated even where the user hides them,
    and the objects' meshes are not. What `handled` handlers set in the user's data ends as at the frame that is shown.
    """
    shown = scene.frame_current, scene.frame_subframe
    with temporary_scene() as temporary:
        probe = bpy.data.objects.new(TEMPORARY, None)
        names = temporary.name, probe.name
        try:
            for setting in _SCENE_TIME:
                setattr(temporary.render, setting, getattr(scene.render, setting))
            of_vertices = ((obj, "any vertices") for obj in meshes)  # depends on the mesh, if no group has that name
            for obj, bone in (*((armature, bone) for bone in bones), *((obj, "") for obj in props), *of_vertices):
                dependence: Any = probe.constraints.new("COPY_LOCATION")
                dependence.target, dependence.subtarget = object_named(obj), bone
            for obj, key in shapes:
                driver = cast("Any", probe.driver_add("location", 0)).driver
                driver.type = "SUM"
                follows = driver.variables.new().targets[0]
                follows.id_type, follows.id = "KEY", mesh_of(object_named(obj)).shape_keys
                follows.data_path = follows.id.key_blocks[key].path_from_id("value")
            temporary.collection.objects.link(probe)
            yield names[0]
        finally:
            left_scene = bpy.data.scenes.get(names[0])
            if left_scene is not None and handled:
                let_handlers_act(left_scene, *shown)
            if (left_probe := bpy.data.objects.get(names[1])) is not None:
                with handlers_silent():
                    bpy.data.objects.remove(left_probe)


@contextmanager
def user_scene(scene: bpy.types.Scene) -> Iterator[str]:
    """Name of the user's scene, which is put back to its frame afterwards."""
    shown = scene.frame_current, scene.frame_subframe
    name = scene.name
    try:
        yield name
    finally:
        remaining = bpy.data.scenes.get(name)
        if remaining is not None:
            with handlers_silent():
                remaining.frame_set(shown[0], subframe=shown[1])


def still_there(name: str) -> bpy.types.Scene:
    """The scene of that name, in which a rig is being read; InputError if an undo or a new file has taken it away."""
    scene = bpy.data.scenes.get(name)
    if scene is None:
        raise InputError("The rig cannot be read any further: the scene was undone or reloaded. Start again.")
    return scene


def depsgraph_at(name: str, frame: int) -> bpy.types.Depsgraph:
    """What the scene of that name evaluates to at a frame; raises as `still_there` does."""
    scene = still_there(name)
    with handlers_silent():
        scene.frame_set(frame)
    depsgraph = scene.view_layers[0].depsgraph
    assert depsgraph is not None
    return depsgraph


def object_named(name: str) -> bpy.types.Object:
    """Object by its full name, which tells linked ones from local ones."""
    block = bpy.data.objects.get(name)
    if block is None or block.name_full != name:
        block = next((obj for obj in bpy.data.objects if obj.name_full == name), None)
    if block is None:
        raise InputError(f"Object '{name}' was deleted: choose another one for the character.")
    return block
