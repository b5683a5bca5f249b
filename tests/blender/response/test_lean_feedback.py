"""The two-way loop: the ground that the lean follows from is the ground that the leaning body pressed."""

import bpy
import numpy as np
import pytest

from softground_addon.core.composers import ground_plan, pressed_shot
from softground_addon.core.composers.responses import LEAN_PASSES, NOTICEABLE_LEAN
from softground_addon.core.loads import estimate
from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.numerics.slices import sliced
from tests.blender import responders, shots
from tests.blender.grounds import plane


@pytest.mark.slow
def test_the_lean_that_is_keyed_is_the_lean_that_pressed_the_ground(scene, monkeypatch):
    shots.walker(scene)
    bpy.ops.softground.add_character()
    scene.softground.tilt.strength = 1.0
    scene.softground.material.youngs_modulus = 6e4
    leans, answers = [], []
    leaning, responses_of = pressed_shot.leaning, pressed_shot.responses_of

    @sliced
    def watched(*arguments):
        leans.append((yield from leaning.slices(*arguments)))
        return leans[-1]

    @sliced
    def recorded(*arguments):
        answers.extend((yield from responses_of.slices(*arguments)))
        return answers

    monkeypatch.setattr(pressed_shot, "leaning", watched)
    monkeypatch.setattr(pressed_shot, "responses_of", recorded)
    responders.bake(scene)
    first, last = leans[0].leans[0], answers[0].response.lean
    assert np.abs(first).max() > NOTICEABLE_LEAN, "the body sways over its own prints"
    assert 2 <= len(leans) < LEAN_PASSES, "a few passes are enough"
    pressed_by = leans[-2].leans[0]
    assert np.abs(last - pressed_by).max() < NOTICEABLE_LEAN


@pytest.mark.parametrize(("given", "times"), [(True, 1), (False, 2)])
def test_contacts_are_looked_for_once_with_a_ground_that_is_there(scene, monkeypatch, given, times):
    """A ground that is made is laid out by the contacts with the plane that it is made of."""
    shots.walker(scene, frames=24)
    bpy.ops.softground.add_character()
    scene.softground.frame_end = 24
    scene.softground.ground = plane(scene) if given else None
    bpy.context.view_layer.update()
    leans = []

    @sliced
    def counted(motion, terrain):
        leans.append(motion.name)
        return (yield from detect_contacts.slices(motion, terrain))

    monkeypatch.setattr(estimate, "detect_contacts", counted)
    monkeypatch.setattr(ground_plan, "detect_contacts", counted)
    bpy.ops.softground.bake()
    assert len(leans) == times


@pytest.mark.slow
def test_what_cannot_lean_stays_as_it_is_and_its_loads_are_found_once(scene, monkeypatch):
    shots.walker(scene)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.2, location=(1, 1, 0.2))
    bpy.ops.softground.add_character()
    scene.softground.tilt.strength = 1.0
    scene.softground.material.youngs_modulus = 6e4
    passes, leans = [], []
    leaning, free_loads = pressed_shot.leaning, estimate.free_loads

    @sliced
    def watched(loads, motions, *others):
        passes.append((yield from leaning.slices(loads, motions, *others)))
        assert passes[-1].motions[1] is motions[1]
        return passes[-1]

    def counted(motion, *others, **options):
        leans.append(motion.name)
        return free_loads(motion, *others, **options)

    monkeypatch.setattr(pressed_shot, "leaning", watched)
    monkeypatch.setattr(estimate, "free_loads", counted)
    responders.bake(scene)
    assert len(passes) > 1
    assert leans == ["Sphere"]
