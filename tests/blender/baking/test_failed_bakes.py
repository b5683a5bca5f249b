"""A bake that fails while it makes what it is about to show leaves nothing behind, wherever it fails."""

import sys

import bpy
import numpy as np
import pytest

from softground_addon.blender import reuse
from softground_addon.blender.baking import bake_job
from tests.blender import fingerprints, shots
from tests.blender.grounds import field
from tests.tiers import slow_but_one

ON_NEW, ON_COPY, ON_ITSELF = "a new ground", "a finer copy", "the ground itself"


def shot(scene, where):
    """A walk that is about to be baked on a ground of some kind, whose vertex groups are empty, and of one vertex."""
    shots.walker(scene, frames=24)
    bpy.ops.softground.add_character()
    scene.softground.cell_size, scene.softground.frame_end = 0.03, 24
    if where != ON_NEW:
        ground = field(scene, vertices=4 if where == ON_COPY else 200)
        for name in ("Nobody", "Someone"):
            ground.vertex_groups.new(name=name)
        ground.vertex_groups["Someone"].add([5], 0.5, "REPLACE")
    bpy.context.view_layer.update()


def test_a_finer_copy_has_the_empty_vertex_groups_of_its_ground(scene):
    shot(scene, ON_COPY)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    copy = scene.objects["Field Trail"]
    assert [group.name for group in copy.vertex_groups] == ["Nobody", "Someone"]
    members = [(item.group, vertex.index) for vertex in copy.data.vertices for item in vertex.groups]
    assert (1, 5) in members
    assert all(group == 1 for group, _ in members)


class Failure:
    """Ends a job with an error at some call of a function of the add-on, while a ground is made and not shown yet."""

    def __init__(self, at=None):
        self.at, self.calls = at, 0

    def __call__(self, frame, event, _):
        code = frame.f_code
        if (
            event == "call" and "softground_addon" in code.co_filename and code.co_name != "<genexpr>"
        ):  # as it is closed
            self.calls += 1
            if self.calls == self.at:
                raise MemoryError

    def run(self, job):
        """Run a job with this failure; the number of calls up to the last step before the ground is shown."""
        until_shown = 0
        try:
            for progress in job:
                if progress.stage == "write" and progress.fraction < 1.0:
                    until_shown = self.calls
                    sys.setprofile(self)
        finally:
            sys.setprofile(None)
        return until_shown


@pytest.mark.slow
@pytest.mark.parametrize("where", slow_but_one([ON_COPY, ON_NEW, ON_ITSELF]))
def test_nothing_is_left_of_a_bake_that_fails_before_it_is_shown(opened_as, where):
    count = Failure().run(bake_job.bake(opened_as(shot, where)))
    scene = opened_as(shot, where)
    before = fingerprints.of_file()
    for at in np.linspace(1, count, 12).astype(int).tolist():
        reuse.forget()  # calls are counted in bakes from nothing
        with pytest.raises(MemoryError):
            Failure(at).run(bake_job.bake(scene))
        assert fingerprints.of_file() == before
