"""The figure: closed, fully weighted, on soles of the size of a person's."""

import numpy as np
import pytest

from sample_scenes.body import BONES, SIDES, Body, Foot
from sample_scenes.figure import PARTS, hiker
from sample_scenes.gait import Gait, walk
from sample_scenes.motion import joint_paths
from sample_scenes.shoe import outline_width, shoe_mesh
from tests.tiers import slow_but_one

BODIES = [
    Body(),
    Body(stature=1.2, mass=24.0, foot=Foot(0.19, 0.075)),
    Body(stature=2.1, mass=286.0, foot=Foot(0.40, 0.16)),
]


@pytest.fixture(params=slow_but_one(BODIES))
def body(request):
    return request.param


def directed_edges(quads):
    edges = np.concatenate([np.stack([quads[:, i], quads[:, (i + 1) % 4]], axis=1) for i in range(4)])
    return edges[edges[:, 0] != edges[:, 1]]


def enclosed_volume(vertices, quads):
    triangles = np.concatenate([quads[:, (0, 1, 2)], quads[:, (0, 2, 3)]])
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def test_every_edge_has_one_face_on_either_side(body):
    edges = directed_edges(hiker(body).quads)
    forward, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 1).all()
    assert {tuple(edge) for edge in forward} == {(b, a) for a, b in forward}


def test_faces_point_outward_and_enclose_a_persons_volume():
    figure = hiker(Body())
    # 77.5 kg at about 1 g/cm³; the clothes are loose and garments overlap where they tuck in.
    assert 0.060 < enclosed_volume(figure.vertices, figure.quads) < 0.110
    for part in np.unique(figure.parts):
        if PARTS[part] not in ("shoe", "sole"):  # upper and sole close only together
            assert enclosed_volume(figure.vertices, figure.quads[figure.parts == part]) > 0


def test_weights_of_every_vertex_sum_to_one(body):
    weights = hiker(body).weights
    assert weights.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert weights.min() >= 0.0


def test_a_side_moves_only_its_own_limbs():
    figure = hiker(Body())
    for side, sign in SIDES.items():
        limbs = [i for i, bone in enumerate(BONES) if bone.endswith(f".{side}")]
        far = sign * figure.vertices[:, 1] < -0.03
        assert figure.weights[far][:, limbs].max() == 0.0


