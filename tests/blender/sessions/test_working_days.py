"""Random working days of an animator, each lived with the add-on and without: what is the animator's is the same."""

import random

import bpy
import pytest

from softground_addon.blender.animation_layer.constraint_layer import LayerKind, is_own
from softground_addon.blender.compat import set_slot, slot_of
from tests.blender import fingerprints, responders, shots

FRAMES = 30
KINDS = tuple(kind.value for kind in LayerKind)

RIGS = {
    "walker": lambda: shots.walker(bpy.context.scene, frames=FRAMES),
    "mixamo": lambda: responders.as_mixamo(shots.walker(bpy.context.scene, frames=FRAMES)),
    "object": lambda: responders.moved_by_its_object(shots.walker(bpy.context.scene, frames=FRAMES)),
    "feet on a root": lambda: responders.with_feet_on_a_root(
        shots.walker(bpy.context.scene, frames=FRAMES), frames=FRAMES
    ),
    "ik": responders.with_ik,
}


class Day:
    """One day: the same deeds of the animator whether or not the add-on is used in between."""

    def __init__(self, rig, seed, folder, *, with_add_on):
        self.seed, self.with_add_on, self.path = seed, with_add_on, str(folder / f"{with_add_on}.blend")
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.name = RIGS[rig]().name
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 1, FRAMES
        bpy.context.view_layer.objects.active = self.rig
        if with_add_on:
            bpy.ops.softground.add_character()
            options = scene.softground
            options.frame_start, options.frame_end = 1, FRAMES
            options.cell_size, options.relief, options.debris, options.sink_feet = 0.03, "OFF", False, True
        bpy.ops.ed.undo_push(message="morning")

    @property
    def rig(self):
        return bpy.data.objects[self.name]

    def live(self, hours):
        """Do so many random deeds, and then clear."""
        chance = random.Random(self.seed)
        for hour in range(hours):
            deed = chance.choice((self.key, self.strip, self.mute, self.rename, self.copy, self.save, self.undo))
            luck, action = (
                chance.random(),
                chance.choice(("bake", "clean_feet", "clear_bake", "remove_response", "bake")),
            )
            bpy.context.scene.frame_set(1 + int(luck * FRAMES))
            deed(luck, hour)
            if self.with_add_on:
                bpy.context.view_layer.objects.active = self.rig
                operator = getattr(bpy.ops.softground, action)
                if operator.poll():
                    self.press(operator)
        bpy.context.scene.frame_set(1)

    def press(self, operator):
        try:
            operator()
        except RuntimeError as refusal:
            if "Traceback" in str(refusal):
                raise

    def key(self, luck, hour):
        bones = self.rig.pose.bones
        bone = bones[int(luck * len(bones))]
        bone.location.x += 0.001 * hour
        bone.keyframe_insert("location", frame=1 + hour)

    def strip(self, luck, hour):
        animation = self.rig.animation_data
        if animation.action:
            track = animation.nla_tracks.new()
            track.name = ("SoftGround Response", "Mine")[luck < 0.5]
            set_slot(track.strips.new(f"strip {hour}", 1, animation.action), slot_of(animation))
            track.mute = luck < 0.7

    def mute(self, luck, _hour):
        self.rig.animation_data.use_nla = luck < 0.5

    def rename(self, luck, hour):
        if luck < 0.3 and self.rig.animation_data.action:
            self.rig.animation_data.action.name = f"Take {hour}"
        elif luck < 0.6:
            bones = self.rig.data.bones
            bones[int(luck * len(bones))].name = f"bone {hour}"
        else:
            self.rig.name = self.name = f"Hero {hour}"

    def copy(self, _luck, hour):
        copy = self.rig.copy()
        copy.name, copy.location.x = f"Double {hour}", 5.0
        bpy.context.scene.collection.objects.link(copy)

    def save(self, _luck, _hour):
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.open_mainfile(filepath=self.path)
        bpy.ops.ed.undo_push(message="opened")

    def undo(self, luck, hour):
        bpy.ops.ed.undo_push(message="before")
        self.key(luck, hour)
        bpy.ops.ed.undo_push(message="key")
        bpy.ops.ed.undo()

    def belongings(self):
        """All that is the animator's: objects, meshes, actions with their users, tracks and strips."""
        helpers = [obj for obj in bpy.data.objects if obj.get("softground_layer")]
        layers = {obj.animation_data.action.name for obj in helpers if obj.animation_data}
        for obj in bpy.data.objects:  # what the add-on adds to a rig is not the animator's
            for owner in (obj, *(obj.pose.bones if obj.pose else ())):
                for constraint in [each for each in owner.constraints if is_own(each)]:
                    owner.constraints.remove(constraint)
            for kind in KINDS:
                obj.pop(kind, None)
            obj.select_set(False)  # no work of the animator's, and Add Character selects
        bpy.context.view_layer.update()
        made = fingerprints.of_file()
        mine = {name for name in made["objects"] if not name.startswith("SoftGround")}
        return {
            "objects": {name: made["objects"][name] for name in mine},
            "actions": {name: content for name, content in made["actions"].items() if name not in layers},
            "meshes": {name: mesh for name, mesh in made["meshes"].items() if not name.startswith("SoftGround")},
        }


def check_a_day(rig, seed, folder):
    days = []
    for with_add_on in (False, True):
        day = Day(rig, seed, folder, with_add_on=with_add_on)
        day.live(hours=8)
        days.append(day.belongings())
    for kind, without in days[0].items():
        assert days[1][kind] == without, f"{rig}, day {seed}: {kind}"


@pytest.mark.parametrize("rig", [pytest.param(rig, marks=[pytest.mark.slow] * (rig != "walker")) for rig in RIGS])
def test_a_random_working_day(addon, tmp_path, rig):
    for seed in range(1 if rig == "walker" else 5):
        check_a_day(rig, seed, tmp_path)


@pytest.mark.marathon
@pytest.mark.parametrize("rig", RIGS)
def test_many_random_working_days(addon, tmp_path, rig):
    for seed in range(100, 140):
        check_a_day(rig, seed, tmp_path)
