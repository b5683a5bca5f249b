"""Treads: a map of a sole from an image or a mesh presses what it shows, to scale, mirrored for left feet."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from softground_addon.core.composers.relief_plan import asked_of, shod_of
from softground_addon.core.errors import InputError
from softground_addon.core.relief import tread_map
from softground_addon.core.relief.amounts import Amounts, Tread
from softground_addon.core.relief.print_relief import ARCH, FLESH, relief_of_print
from softground_addon.core.relief.print_shape import shape_of
from softground_addon.core.relief.tread import LENGTH, PADS, PATTERNS, SoleTread, Under, bare, of_map
from tests.core.relief.test_steps import MATERIALS, steps_on
from tests.core.walkers import box_sole

HEIGHT = 3.0
"""Of the tread [mm]."""


def checker(rows, columns):
    return np.indices((rows, columns)).sum(axis=0) % 2.0


def under(along, across, breadth=0.1):
    return Under(along, across, np.full(len(along), 0.03), breadth)


def pressed_in(values, *, mirrored=False, spacing=0.0025):
    """Heights that a picture under the first sole of a walk adds in the middle of its print, with where, in parts of
    the print from the heel and from its left side."""
    step = steps_on("wet_sand")[0]
    shape = shape_of(step, MATERIALS["wet_sand"].blur_sigma)
    of_sole = tread_map.from_text(tread_map.as_text(tread_map.from_picture(values)))
    plain = Amounts(10.0, tread=Tread(HEIGHT, least_lost=0.0, lost=0.0))
    tread = SoleTread(of_map(of_sole), mirrored)
    more = {"blur_sigma": MATERIALS["wet_sand"].blur_sigma, "finest": spacing, "seed": 1}
    with_it = relief_of_print(step, plain, tread=tread, **more)
    without = relief_of_print(step, plain, **more)
    grid = np.arange(-0.2, 0.2, spacing)
    x, y = (axis.ravel() + middle for axis, middle in zip(np.meshgrid(grid, grid), step.position, strict=False))
    along, left = shape.under_sole(x, y)
    along = (along - shape.along[0]) / np.ptp(shape.along)
    right = (shape.across[1] - left) / np.ptp(shape.across)
    inner = shape.at(x, y)[0] > 0.016
    change = (with_it.at(x, y).height - without.at(x, y).height)[inner]
    return along[inner], right[inner], change, np.ptp(shape.along) / LENGTH


def test_a_checker_presses_a_checker_of_the_height_that_is_asked_for():
    along, right, change, size = pressed_in(checker(6, 2))
    white = (np.floor(along * 6) + np.floor(right * 2)) % 2 == 1
    clear = (np.abs(along * 6 % 1 - 0.5) < 0.3) & (np.abs(right * 2 % 1 - 0.5) < 0.3)  # the places are bent by 2 mm
    assert min((clear & white).sum(), (clear & ~white).sum()) > 50
    between = change[clear & ~white].mean() - change[clear & white].mean()
    assert between == pytest.approx(HEIGHT * 1e-3 * size, rel=0.02)
    assert change[clear & white].std() < 0.06 * between  # the floor is as deep as elsewhere on the whole


def test_left_feet_have_the_mirror_image_of_right_ones():
    rng = np.random.default_rng(4)
    along, across = rng.uniform(-0.13, 0.13, 500), rng.uniform(-0.05, 0.05, 500)
    picture = of_map(tread_map.from_picture(rng.uniform(size=(40, 20))) / 255.0)
    for pattern in (*PATTERNS.values(), picture):
        right, left = SoleTread(pattern), SoleTread(pattern, is_mirrored=True)
        assert np.array_equal(left(under(along, across)), right(under(along, -across)))
    assert not np.array_equal(picture(under(along, across)), picture(under(along, -across)))


def test_a_wide_picture_is_a_high_one_turned_clockwise():
    high = np.random.default_rng(5).uniform(size=(50, 20))
    assert np.array_equal(tread_map.from_picture(high), tread_map.from_picture(high.T[::-1]))
    assert np.array_equal(tread_map.from_picture(high), tread_map.from_picture(np.repeat(high, 2, axis=1)))


@pytest.mark.parametrize("shape", [(1, 1), (3, 1), (7, 5), (1000, 400)])
def test_a_map_has_the_mean_brightness_of_its_picture(shape):
    picture = np.random.default_rng(6).uniform(size=shape)
    assert tread_map.from_picture(picture).mean() / 255 == pytest.approx(picture.mean(), abs=0.003)


def test_pictures_of_no_numbers_are_black_and_too_bright_ones_white():
    assert (tread_map.from_picture(np.full((4, 2), np.nan)) == 0).all()
    assert (tread_map.from_picture(np.full((4, 2), 80.0)) == 255).all()


def test_a_bare_foot_is_on_its_heel_ball_and_five_toes_and_not_on_its_arch():
    def stands(ahead, left):
        return bare(under(np.array([ahead * LENGTH]), np.array([left * 0.1])))[0]

    pressing = [(-0.37, 0.0), (-0.1, -0.25), (0.17, 0.2), (0.13, -0.2)]
    assert all(stands(*place) < 0.1 for place in pressing)
    assert stands(-0.08, 0.3) > 0.9  # the arch, on the inner side
    assert stands(0.31, 0.15) > 0.6  # before the big toe
    row = bare(under(np.full(400, 0.385 * LENGTH), np.linspace(0.05, -0.05, 400)))
    assert np.diff((row < 0.5).astype(int)).tolist().count(1) >= 3  # toe by toe


def test_ground_stands_between_toes():
    toes = PADS[-5:, :2]
    for toe, other in pairwise(toes):
        line = toe + (other - toe) * np.linspace(0.0, 1.0, 101)[:, None]
        stands = bare(under(line[:, 0] * LENGTH, line[:, 1] * 0.1))
        assert max(stands[0], stands[-1]) < 0.1
        assert stands.max() > 0.4


@pytest.mark.parametrize("look", ["wet_sand", "snow"])
def test_an_arch_stands_high_in_a_shallow_print_and_comes_down_into_a_deep_one(look):
    step, sigma = steps_on(look)[0], MATERIALS[look].blur_sigma
    shape = shape_of(step, sigma)
    more = {"blur_sigma": sigma, "finest": 0.0025, "seed": 1}
    plain = Amounts(10.0, tread=Tread(HEIGHT))
    grid = np.arange(-0.2, 0.2, 0.0025)
    x, y = (axis.ravel() + middle for axis, middle in zip(np.meshgrid(grid, grid), step.position, strict=False))
    inner = shape.at(x, y)[0] > 0.016
    with_it, without = (relief_of_print(step, plain, tread=tread, **more) for tread in (SoleTread(bare), None))
    stands = float(np.ptp((with_it.at(x, y).height - without.at(x, y).height)[inner]))
    size = np.ptp(shape.along) / LENGTH
    if look == "snow":
        assert stands == pytest.approx(ARCH * size, rel=0.1)
        assert stands < 0.8 * FLESH * shape.depth
    else:
        assert stands == pytest.approx(FLESH * shape.depth, rel=0.25)
        assert stands < 0.8 * ARCH * size


def ribbed(depth, pitch=0.014, slope=0.1, nodes=192):
    """The underside of a sole of 0.27 m with grooves across it, which rises toward its right side."""
    along, across = np.meshgrid(np.linspace(0, 0.27, nodes), np.linspace(0, 0.1, 71), indexing="ij")
    heights = depth * (along % pitch < 0.4 * pitch) + slope * across + 0.03 * (along - 0.13) ** 2
    heights[across < 0.004] = np.inf
    return heights


def test_grooves_of_a_mesh_are_found_whatever_the_shape_of_its_sole():
    of_sole = tread_map.from_underside(ribbed(0.002), 0.27)
    shown = of_sole[10:-10, 8:-8] / 255
    groove = (np.linspace(0, 0.27, 192) % 0.014 < 0.4 * 0.014)[10:-10]
    assert shown[groove].mean() < 0.15
    assert shown[~groove].mean() > 0.9


def test_soles_that_are_flat_or_only_curved_have_none():
    assert tread_map.from_underside(ribbed(0.0), 0.27) is None
    assert tread_map.from_underside(ribbed(0.0004), 0.27) is None
    assert tread_map.from_underside(np.full((192, 70), np.inf), 0.27) is None


def inputs_of(**more):
    sole = {"name": "foot.L", "side": "L", "bone": "foot", "limb": False}
    other = sole | {"name": "foot.R", "side": "R"}
    return {
        "relief_look": "snow", "relief_strength": 1.0, "tread_m": 0.003, "tread_pattern": "HIKING", "tread_image": "",
        "shoe_treads": [], "characters": [{"name": "A", "soles": [sole, other]}],
    } | more  # fmt: skip


def test_records_ask_for_the_treads_that_they_hold():
    text = tread_map.as_text(tread_map.from_picture(checker(4, 2)))
    asked = asked_of(inputs_of(tread_pattern="IMAGE", tread_image=text), ()).treads
    assert {key: tread.is_mirrored for key, tread in asked.items()} == {("A", "foot.L"): True, ("A", "foot.R"): False}
    shoes = asked_of(inputs_of(tread_pattern="SHOES", shoe_treads=[["A", "foot.L", text]]), ()).treads
    assert {key: tread.is_mirrored for key, tread in shoes.items()} == {("A", "foot.L"): False}


@pytest.mark.parametrize("text", ["", "no map", "AAAA", 7, None])
def test_records_with_a_broken_map_are_refused(text):
    with pytest.raises(InputError, match="bake again"):
        asked_of(inputs_of(tread_pattern="IMAGE", tread_image=text), ())


def shod_after(feet, limbs=(), *, sole=None, pattern="HIKING"):
    """The soles of a walk in shoes, where it has limbs too; contacts as (first frame, last frame)."""
    step = steps_on("wet_sand")[0]
    if sole is not None:
        step = replace(step, pressed_by=replace(step.pressed_by, pressing=replace(step.pressed_by.pressing, sole=sole)))
    walk = [
        replace(step, character="A", sole=f"{part}.{'LR'[number % 2]}", start_frame=float(first), end_frame=float(last))
        for part, contacts in {"foot": feet, "hand": limbs}.items()
        for number, (first, last) in enumerate(contacts)
    ]
    soles = inputs_of()["characters"][0]["soles"]
    hands = [{"name": f"hand.{side}", "side": side, "bone": "hand", "limb": True} for side in "LR"]
    asked = inputs_of(characters=[{"name": "A", "soles": soles + hands}], tread_pattern=pattern)
    return {name for _, name in shod_of(asked, walk)}


STEPS = [(10 * number, 10 * number + 12) for number in range(6)]


def test_feet_of_those_who_walk_and_then_fall_and_lie_wear_shoes():
    assert shod_after(STEPS) == {"foot.L", "foot.R"}
    assert shod_after([*STEPS, (60, 400), (70, 400)], [(68, 400), (75, 400), (66, 400)]) == {"foot.L", "foot.R"}
    assert shod_after([(0, 200), (0, 200)], [(80, 200), (82, 200)]) == {"foot.L", "foot.R"}  # without a step


def test_hind_feet_of_those_who_go_on_all_fours_are_bare_whatever_their_forefeet_are_called():
    assert shod_after(STEPS, [(first + 2, last + 2) for first, last in STEPS]) == set()  # diagonal pairs
    assert shod_after(STEPS, [(first + 7, last + 7) for first, last in STEPS]) == set()


def outline_of(*toes):
    """A sole whose front parts into toes: how far back each gap reaches and how wide it is, over the length of 1."""
    points = [(-0.5, -0.25), (0.5, -0.25)]
    for number, (reach, width) in enumerate(toes):
        middle = -0.25 + 0.5 * (number + 1) / (len(toes) + 1)
        points += [(0.5, middle - width / 2), (0.5 - reach, middle), (0.5, middle + width / 2)]
    return np.array([*points, (0.5, 0.25), (-0.5, 0.25)])


def test_feet_whose_toes_are_apart_are_bare_and_toe_caps_with_a_notch_are_not():
    sole = box_sole(0.5, 0.25)
    for toes, worn in (
        ((), {"foot.L", "foot.R"}),
        (((0.05, 0.05),), {"foot.L", "foot.R"}),
        (((0.3, 0.05), (0.3, 0.05)), set()),
        (((0.25, 0.03),), set()),
    ):
        bare = replace(sole, outline=0.5 * outline_of(*toes))
        assert shod_after(STEPS, sole=bare) == worn
        assert shod_after(STEPS, sole=bare, pattern="BARE") == {"foot.L", "foot.R"}  # whose toes it shows


def test_paws_and_hooves_are_bare_also_of_those_who_go_on_two():
    assert shod_after(STEPS, sole=box_sole(0.08, 0.07)) == set()
    assert shod_after(STEPS, sole=box_sole(0.09, 0.065)) == set()
    assert shod_after(STEPS, sole=box_sole(0.40, 0.24)) == {"foot.L", "foot.R"}  # figures with large heads
    assert shod_after(STEPS, sole=box_sole(0.28, 0.10)) == {"foot.L", "foot.R"}
