"""Paws that hang on the root, or that no joint is known of, follow their prints; loads are as without that."""

import json
import sys
from dataclasses import replace

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.rigs.rest_pose import legs_of_feet
from tests.blender import shots
from tests.blender.characters.random_animals import Animal, make


def animal(**other):
    """A dog of half a metre at its hips, whose bones tell nothing."""
    still = {"toes": False, "skates": 0.0, "trembles": 0.0, "floats": 0.0, "grazes": False, "idle": False}
    shape = {"legs": 4, "size": 0.5, "unit": 1.0, "rate": 24, "period": 0.8, "duty": 0.65, "names": "unnamed"}
    place = {"on_the_spot": False, "carried": False, "turn": 0.0, "level": 0.0, "fine": False, "tail": False}
    return replace(Animal.drawn(3), **still, **shape, **place, **{"foot": "free", "rolls": False, **other})


def baked(scene, wanted, *, sinks):
    """The animal's armature, the bones that carry each paw, and the report of its bake."""
    armature, carriers = make(wanted)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    options = scene.softground
    options.relief, options.sink_feet, options.carve = "OFF", sinks, False
    options.characters[0].mass = 30.0
    return armature, carriers, jobs.run(bake_job.bake(scene)).report


def gaps_of_skin(scene, armature, carriers, steps):
    """Middle of each paw's underside over the ground that plays beneath it, frame by frame while it bears [m]."""
    skin, ground = armature.children[0], scene.softground.ground
    groups = [{group.index for group in skin.vertex_groups if group.name in bones} for bones in carriers]
    of_paw = [
        [v.index for v in skin.data.vertices if {g.group for g in v.groups if g.weight > 0.5} & of_foot]
        for of_foot in groups
    ]
    bone_of = {sole.name: sole.bone for sole in scene.softground.characters[0].soles}
    paw_of = {sole: [bone in bones for bones in carriers].index(True) for sole, bone in bone_of.items()}
    gaps = []
    for step in steps:
        first, last = np.ceil(step["frame_start"]) + 1, np.floor(step["frame_end"]) - 1
        for frame in np.arange(first, last + 1).astype(int):
            scene.frame_set(frame)
            graph = bpy.context.evaluated_depsgraph_get()
            posed, pressed = (places(obj.evaluated_get(graph)) for obj in (skin, ground))
            paw = posed[of_paw[paw_of[step["contact"]]]]
            under = np.linalg.norm(pressed[:, :2] - paw[:, :2].mean(axis=0), axis=1).argmin()
            gaps.append(np.sort(paw[:, 2])[:4].mean() - pressed[under, 2])
    return np.array(gaps)


def places(evaluated):
    at = np.empty(len(evaluated.data.vertices) * 3, np.float32)
    evaluated.data.attributes["position"].data.foreach_get("vector", at)
    matrix = np.array(evaluated.matrix_world)
    return at.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


@pytest.mark.slow
@pytest.mark.parametrize("foot", ["free", "chain"])
def test_all_four_paws_stand_in_their_prints_and_press_as_they_do_without(addon, foot):
    wanted, reports, gaps = animal(foot=foot), {}, {}
    for sinks in (False, True):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        armature, carriers, reports[sinks] = baked(scene, wanted, sinks=sinks)
        gaps[sinks] = gaps_of_skin(scene, armature, carriers, reports[sinks]["steps"])
    before, after = (
        [(step["id"], step["peak_force_n"], step["max_depth_m"]) for step in reports[sinks]["steps"]]
        for sinks in (False, True)
    )
    assert before == after
    deepest = max(depth for *_, depth in before)
    assert np.median(gaps[False]) > 0.6 * deepest, "they float where nothing lets them down"
    assert np.percentile(np.abs(gaps[True]), 95) < 0.2 * deepest, "soft edges come into so small a print"


def test_fore_and_hind_legs_are_found_once_each(addon):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    armature, carriers = make(animal())
    feet = sorted({bone for bones in carriers for bone in bones})
    legs = legs_of_feet(armature, feet)
    assert len({bone for bone, _ in legs.values()}) == len(legs) == 12
    heads = {joint: armature.data.bones[bone].head_local for joint, (bone, _) in legs.items()}
    assert (heads["ankle_l2"] - heads["ankle_l"]).length > (heads["ankle_l"] - heads["ankle_r"]).length


@pytest.mark.slow
@pytest.mark.parametrize(
    ("listing", "name"),
    [
        ("rigs", "fox_walk"),
        ("rigs", "rat_run"),
        ("rigs", "boxman_idle"),
        ("rigs2", "alpaca_kick"),
        ("rigs2", "cyber_walk"),
    ],
)
def test_feet_of_other_people_s_rigs_stand_in_their_prints(addon, tmp_path, listing, name):
    """Feet that hang on the root, and those that are the ends of shins."""
    folder = shots.SHARED / listing
    if not folder.exists():
        pytest.skip("the rigs of other people are not here: see docs/development.md")
    sys.path.append(str(shots.SHARED.parent / "tools"))
    import zoo

    clips = json.loads((folder / "rigs.json").read_text(encoding="utf-8"))
    zoo.imported(next(clip for clip in clips if clip["clip"] == name), folder, tmp_path / "shot.blend")
    bpy.ops.softground.add_character()
    scene = bpy.context.scene
    scene.softground.relief, scene.softground.sink_feet, scene.softground.carve = "OFF", True, False
    (before,), (after,) = (list(gaps.values()) for gaps in jobs.run(bake_job.bake(scene)).report["gaps_mm"].values())
    assert before["float"]["p95"] > 10
    assert max(after[of]["p95"] for of in ("float", "penetration")) < 1
