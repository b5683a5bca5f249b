"""A body for rigs without one: sticks that hang together and follow their bones."""

import numpy as np
import pytest


@pytest.fixture
def figure(scene):
    from sample_scenes.body import Body
    from sample_scenes.character import create_armature
    from sample_scenes.gait import Gait, walk
    from sample_scenes.keys import write_action
    from sample_scenes.stick_figure import add_stick_figure

    armature = create_armature("Rig", Body(), scene.collection)
    write_action(armature, walk(Body(), Gait(), 10), "Walk")
    return add_stick_figure(armature, scene.collection)


def test_every_vertex_follows_one_bone(figure):
    for vertex in figure.data.vertices:
        assert [group.weight for group in vertex.groups] == [1.0]


def test_every_bone_has_its_stick_around_it_as_the_rig_moves(figure, scene):
    import bpy

    scene.frame_set(8)
    posed = figure.evaluated_get(bpy.context.evaluated_depsgraph_get())
    places = np.array([vertex.co for vertex in posed.data.vertices])
    owner = np.array([vertex.groups[0].group for vertex in figure.data.vertices])
    for bone in figure.parent.pose.bones:
        of_bone = places[owner == figure.vertex_groups[bone.name].index]
        for end in (bone.head, bone.tail):
            assert np.linalg.norm(of_bone - np.array(end), axis=1).min() < 0.08


def test_a_rig_without_bones_gets_no_figure(scene):
    import bpy

    from sample_scenes.stick_figure import add_stick_figure

    empty = bpy.data.objects.new("Empty", bpy.data.armatures.new("Empty"))
    scene.collection.objects.link(empty)
    assert add_stick_figure(empty, scene.collection) is None
