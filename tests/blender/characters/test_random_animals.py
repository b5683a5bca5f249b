"""Contacts of animals at random, whose right contacts are known as they are made."""

from dataclasses import dataclass, replace

import bpy
import numpy as np
import pytest

from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.jobs import run
from softground_addon.blender.reading.shots import Shot, estimate_shot, read_shot, settings_of
from softground_addon.core.checks.skin_check import skin_check
from softground_addon.core.errors import InputError
from softground_addon.core.findings import Finding
from softground_addon.core.loads.estimate import CharacterLoads
from softground_addon.core.numerics.slices import result_of
from tests.blender.characters.random_animals import Animal, make

TOLERANCE = 0.067
"""Two frames at 30 Hz [s], for bodies up to a metre at the hips; it goes with the time in which they swing."""
SLOWEST = 2.0
UNSEEN = 0.05
"""Time by which a contact may miss its bounds and need not be named [s]: a foot that begins to lift still rests."""
CODES = {"skin_without_step", "contact_without_step", "step_without_skin", "foot_twice"}
FEWEST = 0.75
"""Share of the frames in which a foot stands that a contact has at least which is late or short and no miss."""


@dataclass(frozen=True)
class Seen:
    """What was seen of an animal: what is wrong with its contacts, and what the self-check says of them."""

    wrong: list[str]
    findings: list[Finding]
    loads: CharacterLoads | None = None
    shot: Shot | None = None

    @property
    def named(self) -> bool:
        """True if each miss is named, or nothing is where nothing is wrong."""
        said = " ".join(finding.message for finding in self.findings)
        bones = [miss.split(": ")[-1].split(", ") for miss in self.wrong if "brief" not in miss]
        named = all(any(f"'{bone}'" in said for bone in of_miss) for of_miss in bones)
        return named and (bool(self.wrong) or not self.findings)