def test_figure_stands_on_the_ground_at_its_stature(body):
    vertices = hiker(body).vertices
    assert vertices[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert vertices[:, 2].max() == pytest.approx(body.stature, rel=0.03)  # a cap comes on top


def test_sole_has_the_area_of_a_persons_and_scales_with_the_foot():
    def area(foot):
        x = np.linspace(foot.back, foot.front, 4000)
        inner, outer = outline_width(foot, x)
        return (inner - outer).mean() * foot.length

    assert area(Foot()) == pytest.approx(200e-4, rel=0.05)
    assert area(Foot(0.14, 0.049)) == pytest.approx(area(Foot()) / 4, rel=1e-3)


def test_underside_is_flat_from_heel_to_toes_but_for_the_tread():
    foot = Foot()
    vertices, _, _ = shoe_mesh(foot)
    x, y, z = vertices.T
    inner, outer = outline_width(foot, x)
    well_inside = (y < inner - 0.012) & (y > outer + 0.012) & (z < 0.015) & (x > foot.heel) & (x < foot.toe)
    assert well_inside.sum() > 300
    assert z[well_inside].max() < 0.004
    assert (z[well_inside] < 1e-4).mean() > 0.4
    assert z.min() == 0.0
    assert x.min() == pytest.approx(foot.back)
    assert x.max() == pytest.approx(foot.front)


def test_sole_widens_at_the_ball_and_narrows_at_the_arch():
    foot = Foot()
    widths = {
        name: np.subtract(*outline_width(foot, np.array([foot.back + u * foot.length])))[0]
        for name, u in (("heel", 0.15), ("arch", 0.38), ("ball", 0.70), ("toes", 0.93))
    }
    assert widths["ball"] == pytest.approx(foot.width, rel=0.05)
    assert widths["arch"] < widths["heel"] * 1.05 < widths["ball"]
    assert widths["toes"] < widths["heel"]


def test_soles_follow_foot_and_toe_bones_only(body):
    figure = hiker(body)
    sole = np.unique(figure.quads[figure.parts == PARTS.index("sole")])
    names = list(BONES)
    feet = [names.index(f"{bone}.{side}") for bone in ("foot", "toe") for side in SIDES]
    assert figure.weights[sole][:, feet].sum(axis=1) == pytest.approx(1.0)
    ball = body.foot.ball
    x = figure.vertices[sole, 0]
    toes = figure.weights[sole][:, [names.index("toe.L"), names.index("toe.R")]].sum(axis=1)
    assert (toes[x < ball - 0.05 * body.foot.length] == 0).all()
    assert (toes[x > ball + 0.05 * body.foot.length] == 1).all()


@pytest.mark.slow
def test_a_bare_foot_stands_on_heel_ball_and_five_toes_but_not_on_its_arch():
    foot = Foot(0.26, 0.098, bare=True)
    body = Body(foot=foot)
    figure = hiker(body)
    edges = {tuple(edge) for edge in directed_edges(figure.quads)}
    assert edges == {(b, a) for a, b in edges}
    assert not {PARTS.index("shoe"), PARTS.index("sole")} & set(figure.parts)

    x, y, z = (figure.vertices - (0, body.joints["ankle.R"][1], 0)).T
    down = (z < 0.001) & (y > -foot.width)  # of the right foot: its inner side is at +y
    along = (x - foot.back) / foot.length
    assert z.min() == pytest.approx(0.0, abs=1e-3)
    assert (down & (along < 0.2)).any()
    assert not (down & (abs(along - 0.42) < 0.06) & (y > 0.0) & (y < 0.5 * foot.width)).any()
    toes = np.sort(y[down & (along > 0.76) & (y < 0.5 * foot.width)])
    assert (np.diff(toes) > 0.003).sum() >= 3  # gaps between the toes


class TestInBlender:
    @pytest.fixture
    def walker(self, scene):
        from sample_scenes.character import create_character

        return create_character("Walker", Body(), scene.collection)

    def test_rest_pose_stands_at_the_origin_facing_minus_y(self, walker):
        bones = walker.data.bones
        assert bones["toe.L"].tail_local.y < bones["foot.L"].head_local.y - 0.1
        assert bones["foot.L"].head_local.x > 0 > bones["foot.R"].head_local.x
        assert min(v.co.z for v in walker.children[0].data.vertices) == pytest.approx(0.0, abs=1e-6)

    def test_vertex_groups_sum_to_one(self, walker):
        for vertex in walker.children[0].data.vertices:
            assert sum(group.weight for group in vertex.groups) == pytest.approx(1.0, abs=1e-5)

    def test_the_rig_plays_the_motion_that_was_written(self, walker, scene):
        import bpy

        from sample_scenes.character import TO_BLENDER
        from sample_scenes.keys import write_action

        body = Body()
        motion = walk(body, Gait(), 40)
        write_action(walker, motion, "Walk", first_frame=5)
        paths = joint_paths(body, motion)
        for frame in (5, 17, 30, 44):
            scene.frame_set(frame)
            posed = walker.evaluated_get(bpy.context.evaluated_depsgraph_get())
            for bone, (head, tail, _) in BONES.items():
                assert np.array(posed.pose.bones[bone].head) == pytest.approx(
                    TO_BLENDER @ paths[head][frame - 5], abs=2e-5
                )
                assert np.array(posed.pose.bones[bone].tail) == pytest.approx(
                    TO_BLENDER @ paths[tail][frame - 5], abs=2e-5
                )

    def test_the_planted_mesh_sole_neither_slides_nor_sinks(self, walker, scene):
        import bpy

        from sample_scenes.keys import write_action

        body = Body()
        motion = walk(body, Gait(), 60)
        write_action(walker, motion, "Walk", first_frame=0)
        fall = next(f for f in motion.footfalls if f.strike > 0.1)
        mesh = walker.children[0]
        group = mesh.vertex_groups[f"foot.{fall.side}"].index
        heel = [
            v.index
            for v in mesh.data.vertices
            if v.co.z < 1e-4 and any(g.group == group and g.weight > 0.99 for g in v.groups)
        ]
        assert len(heel) > 100
        flat = [frame for frame in range(60) if 0.2 < (frame / 24 - fall.strike) / (fall.leave - fall.strike) < 0.5]
        assert len(flat) >= 3
        positions = []
        for frame in flat:
            scene.frame_set(frame)
            posed = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
            co = np.empty(len(posed.data.vertices) * 3, dtype=np.float32)
            posed.data.attributes["position"].data.foreach_get("vector", co)
            positions.append(co.reshape(-1, 3)[heel])
        assert np.ptp(positions, axis=0).max() < 1e-3
        assert np.abs(np.array(positions)[..., 2]).max() < 1e-3

    def test_a_copy_plays_the_same_action_somewhere_else(self, walker, scene):
        from sample_scenes.character import copy_character
        from sample_scenes.keys import write_action

        write_action(walker, walk(Body(), Gait(), 10), "Walk")
        twin = copy_character(walker, "Twin", scene.collection)
        twin.location.x = 3.0
        scene.frame_set(6)
        first, second = walker.pose.bones["head"], twin.pose.bones["head"]
        assert np.array(second.head) == pytest.approx(np.array(first.head), abs=1e-6)
        assert twin.children[0].data == walker.children[0].data
        assert twin.children[0].modifiers["Armature"].object == twin
