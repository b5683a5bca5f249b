"""Contacts of animals at random, whose right contacts are known as they are made."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.jobs import run
from softground_addon.blender.reading.shots import estimate_shot, read_shot, settings_of
from softground_addon.core.errors import InputError
from tests.blender.characters.random_animals import Animal, make

TOLERANCE = 0.067
"""Two frames at 30 Hz [s], for bodies up to a metre at the hips; it goes with the time in which they swing."""
SLOWEST = 2.0
FEWEST = 0.75
"""Share of the frames in which a foot stands that a contact has at least which is late or short and no miss."""


def misses(animal: Animal) -> list[str]:
    """What is wrong with the contacts of an animal, and `GROSS` where a foot prints twice, elsewhere or hardly."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    armature, carriers = make(animal)
    scene.softground.sink_feet = False
    try:
        character = add_character(scene, armature)
        soles = [{part for part, _ in sole.parts.items()} for sole in character.soles]
        feet = [[foot for foot, bones in enumerate(carriers) if bones & parts] for parts in soles]
        if sorted(feet) != [[foot] for foot in range(animal.legs)]:
            return [f"GROSS: the contacts are {soles}"]
        wanted = settings_of(scene)
        loads = run(estimate_shot(wanted, run(read_shot(scene, wanted))))[0]
    except InputError as refusal:
        return [f"GROSS: refused: {refusal}"]
    touching, stands = loads.contacts.touching, animal.stands()
    touching = touching[:: (len(touching) - 1) // (len(stands) - 1)]
    reach = max(2, int(np.ceil(TOLERANCE * np.clip(np.sqrt(animal.size), 1, SLOWEST) * animal.rate)))
    inside, window = slice(reach, -reach), np.ones(2 * reach + 1)
    wrong = []
    for number, (foot,) in enumerate(feet):
        wide = np.convolve(stands[:, foot], window, "same") > 0
        narrow = np.convolve(~stands[:, foot], window, "same") == 0
        early, late = (touching[:, number] & ~wide)[inside], (narrow & ~touching[:, number])[inside]
        if early.any() or late.any():
            share = (touching[:, number] & stands[:, foot]).sum() / stands[:, foot].sum()
            gross = share < FEWEST or early.sum() > (1 - FEWEST) * stands[:, foot].sum()
            wrong.append(f"{'GROSS' if gross else 'timing'}: foot {foot}: {early.sum()} too many, {late.sum()} too few")
    return wrong


@pytest.mark.parametrize(
    ("first", "count", "right"),
    [
        pytest.param(0, 6, 1.0),
        pytest.param(12, 50, 0.96, marks=pytest.mark.slow),
        pytest.param(1000, 1000, 0.98, marks=pytest.mark.marathon),
    ],
)
def test_every_foot_of_a_random_animal_prints_when_it_stands(addon, first, count, right):
    wrong = {seed: faults for seed in range(first, first + count) if (faults := misses(Animal.drawn(seed)))}
    assert len(wrong) <= (1 - right) * count, wrong
    assert not [seed for seed, faults in wrong.items() if any("GROSS" in miss for miss in faults)], wrong


@pytest.mark.parametrize(("size", "period"), [(0.12, 0.57), (7.4, 2.1), (1.0, 3.0)])
def test_a_walk_on_the_spot_is_one_however_slow_it_is(addon, size, period):
    """Its feet slide no faster than those of others that stand."""
    walk = replace(Animal.drawn(3), size=size, period=period, duty=0.67, stride=0.35, on_the_spot=True, trembles=0.001)
    assert not misses(walk)


def test_toes_and_knees_are_those_of_their_own_leg_where_several_have_such_names(addon):
    """Middle legs are named as the others are but for a word that tells no part of a body."""
    assert not misses(replace(Animal.drawn(3), legs=6, foot="free", names="named", toes=True))


def test_feet_that_tremble_and_slide_print_while_their_skin_stands(addon):
    """As a network or a capture without a filter leaves them: their speed does not tell when they stand."""
    large = replace(Animal.drawn(1208), legs=4, size=5.8, unit=1.0, rate=120, period=2.57, duty=0.64, stride=0.3)
    for seed in range(2):
        animal = replace(large, skates=0.066, trembles=0.0017, offset=0.234, seed=seed)
        assert not [miss for miss in misses(animal) if "GROSS" in miss]
