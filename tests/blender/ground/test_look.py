"""The look follows the preset where SoftGround made the material, and goes over the user's own only when asked."""

import bpy
import pytest

from softground_addon.blender.ground import baked_ground
from softground_addon.blender.materials.materials import MARK, OVER
from softground_addon.blender.panels import preset_menu
from softground_addon.core.ground import presets
from tests.blender.grounds import field, plane


def surfaces(ground):
    return [slot.material and slot.material.get(MARK) for slot in baked_ground.display_mesh_of(ground).material_slots]


def test_a_preset_changes_the_material_that_softground_made_before_and_after_a_bake(short_walk):
    bpy.ops.softground.create_ground()
    ground = short_walk.softground.ground
    assert surfaces(ground) == ["snow"]
    bpy.ops.softground.load_preset(name="Mud")
    assert surfaces(ground) == ["mud"]
    bpy.ops.softground.bake()
    short_walk.softground.material.surface = "soil"
    assert surfaces(ground) == ["soil"]
    mine = ground.data.materials[0] = ground.data.materials[0].copy()
    del mine[MARK]  # which makes it a choice of its own
    bpy.ops.softground.load_preset(name="Snow")
    assert surfaces(ground) == [None]


@pytest.fixture
def theirs(short_walk):
    """The user's terrain with a material of theirs, coarse, so that a copy takes the prints."""
    ground = short_walk.softground.ground = plane(short_walk)
    material = bpy.data.materials.new("Meadow")
    material.use_nodes = True
    ground.data.materials.append(material)
    return material


@pytest.mark.slow
def test_a_material_of_the_user_s_stays_until_the_look_is_asked_for(short_walk, theirs):
    bpy.ops.softground.bake()
    ground = short_walk.softground.ground
    bpy.ops.softground.load_preset(name="Mud")
    assert surfaces(ground) == [None]
    nodes = len(theirs.node_tree.nodes)
    bpy.ops.softground.apply_look()
    (slot,) = baked_ground.display_mesh_of(ground).material_slots
    assert (slot.material.get(OVER), slot.material[MARK]) == (theirs, "mud over")
    assert len(theirs.node_tree.nodes) == nodes

    output = slot.material.node_tree.get_output_node("ALL")
    mix = output.inputs["Surface"].links[0].from_node
    assert mix.type == "MIX_SHADER"
    assert [link.from_node.type for socket in mix.inputs[1:] for link in socket.links] == ["BSDF_PRINCIPLED"] * 2
    assert output.inputs["Displacement"].links

    bpy.ops.softground.load_preset(name="Soil")
    assert surfaces(ground) == ["soil over"]
    assert [material.name for material in bpy.data.materials if material.get(MARK) == "mud over"] == []
    bpy.ops.softground.bake()
    assert surfaces(ground) == ["soil over"]
    bpy.ops.softground.clear_bake()
    assert ground.material_slots[0].material == theirs


@pytest.mark.parametrize("detail", ["NEVER", "ALWAYS"])
def test_clear_bake_gives_the_user_s_materials_back(short_walk, theirs, detail):
    options = short_walk.softground
    options.detail = detail
    bpy.ops.softground.apply_look()
    bpy.ops.softground.bake()
    assert surfaces(options.ground) == ["snow over"]
    bpy.ops.softground.clear_bake()
    assert options.ground.material_slots[0].material == theirs


def test_a_ground_without_a_material_gets_the_add_on_s(short_walk):
    ground = short_walk.softground.ground = plane(short_walk)
    bpy.ops.softground.apply_look()
    assert surfaces(ground) == ["snow"]


def test_no_look_without_a_ground(scene):
    assert not bpy.ops.softground.apply_look.poll()


def test_the_menu_says_that_a_preset_was_modified(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(preset_menu, "user_folder", lambda: tmp_path)
    material = scene.softground.material
    assert preset_menu.title_of_ground(scene.softground) == "Snow"
    for path in sorted(presets.FOLDER.glob("*.json")):
        bpy.ops.softground.load_preset(filepath=str(path))
        assert preset_menu.title_of_ground(scene.softground) == material.preset
    material.youngs_modulus *= 1.01
    assert preset_menu.title_of_ground(scene.softground) == f"{material.preset} (modified)"
    bpy.ops.softground.save_preset(name="My Bog")
    assert preset_menu.title_of_ground(scene.softground) == "My Bog"
    scene.softground.tread = 0.001
    assert preset_menu.title_of_ground(scene.softground) == "My Bog (modified)"
    bpy.ops.softground.remove_preset()
    assert preset_menu.title_of_ground(scene.softground) == "My Bog"


def test_clear_leaves_no_mixed_material_of_a_ground_with_a_finer_copy(short_walk):
    ground = field(short_walk)
    mine = bpy.data.materials.new("Grass")
    ground.data.materials.append(mine)
    users = mine.users
    bpy.ops.softground.bake()
    assert baked_ground.display_mesh_of(ground) != ground
    assert bpy.ops.softground.apply_look() == {"FINISHED"}
    assert any(material.get(OVER) == mine for material in bpy.data.materials)
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert not any(material.get(OVER) for material in bpy.data.materials)
    assert mine.users == users


def test_clear_takes_a_look_off_a_ground_without_a_bake(short_walk):
    ground = field(short_walk)
    mine = bpy.data.materials.new("Grass")
    ground.data.materials.append(mine)
    users = mine.users
    assert not bpy.ops.softground.clear_bake.poll()
    assert bpy.ops.softground.apply_look() == {"FINISHED"}
    assert ground.data.materials[0].get(OVER) == mine
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert (ground.data.materials[0], mine.users) == (mine, users)
    assert not any(material.get(OVER) for material in bpy.data.materials)
    assert not bpy.ops.softground.clear_bake.poll()
