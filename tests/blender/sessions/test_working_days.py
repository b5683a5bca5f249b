"""Random working days of an animator, each lived with the add-on and without: what is the animator's is the same."""

import random
import subprocess

import bpy
import pytest

from softground_addon.blender.animation_layer.constraint_layer import LayerKind, is_own
from softground_addon.blender.compat import set_slot, slot_of
from softground_addon.blender.ground import baked_ground, look
from softground_addon.blender.live import live
from tests.blender import fingerprints, responders, shots
from tests.blender.grounds import plane
from tests.blender.sessions.test_versions import ROOT, VERSIONS

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

OWN = ("Field", "Path", "Crate", "Blades")
"""What the animator has on the stage: two grounds, a crate beside the walk, and loose blades that stand on it."""
ON_THE_RIG = {
    "bake": {},
    "bake_again": {},
    "clean_feet": {},
    "clear_bake": {},
    "remove_response": {},
    "remove_clean_feet": {},
    "sink_feet": {},
    "make_keys": {},
    "root_motion": {},
    "remove_root_motion": {},
    "walk_ahead": {},
    "response_preset": {"preset": ("WADING", "AS_ANIMATED")},
    "tilt_preset": {"source": ("AUTHORS", "DEFAULT", "PAPER")},
    "add_foot_lock": {},
    "add_sample_meadow": {},
    "load_preset": {"name": ("Snow", "Mud", "Dry Sand")},
    "region_preset": {"slot": (0, 1), "preset": ("mud", "snow", "none", "AS_GROUND")},
    "apply_look": {},
    "create_ground": {"use_selected": (False,)},
    "choose_ground": {},
    "remove_ground": {},
    "remove_hard_ground": {},
    "add_weather": {"preset": ("SNOWFALL", "SHOWER", "DRYING_BEACH")},
    "remove_weather": {},
    "mute_step": {},
    "duplicate_step": {},
    "reset_steps": {},
    "event_points": {},
    "event_markers": {},
    "force_curves": {},
    "final_mesh": {},
    "show_prints": {},
    "predict_depth": {},
    "detect_bones": {},
}
"""Buttons pressed while the rig is selected, each with what it is given."""
ON_THE_STAGE = {
    "use_as_ground": ("Field", "Path"),
    "add_ground": ("Crate", "Path"),
    "add_hard_ground": ("Crate", "Path"),
    "cover": ("Crate",),
    "give_way": ("Blades",),
}
"""Buttons pressed while one of the animator's own is."""
USUAL = ("bake", "clean_feet", "clear_bake", "remove_response", "bake")
ASKED = ("make_keys", "response_preset")
"""What changes the animator's own on request, the action and the scene's time: they are always undone."""


def stage(scene):
    """Put the animator's own things into the scene."""
    grounds = (("Field", 6.0, (0, -1, 0)), ("Path", 1.0, (0, -1.1, 0.01)), ("Crate", 0.4, (0.5, -0.6, 0.1)))
    for name, size, place in grounds:
        ground = plane(scene, size=size, vertices=5)
        ground.name, ground.location = name, place
        for material in ("Grass", "Gravel"):
            found = bpy.data.materials.get(material) or bpy.data.materials.new(material)
            found.use_fake_user = True
            ground.data.materials.append(found)
        ground.data.polygons[3].material_index = 1
    mesh = bpy.data.meshes.new("Blades")
    blade, roots = ((-0.01, 0), (0.01, 0), (0, 0.2)), ((x, y) for x in (-0.1, 0, 0.1) for y in (-0.3, -0.7))
    corners = [(x + beside, y, up) for x, y in roots for beside, up in blade]
    mesh.from_pydata(corners, [], [(i, i + 1, i + 2) for i in range(0, len(corners), 3)])
    scene.collection.objects.link(bpy.data.objects.new("Blades", mesh))


def of_material(material):
    nodes = [node.bl_idname for node in material.node_tree.nodes] if material.node_tree else []
    return tuple(material.diffuse_color), material.users, material.use_fake_user, nodes


