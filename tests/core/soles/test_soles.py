"""Soles have the size of what they were made from."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from softground_addon.core.errors import InputError
from softground_addon.core.numerics.bilinear import sample_map
from softground_addon.core.soles.outlines import area, as_one_polygon, signed_distance, trace_loops
from softground_addon.core.soles.soles import FOOT_BREADTH, anatomical_sole, sole_from_underside


def prism(outline, bottom=0.0, top=0.1):
    """Closed prism over a convex outline (counter-clockwise)."""
    count = len(outline)
    vertices = np.concatenate([np.column_stack([outline, np.full(count, z)]) for z in (bottom, top)])
    fan = np.array([(0, i, i + 1) for i in range(1, count - 1)])
    ring = np.arange(count)
    after = np.roll(ring, -1)
    sides = np.concatenate(
        [np.column_stack([ring, after, after + count]), np.column_stack([ring, after + count, ring + count])]
    )
    return vertices, np.concatenate([fan[:, ::-1], fan + count, sides])


def box(length=0.3, width=0.1, x=0.0, bottom=0.0, top=0.1):
    corners = np.array([(x, -width / 2), (x + length, -width / 2), (x + length, width / 2), (x, width / 2)])
    return prism(corners, bottom, top)


def together(*meshes):
    vertices, triangles, count = [], [], 0
    for points, faces in meshes:
        vertices.append(points)
        triangles.append(faces + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(triangles)


def union_area(sole):
    """Area of the patches with the seam counted once."""
    first, *rest = sole.patches
    return first.area + sum(patch.area for patch in rest)


def test_an_adult_sole_is_about_200_square_centimetres():
    sole = anatomical_sole(0.27, name="foot.L", side="L").sole
    assert sole.area == pytest.approx(0.0200, rel=0.03)
    assert np.ptp(sole.outline[:, 0]) == pytest.approx(0.27, rel=0.01)
    assert np.ptp(sole.outline[:, 1]) == pytest.approx(FOOT_BREADTH * 0.27, rel=0.01)


@given(length=st.floats(1e-3, 10.0), ball=st.floats(0.4, 0.9))
@settings(max_examples=25)
def test_a_sole_has_the_same_shape_at_any_size(length, ball):
    sole = anatomical_sole(length, name="f", side="L", ball=ball * length).sole
    reference = anatomical_sole(1.0, name="f", side="L", ball=ball).sole
    assert sole.area == pytest.approx(reference.area * length**2, rel=1e-9)
    np.testing.assert_allclose(sole.landmarks, reference.landmarks * length, atol=1e-9 * length)
    for patch, same in zip(sole.patches, reference.patches, strict=True):
        assert patch.area == pytest.approx(same.area * length**2, rel=1e-6)


@pytest.mark.parametrize("side", ["L", "R", ""])
def test_the_area_of_the_map_equals_the_area_of_the_outline(side):
    placed = anatomical_sole(0.27, name="f", side=side)
    (patch,) = placed.sole.patches
    assert patch.area == pytest.approx(placed.sole.area, rel=0.002)
    assert area([placed.sole.outline]) > 0  # counter-clockwise


def test_left_and_right_soles_are_mirror_images_with_the_big_toe_inside():
    left = anatomical_sole(0.27, name="l", side="L").sole
    right = anatomical_sole(0.27, name="r", side="R").sole
    assert left.area == pytest.approx(right.area)
    tip = left.outline[left.outline[:, 0].argmax()]
    assert tip[1] < 0
    np.testing.assert_allclose(sorted(left.outline[:, 1]), sorted(-right.outline[:, 1]), atol=1e-12)


def test_foot_and_toes_overlap_in_a_narrow_seam_at_the_ball():
    placed = anatomical_sole(0.27, name="f", side="L", ball=0.2)
    foot, toes = placed.sole.patches
    seam = foot.area + toes.area - placed.sole.area
    breadth = FOOT_BREADTH * 0.27
    assert 0.005 * breadth < seam < 0.02 * breadth
    columns = toes.origin[0] + toes.spacing * np.arange(toes.heights.shape[1])
    inside = (toes.signed_distance < 0).any(axis=0)
    assert columns[inside].min() == pytest.approx(0.2, abs=0.015)


def test_the_lowest_point_of_each_patch_is_its_zero_and_landmarks_lie_on_the_underside():
    vertices, triangles = together(box(0.2, 0.1, top=0.12), box(0.1, 0.1, x=0.2, bottom=0.01, top=0.1))
    placed = sole_from_underside(vertices, triangles, name="f", side="L", ball=0.2)
    for patch in placed.sole.patches:
        assert patch.heights[patch.signed_distance < 0].min() == pytest.approx(0.0, abs=1e-9)
    in_sole = [
        (placed.placements[p] @ [*mark, 1.0])[2]
        for mark, p in zip(placed.sole.landmarks, placed.sole.landmark_patch, strict=True)
    ]
    assert in_sole[0] == pytest.approx(0.0, abs=1e-9)
    assert in_sole[2] == pytest.approx(0.01, abs=1e-9)


def test_a_boot_with_a_flat_sole_has_the_area_of_its_sole():
    outline = anatomical_sole(0.30, name="f", side="L").sole.outline
    hull = outline[ConvexHull(outline).vertices]
    sole = sole_from_underside(*prism(hull), name="boot", side="L").sole
    assert sole.area == pytest.approx(ConvexHull(hull).volume, rel=0.01)
    assert union_area(sole) == pytest.approx(ConvexHull(hull).volume, rel=0.01)


def test_a_high_heel_stands_on_two_separate_places():
    forefoot = box(0.10, 0.08, x=0.14, top=0.06)
    heel = box(0.03, 0.03, top=0.09)
    shank = box(0.24, 0.05, bottom=0.06, top=0.09)
    sole = sole_from_underside(*together(forefoot, heel, shank), name="heel", side="L").sole
    assert sole.area == pytest.approx(0.10 * 0.08 + 0.03 * 0.03, rel=0.03)
    (patch,) = sole.patches
    assert patch.area == pytest.approx(0.10 * 0.08 + 0.03 * 0.03, rel=0.03)
    gap = sample_map(patch.signed_distance, np.array([0.085, 0.0]), patch.origin, patch.spacing)
    assert gap > 0.04


def bare_foot():
    """A foot as a bumpy sheet: heel and ball down, an arch on the medial side."""
    x, y = np.meshgrid(np.linspace(0, 0.26, 80), np.linspace(-0.045, 0.045, 40))
    z = 0.015 * np.exp(-(((x - 0.11) / 0.04) ** 2)) * np.clip(-y / 0.045, 0, 1) + 4 * y**4 / 0.045**2
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), triangles, z


def test_a_bare_foot_keeps_its_arch():
    vertices, triangles, _ = bare_foot()
    (patch,) = sole_from_underside(vertices, triangles, name="bare", side="L").sole.patches
    medial, lateral = sample_map(patch.heights, np.array([(0.11, -0.035), (0.11, 0.035)]), patch.origin, patch.spacing)
    y = 0.035
    assert lateral == pytest.approx(4 * y**4 / 0.045**2, abs=3e-4)
    assert medial == pytest.approx(0.015 * y / 0.045 + 4 * y**4 / 0.045**2, abs=3e-4)
    assert medial > lateral + 0.009


def test_boot_heel_and_bare_foot_have_different_undersides():
    undersides = [
        sole_from_underside(*mesh, name="f", side="L").sole.area
        for mesh in (box(0.26, 0.09), together(box(0.1, 0.08, x=0.16), box(0.03, 0.03)), bare_foot()[:2])
    ]
    assert undersides == pytest.approx([0.26 * 0.09, 0.1 * 0.08 + 0.03 * 0.03, 0.26 * 0.09], rel=0.03)


def icosphere(radius, rings=60):
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, 2 * rings))
    vertices = radius * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    index = np.arange(theta.size).reshape(theta.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return vertices.reshape(-1, 3), triangles


def test_a_sphere_is_round_from_below():
    radius = 0.2
    placed = sole_from_underside(*icosphere(radius), name="sphere", side="")
    (patch,) = placed.sole.patches
    assert placed.placements[0, 2, 3] == pytest.approx(-radius, rel=0.01)
    band = 0.1 * 2 * radius  # what lies higher than a tenth of its length is no underside of a foot
    assert patch.area == pytest.approx(np.pi * (2 * radius * band - band**2), rel=0.01)
    points = radius * np.array([(0.0, 0.0), (0.3, 0.2), (-0.2, 0.4), (0.0, -0.5)])
    truth = radius - np.sqrt(radius**2 - (points**2).sum(axis=1))
    np.testing.assert_allclose(
        sample_map(patch.heights, points, patch.origin, patch.spacing), truth, atol=0.005 * radius
    )


def test_the_underside_does_not_depend_on_where_and_how_finely_the_mesh_is_made():
    coarse = sole_from_underside(*icosphere(0.2, 60), name="a", side="").sole.patches[0]
    fine = sole_from_underside(*icosphere(0.2, 150), name="b", side="").sole.patches[0]
    assert coarse.area == pytest.approx(fine.area, rel=0.005)
    vertices, triangles = icosphere(0.2)
    moved = sole_from_underside(vertices + np.array((3.1, -2.7, 5.0)), triangles, name="c", side="").sole.patches[0]
    assert moved.area == pytest.approx(coarse.area, rel=0.003)


@pytest.mark.parametrize(
    ("vertices", "triangles"),
    [
        (np.empty((0, 3)), np.empty((0, 3), dtype=int)),
        (np.zeros((3, 3)), np.array([[0, 1, 2]])),
        (np.array([(0.0, 0, 0), (1, 0, 0), (1, 0, 1)]), np.array([[0, 1, 2]])),
        (np.array([(0.0, 0, 0), (1, 0, 0), (np.nan, 1, 0)]), np.array([[0, 1, 2]])),
    ],
    ids=["nothing", "a point", "an upright sheet", "broken"],
)
def test_a_mesh_without_underside_is_refused_with_its_name(vertices, triangles):
    with pytest.raises(InputError, match="'ghost'"):
        sole_from_underside(vertices, triangles, name="ghost", side="")


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), float("inf")])
def test_a_sole_of_impossible_size_is_refused(length):
    with pytest.raises(InputError, match="positive size"):
        anatomical_sole(length, name="f", side="L")


def test_distances_to_a_square_are_exact():
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    points = np.random.default_rng(1).uniform(-1, 2, (500, 2))
    outside = np.maximum(np.maximum(-points, points - 1), 0)
    inside = np.minimum(points, 1 - points).min(axis=1)
    truth = np.where(inside > 0, -inside, np.linalg.norm(outside, axis=1))
    np.testing.assert_allclose(signed_distance(points, [square]), truth, atol=1e-12)


@given(radius=st.floats(8.0, 12.0), x=st.floats(-0.5, 0.5), y=st.floats(-0.5, 0.5))
@settings(max_examples=25)
def test_a_traced_disc_has_the_area_and_sense_of_a_disc(radius, x, y):
    rows, columns = np.indices((30, 30))
    distance = radius - np.hypot(columns - 14.5 - x, rows - 14.5 - y)
    (loop,) = trace_loops(np.clip(distance + 0.5, 0, 1), np.zeros(2), 1.0)
    assert area([loop]) == pytest.approx(np.pi * radius**2, rel=0.01)
    np.testing.assert_allclose(np.hypot(*(loop - (14.5 + x, 14.5 + y)).T), radius, atol=0.3)


def test_holes_run_the_other_way_and_separate_loops_join_to_one_polygon_of_the_same_area():
    coverage = np.zeros((20, 40))
    coverage[2:18, 2:18] = 1
    coverage[7:13, 7:13] = 0
    coverage[5:15, 25:35] = 1
    loops = trace_loops(coverage, np.zeros(2), 1.0)
    assert sorted(np.sign(area([loop])) for loop in loops) == [-1, 1, 1]
    assert area([as_one_polygon(loops)]) == pytest.approx(area(loops))
    assert area(loops) == pytest.approx(256 - 36 + 100, rel=0.02)


@pytest.mark.parametrize("bend", [0.0, 0.15, 0.3])
def test_where_the_sole_bends_is_read_from_the_weights_of_its_skin(bend):
    vertices, triangles, _ = bare_foot()
    weight = np.clip(0.5 + (vertices[:, 0] - 0.18) / (2 * 0.26 * max(bend, 1e-3)), 0.0, 1.0)
    sole = sole_from_underside(vertices, triangles, name="f", side="L", ball=0.18, toe_weight=weight).sole
    assert sole.bend == pytest.approx(0.26 * bend, abs=2e-3)
    assert sole_from_underside(vertices, triangles, name="f", side="L", ball=0.18).sole.bend == 0.0
