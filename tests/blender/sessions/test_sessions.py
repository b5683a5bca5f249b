"""Random sessions of an artist: whatever was pressed before, a bake plays its record, and clearing takes it away."""

import bpy
import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test
from mathutils import Matrix

from softground_addon.blender.ground import baked_ground, ground_surface
from softground_addon.blender.live import live
from softground_addon.blender.playback import playback
from softground_addon.core.playback.ramps import TOLERANCE
from softground_addon.core.playback.vertex_histories import CARVED_TOLERANCE
from softground_addon.core.record.pressed_ground import PressedGround
from tests.blender import fingerprints, shots
from tests.blender.grounds import plane
from tests.blender.playback.test_playback import world_positions

WALKERS = ("Ada", "Ben")
FIELDS = ("Coarse", "Fine")
FRAMES = 24


class ArtistAtWork(RuleBasedStateMachine):
    """A file with two characters that walk and two fields; ops as the buttons call them."""

    @initialize()
    def open_shot(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        for number, name in enumerate(WALKERS):
            walker = shots.walker(scene, frames=FRAMES)
            walker.name, walker.location.y = name, 0.6 * number
        for name, vertices in zip(FIELDS, (3, 120), strict=True):
            plane(scene, size=6.0, vertices=vertices).name = name
        scene.frame_start, scene.frame_end = 1, FRAMES
        scene.softground.cell_size = 0.03
        bpy.context.view_layer.update()
        self.untouched = self.of_user()
        self.add(WALKERS[0])

    def of_user(self):
        made = fingerprints.of_file()
        return (
            {name: thing for name, thing in made["objects"].items() if name in (*WALKERS, *FIELDS)}
            | {kind: made[kind] for kind in ("actions",)}
            | {name: mesh for name, mesh in made["meshes"].items() if name.startswith("Field")}
        )

    @property
    def options(self):
        return bpy.context.scene.softground

    def press(self, operator, **values):
        """Press a button; True if it did what it says, False if it refused with a message and changed nothing."""
        before = fingerprints.of_file()
        try:
            return operator(**values) == {"FINISHED"}
        except RuntimeError as error:
            said = str(error)
        assert said.startswith("Error: ")
        assert "Traceback" not in said
        assert fingerprints.of_file() == before
        return False

    @rule(name=st.sampled_from(WALKERS))
    def add(self, name):
        bpy.context.view_layer.objects.active = bpy.data.objects[name]
        self.press(bpy.ops.softground.add_character)

    @rule()
    def remove_last(self):
        if self.options.characters:
            self.options.characters.remove(len(self.options.characters) - 1)

    @rule(name=st.sampled_from((*FIELDS, None)))
    def choose_ground(self, name):
        if not live.is_on():
            self.options.ground = bpy.data.objects.get(name) if name else None

    @rule(size=st.sampled_from((0.02, 0.03, 0.05)))
    def choose_cell_size(self, size):
        self.options.cell_size = size

    @rule(detail=st.sampled_from(("AUTO", "ALWAYS", "NEVER")))
    def choose_detail(self, detail):
        self.options.detail = detail

    @rule(keys=st.booleans())
    def choose_shape_keys(self, keys):
        self.options.shape_keys = keys

    @rule(stiffness=st.sampled_from((1e5, 4e5)))
    def choose_material(self, stiffness):
        self.options.material.youngs_modulus = stiffness

    @rule(start=st.sampled_from((1, 6)), end=st.sampled_from((12, FRAMES)))
    def choose_frames(self, start, end):
        self.options.frame_start, self.options.frame_end = start, end

    @rule(tilt=st.booleans(), grounding=st.booleans())
    def choose_response(self, tilt, grounding):
        self.options.tilt.use, self.options.grounding.use = tilt, grounding

    @rule()
    def bake(self):
        if bpy.ops.softground.bake.poll() and self.press(bpy.ops.softground.bake):
            self.check_playback()

    @rule()
    def clear(self):
        if bpy.ops.softground.clear_bake.poll():
            self.press(bpy.ops.softground.clear_bake)

    @rule(frames=st.lists(st.integers(1, FRAMES), max_size=4), keep=st.booleans())
    def play_live(self, frames, keep):
        if bpy.ops.softground.live.poll() and self.press(bpy.ops.softground.live):
            for frame in frames:
                bpy.context.scene.frame_set(frame)
            assert self.press(bpy.ops.softground.live, keep=keep)
            if keep:
                self.check_playback()

    @rule(frame=st.integers(-3, FRAMES + 5))
    def go_to(self, frame):
        bpy.context.scene.frame_set(frame)

    @rule()
    def save_and_reload(self):
        path = self.folder / "shot.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.wm.open_mainfile(filepath=str(path))

    @precondition(lambda self: self.options.ground)
    @rule(with_mesh=st.booleans())
    def copy_ground_and_delete_the_copy(self, with_mesh):
        copy = baked_ground.display_mesh_of(self.options.ground).copy()
        if with_mesh:
            copy.data = copy.data.copy()
        bpy.context.scene.collection.objects.link(copy)
        bpy.context.view_layer.update()
        mesh = copy.data
        bpy.data.objects.remove(copy)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)

    @precondition(lambda self: self.options.ground and baked_ground.is_baked(self.options.ground))
    @rule(what=st.sampled_from(("object", "mesh", "modifier", "group")))
    def rename_what_was_made(self, what):
        display_mesh = baked_ground.display_mesh_of(self.options.ground)
        modifier = playback.modifier_of(display_mesh)
        things = {"modifier": modifier, "group": modifier and modifier.node_group}
        if display_mesh.name not in FIELDS:
            things |= {"object": display_mesh, "mesh": display_mesh.data}
        if thing := things.get(what):
            thing.name = f"{thing.name}.mine"

    @precondition(lambda self: self.options.ground and baked_ground.is_baked(self.options.ground))
    @rule()
    def remove_modifier(self):
        display_mesh = baked_ground.display_mesh_of(self.options.ground)
        if modifier := playback.modifier_of(display_mesh):
            display_mesh.modifiers.remove(modifier)

    @precondition(lambda self: self.options.ground)
    @rule()
    def delete_what_was_made(self):
        display_mesh = baked_ground.display_mesh_of(self.options.ground)
        if display_mesh.name not in FIELDS:
            bpy.data.objects.remove(display_mesh)

    @precondition(lambda self: self.options.ground and self.options.ground.name in FIELDS)
    @rule(place=st.sampled_from((0.0, 0.1)))
    def move_field(self, place):
        self.options.ground.matrix_world = Matrix.Translation((0.0, 0.0, place))  # hidden ones are not kept up to date

    def check_playback(self):
        """What is played is what is recorded, on each vertex, at some frames in no order."""
        ground = self.options.ground
        display_mesh = baked_ground.display_mesh_of(ground)
        footprints, about = baked_ground.load(ground)
        is_carved = not all(len(footprint.contact_cells) for footprint in footprints)
        allowed = TOLERANCE + CARVED_TOLERANCE * is_carved
        rest = ground_surface.rest_vertices(display_mesh, 1.0)
        cell = about["inputs"]["cell_size_m"]
        for frame in (FRAMES, 9.0, 14.5, 0.0):
            bpy.context.scene.frame_set(int(frame), subframe=frame % 1)
            shown = world_positions(display_mesh.evaluated_get(bpy.context.evaluated_depsgraph_get()))[:, 2]
            pressed = PressedGround.at(
                footprints,
                frame=frame,
                frame_rate=24.0,
                cell_size=cell,
                blur_sigma=baked_ground.baked_with(about, "blur_sigma"),
            )
            recorded = pressed.sample(*rest[:, :2].T).display
            assert np.abs(shown - rest[:, 2] - recorded).max() <= allowed + 1e-5

    def teardown(self):
        if live.is_on():
            bpy.ops.softground.live()
        for name in [thing.name for thing in bpy.data.objects if thing.type == "MESH"]:
            ground = bpy.data.objects.get(name)
            if ground and baked_ground.has_remains(ground):
                self.options.ground = ground
                self.press(bpy.ops.softground.clear_bake)
        if bpy.ops.softground.clear_bake.poll():
            self.press(bpy.ops.softground.clear_bake)
        for name in FIELDS:
            bpy.data.objects[name].location.z = 0.0
        bpy.context.scene.frame_set(1)
        bpy.context.view_layer.update()
        now = self.of_user()
        assert [name for name, thing in self.untouched.items() if now[name] != thing] == []


def work(folder, sessions):
    ArtistAtWork.folder = folder
    run_state_machine_as_test(
        ArtistAtWork,
        settings=settings(
            max_examples=sessions,
            stateful_step_count=25,
            phases=[Phase.generate],  # a session takes seconds: what it did is told, and is short enough
            suppress_health_check=list(HealthCheck),
        ),
    )


@pytest.mark.slow
def test_random_sessions(addon, tmp_path):
    work(tmp_path, 12)


@pytest.mark.marathon
def test_many_random_sessions(addon, tmp_path):
    work(tmp_path, 400)
