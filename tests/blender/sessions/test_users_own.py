"""What is the user's own on a ground stays so: data under a bake's names, and modifiers that none may precede."""

import bpy
import pytest

from softground_addon.blender import mesh_arrays
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.playback import own_data, playback
from tests.blender import fingerprints
from tests.blender.grounds import field, refusal
from tests.tiers import slow_but_one

FINE = {"vertices": 150, "size": 5.0}


@pytest.mark.slow
@pytest.mark.parametrize("name", own_data.ATTRIBUTES)
def test_attributes_of_the_users_that_a_bake_would_need_are_named_and_stay(short_walk, name):
    ground = field(short_walk, **FINE)
    kind, domain = ("FLOAT_VECTOR", "POINT") if name == own_data.REST else ("INT", "FACE")
    ground.data.attributes.new(name, kind, domain)
    before = fingerprints.of_file()
    for detail in ("AUTO", "ALWAYS"):
        short_walk.softground.detail = detail
        assert f"data of its own called '{name}'" in refusal(bpy.ops.softground.bake)
    assert not ground_mesh.has_remains(ground)
    baked_ground.clear(ground)
    assert fingerprints.of_file() == before


def test_a_vertex_group_of_the_users_that_is_called_as_an_attribute_is_named_and_stays(short_walk):
    ground = field(short_walk, **FINE)
    ground.vertex_groups.new(name=own_data.RIM)
    before = fingerprints.of_file()
    assert f"data of its own called '{own_data.RIM}'" in refusal(bpy.ops.softground.bake)
    baked_ground.clear(ground)
    assert fingerprints.of_file() == before


@pytest.mark.parametrize("name", own_data.PROPERTIES)
def test_properties_of_the_users_that_a_bake_would_need_are_named_and_stay(short_walk, name):
    ground = field(short_walk, **FINE)
    ground.data[name] = "mine"
    before = fingerprints.of_file()
    assert f"data of its own called '{name}'" in refusal(bpy.ops.softground.bake)
    baked_ground.clear(ground)
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_what_the_user_makes_after_the_bake_under_such_a_name_stays_and_is_told_of(short_walk):
    short_walk.softground.shape_keys = False  # without which a bake needs fewer attributes
    ground = field(short_walk, **FINE)
    bpy.ops.softground.bake()
    assert baked_ground.display_mesh_of(ground) == ground
    for name in (own_data.SOLE, playback.nodes.LAST_HEIGHT):
        assert name not in ground.data.attributes
        ground.data.attributes.new(name, "FLOAT", "POINT")
    ground.data.attributes.new("softground_mine", "FLOAT", "POINT")
    assert f"called '{own_data.SOLE}'" in refusal(bpy.ops.softground.bake)
    bpy.ops.softground.clear_bake()
    remains = [name for name in ground.data.attributes.keys() if name.startswith("softground")]  # noqa: SIM118
    assert remains == [own_data.SOLE, playback.nodes.LAST_HEIGHT, "softground_mine"]


def test_attributes_of_the_users_come_along_to_the_copy_whatever_they_are_called(short_walk):
    short_walk.softground.detail = "ALWAYS"
    ground = field(short_walk, **FINE)
    ground.data.attributes.new("softground_mine", "FLOAT", "POINT")
    bpy.ops.softground.bake()
    assert "softground_mine" in baked_ground.display_mesh_of(ground).data.attributes


def test_the_modifier_that_the_user_works_at_stays_active(short_walk):
    ground = field(short_walk, **FINE)
    for name in ("One", "Two"):
        ground.modifiers.new(name, "TRIANGULATE")
    before = fingerprints.of_file()
    for _ in range(2):
        bpy.ops.softground.bake()
        assert ground.modifiers.active.name == "Two"
    bpy.ops.softground.clear_bake()
    assert fingerprints.of_file() == before


