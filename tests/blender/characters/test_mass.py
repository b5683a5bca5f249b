"""The mass of a character by the volume of its skin."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from softground_addon.blender.characters import import_fixes
from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.characters.contact_editing import add_bone_contacts, add_object_contacts
from softground_addon.blender.characters.import_fixes import has_legs
from softground_addon.blender.reading import analysis
from softground_addon.blender.setup.character_editing import suggested_mass
from tests.blender import shots
from tests.blender.baking.test_self_check import codes
from tests.blender.characters.random_animals import Animal, make
from tests.blender.characters.test_recognition import box
from tests.blender.grounds import bake

PERSON = 77.0
"""What the walker weighs, whatever its pose [kg]."""


def added(scene):
    bpy.context.view_layer.update()
    bpy.ops.softground.add_character()
    return scene.softground.characters[0]


def mesh_on(armature, name, vertices, faces, bone, *, hung=False):
    """A mesh that a bone carries, deformed with it or as an object of its own."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(vertices).tolist(), [], [list(face) for face in faces])
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    thing.parent = armature
    if hung:
        thing.parent_type, thing.parent_bone = "BONE", bone
    else:
        thing.modifiers.new("Armature", "ARMATURE").object = armature
        thing.vertex_groups.new(name=bone).add(range(len(vertices)), 1.0, "REPLACE")
    return thing


def cylinder(radius, low, high, share=1.0):
    """An upright sheet around the z axis, closed where its share of the way around is 1."""
    angle = np.linspace(0, 2 * np.pi * share, 25)
    ring = np.stack([radius * np.sin(angle), radius * np.cos(angle)], -1)
    vertices = np.concatenate([np.column_stack([ring, np.full(25, z)]) for z in np.linspace(low, high, 9)])
    a = (np.arange(8)[:, None] * 25 + np.arange(24)).ravel()
    return vertices, np.stack([a, a + 1, a + 26, a + 25], -1)


def test_a_person_weighs_what_people_weigh(scene):
    shots.walker(scene)
    character = added(scene)
    assert 60 < character.mass * (1.75 / 1.78) ** 3 < 90
    assert character.mass == character.skin_mass


@pytest.mark.parametrize("animated", [True, False])
@pytest.mark.parametrize(("scale", "unit"), [(0.05, 1.0), (5.0, 1.0), (100.0, 0.01), (1.0, 10.0)])
def test_mice_and_giants_weigh_by_their_volume_without_asking(scene, scale, unit, animated):
    armature = shots.walker(scene)
    if not animated:
        armature.animation_data_clear()
    armature.scale = (scale, scale, scale)
    scene.unit_settings.scale_length = unit
    size = scale * unit
    assert added(scene).mass == pytest.approx(PERSON * size**3, rel=0.05)
    if animated and size > 1:
        scene.softground.cell_size = 0.02 * size
        assert "mass_of_size" not in codes(bake(scene).report)


def test_what_is_worn_over_the_body_or_carried_weighs_nothing(scene):
    armature = shots.walker(scene)
    bones = armature.data.bones
    hips, chest, head, hand = (
        next(bone.name for bone in bones if word in bone.name.lower()) for word in ("hips", "chest", "head", "hand")
    )
    mesh_on(armature, "Cape", *cylinder(0.3, 0.2, 1.4, 0.5), chest)
    mesh_on(armature, "Skirt", *cylinder(0.4, 0.4, 1.0), hips)
    mesh_on(armature, "Helmet", *cylinder(0.14, 1.5, 1.75), head)
    box("mask", 0.1, (0.0, -0.12, 1.65), armature, head)
    mesh_on(armature, "Shield", *cylinder(0.4, -0.1, 0.1), hand, hung=True)
    assert added(scene).mass == pytest.approx(PERSON, rel=0.05)


def test_a_closed_skirt_weighs_nothing(scene):
    armature = shots.walker(scene)
    vertices, faces = cylinder(0.4, 0.3, 1.0)
    caps = [[*range(ring * 25, ring * 25 + 24)][:: 1 if ring else -1] for ring in (0, 8)]
    mesh_on(armature, "Skirt", vertices, [*faces.tolist(), *caps], "hips")
    assert added(scene).mass == pytest.approx(PERSON, rel=0.1)


def test_a_rig_without_a_mesh_weighs_what_the_field_says(scene):
    figure = shots.walker(scene).children[0]
    bpy.data.objects.remove(figure)
    character = added(scene)
    assert (character.mass, character.skin_mass) == (77.5, 0.0)
    with pytest.raises(RuntimeError, match="'Walker' has no skin to go by: type its mass"):
        bpy.ops.softground.mass_by_volume()


