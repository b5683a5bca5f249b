"""What panels and the overlay tell of a bake to come: nothing is computed while they are drawn."""

import bpy
import pytest

from softground_addon.blender import analysis, forecast, live
from softground_addon.core.errors import InputError
from tests.blender.shots import walker


@pytest.fixture
def shot(scene):
    walker(scene, frames=48)
    bpy.ops.softground.add_character()
    yield scene
    live.discard()
    forecast.unregister()


@pytest.fixture
def drawing(monkeypatch):
    """Whatever takes its time fails."""

    def fail(*_arguments):
        raise AssertionError("computed while drawing")

    def draw(scene):
        with monkeypatch.context() as patch:
            for heavy in ("deepest", "estimate_shot", "read_shot", "stance_loads"):
                patch.setattr(analysis, heavy, fail)
            return forecast.of(scene)

    return draw


def softer(scene):
    scene.softground.material.youngs_modulus /= 2


def heavier(scene):
    scene.softground.characters[0].mass *= 2


def by_impulse(scene):
    scene.softground.characters[0].force_model = "IMPULSE"


def test_there_is_none_before_the_shot_was_read(shot, drawing):
    assert drawing(shot) is None


@pytest.mark.parametrize("change", [softer, heavier, by_impulse])
def test_a_change_is_marked_at_once_and_worked_out_soon(shot, drawing, change):
    bpy.ops.softground.predict_depth()
    before = drawing(shot)
    assert before.is_current
    change(shot)
    outdated = drawing(shot)
    assert not outdated.is_current
    assert outdated.depth == before.depth
    assert bpy.app.timers.is_registered(forecast._work_out)
    forecast._work_out()
    after = drawing(shot)
    assert after.is_current
    assert after.depth == analysis.expected_depth(shot)
    assert after.depth != pytest.approx(before.depth, rel=1e-3)


def test_what_cannot_be_worked_out_is_known_no_more(shot, drawing, monkeypatch):
    def refuse(*_arguments):
        raise InputError("nobody touches the ground")

    bpy.ops.softground.predict_depth()
    drawing(shot)
    heavier(shot)
    assert not drawing(shot).is_current
    with monkeypatch.context() as patch:
        patch.setattr(analysis, "_estimated", refuse)
        forecast._work_out()
    assert drawing(shot) is None  # and not worked out at every drawing


def test_a_heavier_character_presses_deeper_in_live_mode_from_then_on(shot, drawing):
    bpy.ops.softground.live()
    shot.frame_set(48)

    def deepest():
        return min(vertex.co.z for vertex in shot.softground.ground.data.vertices)

    before = deepest()
    heavier(shot)
    drawing(shot)
    forecast._work_out()
    assert deepest() < 1.5 * before