@pytest.mark.slow
@pytest.mark.parametrize("kind", playback.NEED_THE_MESH)
def test_a_fine_ground_whose_modifier_none_may_precede_gets_a_copy(short_walk, kind):
    ground = field(short_walk, **FINE)
    ground.modifiers.new("Theirs", kind)
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    short_walk.softground.detail = "NEVER"
    assert "'Theirs' of ground 'Field' keeps prints from playing" in refusal(bpy.ops.softground.bake)
    assert fingerprints.of_file() == before
    short_walk.softground.detail = "AUTO"
    assert bpy.ops.softground.bake() == {"FINISHED"}
    display_mesh = baked_ground.display_mesh_of(ground)
    assert display_mesh != ground
    assert any("keeps prints from playing" in warning for warning in ground_mesh.warnings_of(display_mesh))
    bpy.ops.softground.bake()
    display_mesh = baked_ground.display_mesh_of(ground)
    display_mesh.modifiers.new("Later", kind)
    baked = fingerprints.of_file()
    assert "'Later' of 'Field Trail' keeps prints from playing" in refusal(bpy.ops.softground.bake)
    assert fingerprints.of_file() == baked
    bpy.ops.softground.clear_bake()
    assert fingerprints.of_file() == before


def test_these_are_all_the_modifiers_that_none_may_precede(scene):
    ground = field(scene)
    stubborn = []
    for kind in bpy.types.Modifier.bl_rna.properties["type"].enum_items.keys():  # noqa: SIM118
        try:
            other = ground.modifiers.new("Theirs", kind)
        except TypeError:  # of other kinds of objects
            continue
        if other is None:
            continue
        ground.modifiers.new("Playback", "NODES")
        try:
            ground.modifiers.move(1, 0)
        except RuntimeError:
            stubborn.append(kind)
        ground.modifiers.clear()
    assert sorted(stubborn) == sorted(playback.NEED_THE_MESH)


@pytest.mark.parametrize("part", ["attach", "write_shading"])
def test_whatever_fails_while_the_ground_is_written_it_is_given_back(short_walk, monkeypatch, part):
    def fail(*_arguments, **_named):
        raise MemoryError(part)

    short_walk.softground.tread = 0.003
    field(short_walk, **FINE)
    before = fingerprints.of_file()
    monkeypatch.setattr(playback if part == "attach" else ground_mesh, part, fail)
    with pytest.raises(RuntimeError, match="MemoryError"):
        bpy.ops.softground.bake()
    assert fingerprints.of_file() == before


def played_heights(scene, shown):
    """What the playback makes of a ground, at some frames."""
    played = []
    for frame in (1, 12, 30):
        scene.frame_set(frame)
        mesh = shown.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        played.append(mesh_arrays.positions(mesh).tobytes())
    scene.frame_set(1)
    return played


@pytest.mark.parametrize("shape_keys", slow_but_one([True, False]))
@pytest.mark.parametrize("copied", slow_but_one([False, True]))
@pytest.mark.parametrize("part", slow_but_one(["attach", "write_shading"]))
def test_a_bake_that_fails_while_it_is_written_leaves_the_one_before(short_walk, monkeypatch, part, copied, shape_keys):
    def fail(*_arguments, **_named):
        raise MemoryError(part)

    options = short_walk.softground
    options.tread, options.shape_keys = 0.003, shape_keys
    ground = field(short_walk, **({} if copied else FINE))
    options.detail = "AUTO"
    assert bpy.ops.softground.bake() == {"FINISHED"}
    shown = baked_ground.display_mesh_of(ground)
    assert (shown != ground) == copied
    users_key = shown.shape_key_add(name="Theirs") if shape_keys else None
    if users_key:
        users_key.points[3].co.z += 0.123
    before, played = fingerprints.of_file(), played_heights(short_walk, shown)
    options.material.youngs_modulus *= 0.5
    monkeypatch.setattr(playback if part == "attach" else ground_mesh, part, fail)
    with pytest.raises(RuntimeError, match="MemoryError"):
        bpy.ops.softground.bake()
    assert fingerprints.of_file() == before
    assert played_heights(short_walk, shown) == played
    monkeypatch.undo()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert played_heights(short_walk, shown) != played