def test_the_panel_suggests_the_mass_where_the_field_differs_much(scene):
    shots.walker(scene)
    character = added(scene)
    assert not suggested_mass(character)
    character.mass = 7.0
    assert suggested_mass(character) == character.skin_mass
    bpy.ops.softground.mass_by_volume()
    assert character.mass == character.skin_mass
    assert not suggested_mass(character)


def test_the_size_is_said_that_makes_a_body_heavy_when_it_is_added_and_where_its_mass_is_questioned(scene, capfd):
    """An animal of 2 t is 8 m long in its file: scaling is the remedy, not its mass."""
    shots.walker(scene).scale = (5.0, 5.0, 5.0)
    bpy.context.view_layer.update()
    character = added(scene)
    size = import_fixes.sizes_of(1.0, character)[1]
    assert 8.0 < size < 9.0
    assert f"{size:.2g} m in size, {character.mass:g} kg" in capfd.readouterr().out


def test_a_mass_that_does_not_suit_the_body_is_pointed_out(short_walk):
    character = short_walk.softground.characters[0]
    character.mass = 10 * character.skin_mass
    (finding,) = [each for each in bake(short_walk).report["self_check"] if each["code"] == "mass_of_size"]
    assert f"the volume of its skin suggests about {character.skin_mass:g} kg" in finding["message"]
    assert "' is 1.8 m in size and weighs" in finding["message"]
    assert "scale" in finding["remedy"]


def test_a_body_scaled_after_it_was_added_is_weighed_at_its_new_size(short_walk):
    character = short_walk.softground.characters[0]
    character.armature.scale = (0.1, 0.1, 0.1)
    bpy.context.view_layer.update()
    short_walk.softground.cell_size = 0.002
    (finding,) = [each for each in bake(short_walk).report["self_check"] if each["code"] == "mass_of_size"]
    assert f"about {character.skin_mass / 1000:.2g} kg" in finding["message"]


def test_a_large_head_on_two_legs_weighs_what_a_person_does_and_its_volume_is_questioned(scene):
    armature = shots.walker(scene, frames=30)
    head = next(bone for bone in armature.data.bones if "head" in bone.name.lower())
    box("Head", 1.0, tuple(head.tail_local), armature, head.name)
    character = added(scene)
    assert character.skin_mass > 900
    assert character.mass == pytest.approx(PERSON, rel=0.1)  # of a height that no joint tells
    assert not suggested_mass(character)
    scene.softground.cell_size = 0.02
    character.mass = character.skin_mass
    assert suggested_mass(character) == pytest.approx(PERSON, rel=0.1)
    assert "mass_of_size" in codes(bake(scene).report)
    bpy.ops.softground.clear_bake()
    bpy.ops.softground.mass_by_volume()
    assert character.mass == pytest.approx(PERSON, rel=0.1)
    assert not suggested_mass(character)
    assert "mass_of_size" not in codes(bake(scene).report)


@pytest.mark.parametrize("what", ["hand", "cane"])
def test_what_prints_beside_the_feet_leaves_the_skin_as_heavy_as_it_is(scene, what):
    shots.walker(scene, frames=30)
    character = added(scene)
    if what == "hand":
        add_bone_contacts(character, ["hand.L"])
    else:
        cane = mesh_on(character.armature, "Cane", *cylinder(0.02, -0.9, 0.1), "hand.L", hung=True)
        add_object_contacts(scene.softground, character, [cane])
    bpy.context.view_layer.update()
    (motion,) = analysis.read(scene).shot.motions
    assert motion.skin.mass == pytest.approx(character.skin_mass, rel=1e-3)


def test_joints_put_right_leave_the_skin_as_heavy_as_it_is(scene):
    shots.walker(scene, frames=30)
    character = added(scene)
    for side in "lr":
        character.joints[f"ankle_{side}"].bone = f"toe.{side.upper()}"
        character.joints[f"hip_{side}"].bone = f"shoulder.{side.upper()}"
    (motion,) = analysis.read(scene).shot.motions
    assert motion.skin.mass == pytest.approx(character.skin_mass, rel=1e-3)


def test_an_animal_whose_front_legs_have_no_names_is_no_person(scene):
    animal = replace(Animal.drawn(3), legs=4, names="half", foot="chain", unit=1.0, size=1.0)
    character = add_character(scene, make(animal)[0])
    assert len(character.soles) == 4
    assert {"hip_l", "knee_l", "ankle_l"} <= {*character.joints.keys()}
    assert not has_legs(character)


def test_shoes_on_a_body_of_curves_do_not_tell_its_mass(scene):
    armature = shots.walker(scene, frames=30)
    bpy.data.objects.remove(armature.children[0])
    for side in "LR":
        mesh_on(armature, "Shoe", *cylinder(0.05, 0.0, 0.1), f"foot.{side}", hung=True)
    character = added(scene)
    assert character.skin_mass == 0
    assert character.mass == pytest.approx(77.5)