def seen(animal: Animal, *, skinned: bool = True) -> Seen:
    """The contacts of an animal, or of its bones alone, each miss with the bones that it is of, and `GROSS` where a
    foot prints twice, elsewhere or hardly."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    armature, carriers = make(animal)
    if not skinned:
        bpy.data.objects.remove(armature.children[0])
    scene.softground.sink_feet = False
    try:
        character = add_character(scene, armature)
        soles = [{part for part, _ in sole.parts.items()} or {sole.bone} for sole in character.soles]
        feet = [[foot for foot, bones in enumerate(carriers) if bones & parts] for parts in soles]
        wanted = settings_of(scene)
        shot = run(read_shot(wanted))
        loads = run(estimate_shot(wanted, shot))[0]
    except InputError as refusal:
        return Seen([f"GROSS: refused: {refusal}: "], [Finding("refused", "error", "''", "")])
    findings = checked(loads, shot) if skinned else []
    if sorted(feet) != [[foot] for foot in range(animal.legs)]:
        count = [feet.count([foot]) for foot in range(animal.legs)]
        strange = [parts for parts, foot in zip(soles, feet, strict=True) if len(foot) != 1]
        bad = [bones for bones, often in zip(carriers, count, strict=True) if often != 1] + strange
        return Seen([f"GROSS: a contact too many or too few: {', '.join(sorted(bones))}" for bones in bad], findings)
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
            brief = max(early.sum(), late.sum()) < UNSEEN * animal.rate
            kind = "GROSS" if gross else "brief" if brief else "timing"
            miss = f"{kind}: {early.sum()} frames too many, {late.sum()} too few"
            wrong.append(f"{miss}: {loads.motion.soles[number].sole.name}")
    return Seen(wrong, findings, loads, shot)


def checked(loads: CharacterLoads, shot: Shot) -> list[Finding]:
    """What the self-check says of contacts."""
    findings = result_of(skin_check(loads, loads.motion.skin, [], shot.terrain, "Ground"))
    return [finding for finding in findings if finding.code in CODES]


def misses(animal: Animal) -> list[str]:
    """What is wrong with the contacts of an animal."""
    return seen(animal).wrong


@pytest.mark.parametrize(
    ("first", "count", "right"),
    [
        pytest.param(0, 6, 1.0, marks=pytest.mark.slow),
        pytest.param(12, 50, 0.96, marks=pytest.mark.slow),
        pytest.param(1000, 1000, 0.98, marks=pytest.mark.marathon),
    ],
)
def test_every_foot_of_a_random_animal_prints_when_it_stands_and_the_self_check_names_those_that_do_not(
    addon, first, count, right
):
    animals = {seed: seen(Animal.drawn(seed)) for seed in range(first, first + count)}
    wrong = {seed: animal.wrong for seed, animal in animals.items() if animal.wrong}
    assert len(wrong) <= (1 - right) * count, wrong
    assert not [seed for seed, misses in wrong.items() if any("GROSS" in miss for miss in misses)], wrong
    assert not {seed: (animal.wrong, animal.findings) for seed, animal in animals.items() if not animal.named}


@pytest.mark.parametrize(
    "seed", [2, 12, 18, 36, 54, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (8, 20, 58, 61, 78))]
)
def test_every_foot_of_a_skeleton_without_a_skin_prints_when_it_stands(addon, seed):
    """Four to eight legs, of which names tell two, all or none, with feet on their shins or on the root."""
    assert not seen(Animal.drawn(seed), skinned=False).wrong


@pytest.mark.parametrize("seed", [7029, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (7032, 8056, 8161))])
def test_the_self_check_names_the_feet_of_those_that_run_and_lift_them_slowly(addon, seed):
    """Large ones at 48 to 60 frames a second, whose contacts are 7 to 20 frames too long by the speed of their feet."""
    assert seen(Animal.drawn(seed)).named


@pytest.mark.parametrize("seed", [1016, 1032, 1056])
def test_the_self_check_names_a_contact_that_is_absent_late_early_or_double(addon, seed):
    animal = seen(Animal.drawn(seed))
    assert not animal.wrong
    assert not animal.findings
    loads, number = animal.loads, seed % len(animal.loads.motion.soles)
    contacts, sole = loads.contacts, loads.motion.soles[number]
    late = round(0.25 * len(contacts.touching) / Animal.drawn(seed).cycles)
    on = contacts.touching[:, number]
    for changed in (np.zeros_like(on), np.where(np.arange(len(on)) < late, False, np.roll(on, late)), on | True):
        touching = contacts.touching.copy()
        touching[:, number] = changed
        wrong = replace(loads, contacts=replace(contacts, touching=touching))
        assert any(f"'{sole.sole.name}'" in finding.message for finding in checked(wrong, animal.shot))
    beside = np.array(sole.transforms[:])
    beside[..., 1, 3] += 0.3 * sole.sole.breadth
    twin = replace(sole, sole=replace(sole.sole, name="again"), transforms=beside)
    both = {name: with_twin(getattr(contacts, name), number) for name in ("touching", "clearance", "normal", "offset")}
    wrong = replace(loads, motion=replace(loads.motion, soles=(*loads.motion.soles, twin)))
    (double,) = checked(replace(wrong, contacts=replace(contacts, **both)), animal.shot)
    assert double.code == "foot_twice"
    assert f"'{sole.sole.name}', 'again' of" in double.message


def with_twin(values, number):
    """Arrays of contacts with one of them again at their end."""
    axis = 0 if values.ndim == 1 else 1
    return np.concatenate([values, np.take(values, [number], axis)], axis)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "period"), [(0.12, 0.57), (7.4, 2.1), (1.0, 3.0)])
def test_a_walk_on_the_spot_is_one_however_slow_it_is(addon, size, period):
    """Its feet slide no faster than those of others that stand."""
    walk = replace(Animal.drawn(3), size=size, period=period, duty=0.67, stride=0.35, on_the_spot=True, trembles=0.001)
    assert not misses(walk)


def test_toes_and_knees_are_those_of_their_own_leg_where_several_have_such_names(addon):
    """Middle legs are named as the others are but for a word that tells no part of a body."""
    assert not misses(replace(Animal.drawn(3), legs=6, foot="free", names="named", toes=True))


@pytest.mark.slow
def test_feet_that_tremble_and_slide_print_while_their_skin_stands(addon):
    """As a network or a capture without a filter leaves them: their speed does not tell when they stand."""
    large = replace(Animal.drawn(1208), legs=4, size=5.8, unit=1.0, rate=120, period=2.57, duty=0.64, stride=0.3)
    for seed in range(2):
        animal = replace(large, skates=0.066, trembles=0.0017, offset=0.234, seed=seed)
        assert not [miss for miss in misses(animal) if "GROSS" in miss]