class Day:
    """One day: the same deeds of the animator whether or not the add-on is used in between."""

    def __init__(self, rig, seed, folder, *, with_add_on, visits=False):
        self.visits = visits
        self.chance, self.with_add_on, self.path = (
            random.Random(f"{rig} {seed}"),
            with_add_on,
            str(folder / f"{with_add_on}.blend"),
        )
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.name = RIGS[rig]().name
        scene = bpy.context.scene
        stage(scene)
        scene.frame_start, scene.frame_end = 1, FRAMES
        bpy.context.view_layer.objects.active = self.rig
        if with_add_on:
            bpy.ops.softground.add_character()
            options = scene.softground
            options.frame_start, options.frame_end = 1, FRAMES
            options.cell_size, options.relief, options.debris, options.sink_feet = 0.03, "OFF", False, True
            if seed % 2:  # on grounds of the animator's, of two materials each
                options.ground = bpy.data.objects["Field"]
                options.grounds.add().object = bpy.data.objects["Path"]
                bpy.context.view_layer.update()
                bpy.ops.softground.region_preset(slot=1, preset="mud")
        bpy.ops.ed.undo_push(message="morning")

    @property
    def rig(self):
        return bpy.data.objects[self.name]

    def live(self, hours):
        """Do so many random deeds, and then clear."""
        chance, buttons = self.chance, (*ON_THE_RIG, *ON_THE_STAGE, "live", "switch")
        for hour in range(hours):
            deeds = self.key, self.strip, self.mute, self.rename, self.copy, self.save, self.undo
            deed = chance.choice((*deeds, self.elsewhere) if self.visits else deeds)
            luck, pressed = chance.random(), [chance.choice(USUAL), *chance.choices(buttons, k=2)]
            pressed = ["detect_bones", *pressed] if deed == self.rename else pressed  # as a bake of other bones says
            undone, seed = chance.random() < 0.3, chance.random()
            bpy.context.scene.frame_set(1 + int(luck * FRAMES))
            deed(luck, hour)
            if self.with_add_on:
                for button in pressed:
                    self.press(button, random.Random(seed), undone=undone or button in ASKED)
        if self.with_add_on:
            self.clear()
        bpy.context.scene.frame_set(1)

    def press(self, button, chance, *, undone):
        """Press a button as for this rig; what it did and is undone leaves the file as it was."""
        on = bpy.data.objects[chance.choice(ON_THE_STAGE[button])] if button in ON_THE_STAGE else self.rig
        for obj in bpy.context.view_layer.objects:
            obj.select_set(obj == on)
        bpy.context.view_layer.objects.active = on
        options = bpy.context.scene.softground
        if button == "switch":
            options.grounding.use = chance.random() < 0.7
            return
        if button == "live":
            self.play_live(chance)
            return
        operator = getattr(bpy.ops.softground, button)
        given = {name: chance.choice(values) for name, values in ON_THE_RIG.get(button, {}).items()}
        if not operator.poll():
            return
        bpy.context.view_layer.update()
        if undone:
            bpy.context.scene.frame_set(bpy.context.scene.frame_current)  # copies, too, are where the keys have them
            bpy.ops.ed.undo_push(message="before")
            before = fingerprints.of_file()
        self.call(operator, given)
        if undone:
            bpy.ops.ed.undo_push(message=button)
            bpy.ops.ed.undo()
            bpy.context.view_layer.update()
            changed = fingerprints.differences(before, fingerprints.of_file())
            assert not changed, f"{button} undone: {changed}"

    def call(self, operator, given):
        """Press a button, which may say no; True if it has not."""
        before = fingerprints.of_file()
        try:
            return operator(**given) == {"FINISHED"}
        except RuntimeError as refusal:
            if "Traceback" in str(refusal):
                raise
        changed = fingerprints.differences(before, fingerprints.of_file())
        assert not changed, f"{operator.idname_py()} refused, and changed {changed}"
        return False

    def play_live(self, chance):
        if bpy.ops.softground.live.poll() and self.call(bpy.ops.softground.live, {}):
            for frame in chance.choices(range(1, FRAMES), k=3):
                bpy.context.scene.frame_set(frame)
            self.call(bpy.ops.softground.live, {"keep": chance.random() < 0.5})

    def clear(self):
        """Take off all that the add-on has a button for, and the modifiers that its pages say to remove."""
        blades = bpy.data.objects["Blades"]
        blades.modifiers.clear()
        bpy.data.batch_remove([obj for obj in bpy.data.objects if obj.type == "CURVES"])  # meadows
        for mesh in [each.data for each in bpy.data.objects if " Final" in each.name]:  # which is theirs by now
            bpy.data.meshes.remove(mesh)
        for name in ("clear_bake", "remove_root_motion", "remove_weather"):
            bpy.context.view_layer.objects.active = self.rig
            if getattr(bpy.ops.softground, name).poll():
                self.call(getattr(bpy.ops.softground, name), {})
        assert not live.is_on()
        for name in OWN:
            ground = bpy.data.objects[name]
            if baked_ground.has_remains(ground) or look.count_over_theirs(ground):  # of a ground that was chosen before
                bpy.context.scene.softground.ground = ground
                self.call(bpy.ops.softground.clear_bake, {})

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
        bpy.context.scene.frame_set(bpy.context.scene.frame_current)  # where its own keys have it

    def save(self, _luck, _hour):
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.open_mainfile(filepath=self.path)
        bpy.ops.ed.undo_push(message="opened")

    def elsewhere(self, luck, _hour):
        """Open the file in this or an older Blender without the add-on, and save it there."""
        known = [ROOT / VERSIONS[version] / "bin" / "python" for version in ("4.2", "4.5")]
        python = [each for each in known if each.exists()][luck < 0.5 :][0]
        code = f"import bpy; bpy.ops.wm.open_mainfile(filepath={self.path!r}); bpy.ops.wm.save_mainfile()"
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        subprocess.run([str(python), "-c", code], check=True, capture_output=True, timeout=300)
        bpy.ops.wm.open_mainfile(filepath=self.path)
        bpy.ops.ed.undo_push(message="opened")

    def undo(self, luck, hour):
        bpy.ops.ed.undo_push(message="before")
        self.key(luck, hour)
        bpy.ops.ed.undo_push(message="key")
        bpy.ops.ed.undo()

    def belongings(self):
        """All that is the animator's: objects, meshes, actions with their users, tracks and strips."""
        for obj in bpy.data.objects:  # what the add-on adds to a rig is not the animator's
            for owner in (obj, *(obj.pose.bones if obj.pose else ())):
                for constraint in [each for each in owner.constraints if is_own(each)]:
                    owner.constraints.remove(constraint)
            for kind in KINDS:
                obj.pop(kind, None)
            obj.select_set(False)  # no work of the animator's, and Add Character selects
        bpy.context.view_layer.update()
        made = fingerprints.of_file()
        made["materials"] = {each.name: of_material(each) for each in bpy.data.materials}
        return {kind: made[kind] for kind in ("objects", "actions", "meshes", "materials")}


def check_a_day(rig, seed, folder, *, visits=False):
    days = []
    for with_add_on in (False, True):
        day = Day(rig, seed, folder, with_add_on=with_add_on, visits=visits)
        day.live(hours=8)
        days.append(day.belongings())
    for kind, without in days[0].items():
        changed = fingerprints.differences(without, {name: days[1][kind].get(name) for name in without})
        assert not changed, f"{rig}, day {seed}: {kind}: {changed}"


@pytest.mark.parametrize("rig", [pytest.param(rig, marks=[pytest.mark.slow] * (rig != "walker")) for rig in RIGS])
def test_a_random_working_day(addon, tmp_path, rig):
    for seed in range(1 if rig == "walker" else 5):
        check_a_day(rig, seed, tmp_path)


@pytest.mark.marathon
@pytest.mark.parametrize("rig", RIGS)
def test_many_random_working_days(addon, tmp_path, rig):
    for seed in range(100, 140):
        check_a_day(rig, seed, tmp_path, visits=seed % 4 == 0)  # another Blender takes seconds to start
