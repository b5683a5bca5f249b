"""Random sessions on grounds that are full of the user's own: whatever was baked, Clear gives the bytes back."""

import random

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import step_edits
from softground_addon.blender.ground import ground_mesh
from softground_addon.blender.live import live
from softground_addon.blender.playback import own_data
from softground_addon.core.errors import InputError
from softground_addon.core.record.edits import StepEdit, step_id
from tests.blender import fingerprints, shots
from tests.blender.grounds import plane

MODIFIERS = ("MULTIRES", "SOFT_BODY", "SUBSURF", "TRIANGULATE", "COLLISION", "DISPLACE")
KINDS = (
    ("FLOAT", "POINT"),
    ("FLOAT_VECTOR", "POINT"),
    ("INT", "FACE"),
    ("BOOLEAN", "POINT"),
    ("FLOAT_COLOR", "CORNER"),
)
NAMES = ("mine", "softground_mine", "softground_", ground_mesh.RECORD.upper(), "SoftGround Display")


def random_ground(chance, scene, folder):
    """A ground with modifiers, attributes, properties, groups and shape keys of the user's; or a linked one."""
    ground = scene.softground.ground = plane(scene, size=5.0, vertices=chance.choice([3, 60, 120]))
    mesh = ground.data
    for kind in chance.sample(MODIFIERS, chance.choice([0, 0, 1, 2])):
        ground.modifiers.new(kind.title(), kind)
    names = [*NAMES, *(chance.sample(own_data.ATTRIBUTES, 1) if chance.random() < 0.15 else ())]
    for name in chance.sample(names, chance.randint(0, len(names))):
        attribute = mesh.attributes.new(name, *chance.choice(KINDS))
        if attribute.data_type == "FLOAT":
            attribute.data.foreach_set("value", np.random.default_rng(1).random(len(attribute.data), np.float32))
    if chance.random() < 0.5:
        mesh["softground_note"], ground["softground_note"] = "mine", [1, 2]
    if chance.random() < 0.1:
        mesh[chance.choice(own_data.PROPERTIES)] = chance.choice([1, "mine", [1, 2, 3]])
    if chance.random() < 0.1:
        for name in ("Basis", chance.choice(NAMES)):
            ground.shape_key_add(name=name).value = 0.5
    if chance.random() < 0.3:
        ground.vertex_groups.new(name="softground_rim").add([0, 1, 2], 0.5, "REPLACE")
    if chance.random() < 0.1:
        mesh.use_fake_user = True
    if chance.random() < 0.15:
        link_mesh(scene, ground, folder)
    scene.softground.detail = chance.choice(["AUTO", "AUTO", "ALWAYS", "NEVER"])
    scene.softground.shape_keys = chance.random() < 0.5
    scene.softground.tread = chance.choice([0.0, 0.003])
    for option in ("debris", "sink_feet", "steps_feel_weather"):
        setattr(scene.softground, option, chance.random() < 0.5)
    return ground


def link_mesh(scene, ground, folder):
    """Let the ground's mesh come from another file."""
    bpy.data.libraries.write(str(folder / "library.blend"), {ground.data})
    with bpy.data.libraries.load(str(folder / "library.blend"), link=True) as (_, wanted):
        wanted.meshes = [ground.data.name]
    ground.data = wanted.meshes[0]


def pressed(operator, **values):
    """Press a button: whether it did what it says; else nothing has changed."""
    before, said = fingerprints.of_file(), ""
    try:
        return operator(**values) == {"FINISHED"}
    except RuntimeError as error:
        said = str(error)
    assert "Traceback" not in said
    assert fingerprints.of_file() == before
    return False


def edit_a_step(chance, scene):
    """Change a step of the bake, where there is one that can be."""
    try:
        bake = jobs.run(step_edits.reading(scene))
        name = step_id(chance.choice(bake.record.footprints))
        jobs.run(
            step_edits.editing(bake, {name: StepEdit(mute=chance.random() < 0.3, move_m=(0.05, 0.0), strength=0.5)})
        )
    except InputError:
        pass


def session(chance, folder):
    """A few bakes on one ground, then Clear; whether any was one."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=20)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.05
    random_ground(chance, scene, folder)
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    done = False
    for _ in range(chance.randint(1, 3)):
        if chance.random() < 0.25:
            if pressed(bpy.ops.softground.live):
                scene.frame_set(15)
                bpy.ops.softground.live(keep=chance.random() < 0.5)
                done = True
        else:
            done |= pressed(bpy.ops.softground.bake)
        if done and chance.random() < 0.5:
            pressed(bpy.ops.softground.add_weather)
        if done and chance.random() < 0.5:
            edit_a_step(chance, scene)
        scene.softground.detail = chance.choice(["AUTO", "ALWAYS", "NEVER"])
        scene.frame_set(1)
    if live.is_on():
        bpy.ops.softground.live()
    pressed(bpy.ops.softground.clear_bake)
    after = fingerprints.of_file()
    for kind in before:
        assert after[kind] == before[kind], kind
    return done


@pytest.mark.parametrize(
    "numbers",
    [
        range(3),
        pytest.param(range(3, 13), marks=[pytest.mark.slow]),
        *(pytest.param(range(first, first + 25), marks=[pytest.mark.marathon]) for first in range(0, 100, 25)),
    ],
    ids=lambda numbers: f"{numbers.start}-{numbers.stop}",
)
def test_after_clear_every_byte_is_as_before(addon, tmp_path, numbers):
    done = [session(random.Random(number), tmp_path) for number in numbers]
    assert any(done)
