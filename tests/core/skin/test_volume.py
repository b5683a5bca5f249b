"""The volume of a body, whatever its skin is like: closed forms."""

import numpy as np
import pytest

from softground_addon.core.motion.props import capsule
from softground_addon.core.numerics.components import components
from softground_addon.core.numerics.rigid import rotation
from softground_addon.core.skin.volume import body_volume, pieces, welded
from tests.core.prop_bodies import box, sphere, wheel

BALL = 4 / 3 * np.pi
ROD = np.pi * 0.2**2 * 1.5 + BALL * 0.2**3

BODIES = {
    "sphere": (sphere(1.0), BALL),
    "box": (box(1.0, 2.0, 3.0), 6.0),
    "cylinder": (wheel(0.5, 2.0), np.pi * 0.25 * 2.0),
    "capsule": (capsule(np.zeros(3), np.array([0.9, 0.0, 1.2]), 0.2), ROD),
}
TURNS = [(0.0, 0.0, 0.0), (0.4, -1.1, 2.0), (np.pi / 2, 0.0, 0.3)]


def united(*bodies):
    """Several skins as one mesh."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in bodies)])
    return (
        np.concatenate([vertices for vertices, _ in bodies]),
        np.concatenate([triangles + start for (_, triangles), start in zip(bodies, first[:-1], strict=True)]),
    )


def moved(body, offset):
    return body[0] + np.asarray(offset, float), body[1]


def without(body, keeps):
    """A skin with only those triangles whose middle a function of (x, y, z) keeps."""
    vertices, triangles = body
    return vertices, triangles[keeps(*vertices[triangles].mean(axis=1).T)]


def turned(body, turn):
    return body[0] @ rotation(np.asarray(turn)).T, body[1]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("name", BODIES)
def test_a_closed_skin_holds_what_its_closed_form_says(name, turn, scale):
    body, volume = BODIES[name]
    vertices, triangles = turned(body, turn)
    assert body_volume(vertices * scale, triangles) == pytest.approx(volume * scale**3, rel=0.02)
    assert body_volume(vertices * scale, triangles[:, ::-1]) == pytest.approx(volume * scale**3, rel=0.02)


@pytest.mark.parametrize("turn", TURNS)
def test_faces_that_disagree_on_what_is_inside_count_by_their_hulls(turn):
    vertices, triangles = turned(sphere(1.0), turn)
    flipped = np.random.default_rng(1).random(len(triangles)) < 0.3
    triangles = np.where(flipped[:, None], triangles[:, ::-1], triangles)
    assert body_volume(vertices, triangles) == pytest.approx(BALL, rel=0.02)
    both = np.concatenate([triangles, triangles[:, ::-1]])
    assert body_volume(vertices, both) == pytest.approx(BALL, rel=0.02)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize(
    ("body", "volume", "error"),
    [
        (without(sphere(1.0), lambda x, y, z: z < 0.8), BALL, 0.04),  # a ball with a hole
        (without(sphere(1.0), lambda x, y, z: np.hypot(y, z) > 0.3), BALL, 0.05),  # a bead
        (without(wheel(0.5, 2.0), lambda x, y, z: np.abs(y) < 0.99), np.pi / 2, 0.05),  # a sleeve
    ],
)
def test_holes_take_little_away(body, volume, error, turn):
    assert body_volume(*turned(body, turn)) == pytest.approx(volume, rel=error)


def test_a_skin_that_is_cut_open_along_its_edges_is_whole_where_its_corners_meet():
    vertices, triangles = sphere(1.0)
    torn = vertices[triangles].reshape(-1, 3)
    place = welded(torn)
    _, first = np.unique(place, return_index=True)
    assert body_volume(torn[first], place.reshape(-1, 3)) == pytest.approx(BALL, rel=0.01)
    assert not pieces(torn[first], place.reshape(-1, 3)).is_cloth.any()


def test_what_lies_within_counts_once_and_what_lies_beside_counts_too():
    eye, twin = moved(sphere(0.1), (0.5, 0, 0)), moved(sphere(0.5), (3.0, 0, 0))
    shirt = without(sphere(1.05), lambda x, y, z: np.abs(z) < 0.7)
    assert body_volume(*united(sphere(1.0), eye)) == pytest.approx(BALL, rel=0.01)
    assert body_volume(*united(sphere(1.0), twin)) == pytest.approx(BALL * 1.125, rel=0.01)
    assert body_volume(*united(sphere(1.0), shirt)) == pytest.approx(BALL, rel=0.12)


def test_a_copy_of_the_skin_in_its_place_counts_once():
    vertices, triangles = sphere(1.0)
    corners = np.roll(triangles, 1, axis=1)
    assert body_volume(vertices, np.concatenate([triangles, corners])) == pytest.approx(BALL, rel=0.02)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("sides", [4, 6, 9])
@pytest.mark.parametrize("size", [0.95, 1.0, 1.1])
def test_a_copy_of_the_skin_with_fewer_faces_counts_once(sides, size, turn):
    fine, coarse = wheel(0.2, 1.0), wheel(0.2 * size, 1.0 * size, sides=sides)
    once, other = (body_volume(*turned(each, turn)) for each in (fine, coarse))
    assert min(once, other) * 0.98 < body_volume(*turned(united(fine, coarse), turn)) < 1.05 * max(once, other)


def test_a_copy_that_shares_half_of_its_faces_counts_once():
    vertices, triangles = sphere(1.0)
    coarse = vertices.copy()
    coarse[: len(vertices) // 4] *= 0.97
    both = np.concatenate([vertices, coarse]), np.concatenate([triangles, triangles + len(vertices)])
    place = welded(both[0])
    _, first = np.unique(place, return_index=True)
    assert body_volume(both[0][first], place[both[1]]) == pytest.approx(BALL, rel=0.05)


@pytest.mark.parametrize("away", [0.0, 1e3, -5.0])
def test_points_at_one_place_are_those_whose_rounded_coordinates_are_equal(away):
    points = np.random.default_rng(1).integers(-50_000, 50_000, size=(400, 3)) * 1e-3
    cut = np.concatenate([points, points[::3] + 1e-6, points[::7, ::-1]]) + away
    size = np.ptp(cut, axis=0).max()
    _, rows = np.unique(np.round(cut / (1e-5 * size)), axis=0, return_inverse=True)
    assert (welded(cut) == rows.ravel()).all()


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_faces_that_lie_on_each_other_back_to_back_take_nothing_away(share):
    vertices, triangles = sphere(1.0)
    backs = triangles[: round(share * len(triangles)), ::-1]
    faces = np.random.default_rng(0).permutation(np.concatenate([triangles, backs]))
    assert body_volume(vertices, faces) == pytest.approx(BALL, rel=0.02)


def test_what_is_flat_holds_nothing():
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-1.0, 1.0, 9))
    flat = np.stack([x, 0 * x, y], -1).reshape(-1, 3)
    a = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + 9], -1), np.stack([a + 1, a + 10, a + 9], -1)])
    assert body_volume(flat, faces) < 1e-9
    assert body_volume(flat[:0], faces[:0]) == 0.0
    assert body_volume(flat * 0.0, faces) == 0.0
    assert body_volume(*united(moved(sphere(0.5), (0, 1, 0)), (flat, faces))) == pytest.approx(BALL / 8, rel=0.02)


def test_capes_skirts_and_hats_are_sheets_and_bodies_sleeves_and_legs_are_not():
    cape = without(wheel(0.5, 2.0), lambda x, y, z: (np.abs(y) < 0.99) & (x > 0))
    thick = box(1.0, 0.01, 1.5)
    hat = without(sphere(0.2), lambda x, y, z: z > 0)
    sleeve = without(wheel(0.1, 0.6), lambda x, y, z: np.abs(y) < 0.29)
    leg = capsule(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.01)
    head = without(sphere(0.12), lambda x, y, z: z > -0.1)
    vertices, triangles = united(
        *(moved(each, (3.0 * k, 0, 0)) for k, each in enumerate((cape, thick, hat, sleeve, leg, head)))
    )
    parts = pieces(vertices, triangles)
    place = vertices[triangles[:, 0], 0]
    each = [np.abs(place - 3.0 * k) < 1.0 for k in range(6)]
    assert [set(parts.is_sheet[each]) for each in each] == [{True}] * 3 + [{False}] * 3
    assert [set(parts.is_cloth[each]) for each in each] == [{True}] * 4 + [{False}] * 2


def test_cloth_around_skin_is_no_body_and_cloth_around_nothing_is():
    leg, skirt = wheel(0.1, 1.0), without(wheel(0.5, 1.0), lambda x, y, z: np.abs(y) < 0.49)
    assert body_volume(*united(leg, skirt)) == pytest.approx(np.pi * 0.01, rel=0.05)
    assert body_volume(*united(moved(leg, (2.0, 0, 0)), skirt)) == pytest.approx(np.pi * 0.26, rel=0.05)


def test_a_closed_skirt_around_a_body_that_goes_on_at_both_ends_is_no_body():
    upright = (np.pi / 2, 0.0, 0.0)
    body, skirt = wheel(0.1, 3.0), wheel(0.5, 1.0)
    assert body_volume(*turned(united(body, skirt), upright)) == pytest.approx(np.pi * 0.03, rel=0.05)
    leg = moved(wheel(0.1, 1.0), (0.0, 0.5, 0.0))  # which begins within it
    assert body_volume(*turned(united(leg, skirt), upright)) == pytest.approx(np.pi * (0.25 + 0.005), rel=0.05)


@pytest.mark.parametrize("turn", [*TURNS, (np.pi / 2, 0.0, 0.0)])
@pytest.mark.parametrize("radius", [0.02, 0.05, 0.1])
def test_a_body_with_a_thin_rod_through_it_is_no_skirt(radius, turn):
    body, rod = wheel(0.4, 1.0), wheel(radius, 1.3)
    volume = np.pi * (0.4**2 + 0.3 * radius**2)
    assert body_volume(*turned(united(body, rod), turn)) == pytest.approx(volume, rel=0.03)


def test_components_are_those_of_a_random_graph():
    random = np.random.default_rng(0)
    first, other = random.integers(0, 300, (2, 220))
    label = components(300, first, other)
    known = [{node} for node in range(300)]
    for a, b in zip(first, other, strict=True):
        if known[a] is not known[b]:
            known[a] |= known[b]
            for node in known[b]:
                known[node] = known[a]
    assert all((label[node] == label[mate]) for node in range(300) for mate in known[node])
    assert len(np.unique(label)) == len({id(group) for group in known})
