"""A bake that is disturbed in every way that an artist can think of. At last Blender is quit while it runs."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

from tests.blender import fingerprints
from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk

FRAMES = 250

CELLS = 0.01
SLOW_CELLS = 0.002
"""Cells of a ground, and of bakes that last until they are disturbed [m]."""

READING, PRESSING = 0.1, 0.62
"""Progress at which a bake reads the animation, and at which it presses the ground."""

RENDER_SECONDS = 10.0

ADD_ON = "bl_ext.user_default.softground"


def tell(hand: Hand, facts: dict) -> Steps:  # noqa: PLR0915  (a story is one after the other)
    shot = hand.pictures / "shot.blend"
    make_shot(hand, shot)
    content = checksum(shot)
    before = fingerprints.of_file()

    # another scene is looked at
    yield from begin(hand)
    hand.window.scene = bpy.data.scenes["Other"]
    yield 0.5
    facts["other scene: objects"] = [thing.name for thing in hand.window.scene.objects]
    yield from escape(hand)
    hand.window.scene = bpy.data.scenes["Scene"]
    yield 0.3
    facts["other scene: as before"] = fingerprints.of_file() == before

    # rig and ground are renamed
    for kind, progress in (("rig", READING), ("ground", PRESSING)):
        yield from begin(hand, progress)
        thing = rig() if kind == "rig" else scene().softground.ground
        name, thing.name = thing.name, "It's me"
        yield 1.0
        yield from escape(hand)
        bpy.data.objects["It's me"].name = name
        facts[f"renamed {kind}: as before"] = fingerprints.of_file() == before

    # rig, ground and scene are deleted
    for kind, progress in (("rig", READING), ("rig", PRESSING), ("ground", PRESSING), ("scene", READING)):
        yield from begin(hand, progress)
        delete(hand, kind)
        after = without_traces(fingerprints.of_file())
        yield from hand.wait_for(lambda: not session().is_baking, 120)
        facts[f"deleted {kind} at {progress}: changed"] = differences(after, fingerprints.of_file())
        yield from reopen(hand, shot)

    # another file is opened
    yield from begin(hand)
    yield from reopen(hand, shot)
    facts["reopened: baking"] = session().is_baking
    facts["reopened: file as before"] = checksum(shot) == content
    before = fingerprints.of_file()

    # the add-on is disabled and enabled
    yield from begin(hand)
    bpy.ops.preferences.addon_disable(module=ADD_ON)
    yield from hand.move(*hand.middle())  # Blender lets go of the operator at the next event, and crashes without one
    yield 0.5
    bpy.ops.preferences.addon_enable(module=ADD_ON)
    yield 0.5
    facts["disabled: baking"] = session().is_baking
    facts["disabled: changed"] = differences(before, fingerprints.of_file())

    # a render begins while it bakes, though not by a key
    keep_render_busy()
    scene().softground.cell_size = CELLS / 2
    yield from begin(hand)
    for place in (hand.middle(), in_panel(hand)):
        yield from hand.move(*place)
        yield from hand.key("F12")
        yield 0.2
    facts["F12: renders"] = bpy.app.is_job_running("RENDER")
    with_viewport(hand, bpy.ops.render.render, "INVOKE_DEFAULT")
    yield 0.3
    progress = session().progress
    yield 1.0
    facts["render: runs"] = bpy.app.is_job_running("RENDER")
    facts["render: bake waits"] = session().is_baking and session().progress == progress
    facts["render: status"] = session().status
    yield from hand.wait_for(lambda: not bpy.app.is_job_running("RENDER"), 60)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    facts["render ended: steps"] = scene().softground.ground.data["softground_summary"]["steps"]

    # no bake begins while a render runs
    yield from reopen(hand, shot)
    keep_render_busy()
    yield 0.5  # drawn with another engine, Blender's own panels give the active object properties of that engine
    before = fingerprints.of_file()
    with_viewport(hand, bpy.ops.render.render, "INVOKE_DEFAULT")
    yield 0.5
    facts["rendering: runs"] = bpy.app.is_job_running("RENDER")
    facts["rendering: may bake"] = with_viewport(hand, bpy.ops.softground.bake.poll)
    facts["rendering: may go live"] = with_viewport(hand, bpy.ops.softground.live.poll)
    yield from hand.wait_for(lambda: not bpy.app.is_job_running("RENDER"), 60)
    facts["rendered: changed"] = differences(before, fingerprints.of_file())

    # the last word: the teller quits Blender while it bakes
    yield from reopen(hand, shot)
    yield from begin(hand)
    facts["quit: baking"] = session().is_baking
    facts["quit: file"], facts["quit: checksum"] = str(shot), content


def make_shot(hand: Hand, path: Path) -> None:
    """Save a character on a ground, filmed from above, and a scene beside it."""
    open_walk(FRAMES)
    with_viewport(hand, bpy.ops.softground.add_character)
    scene().softground.cell_size = CELLS
    bpy.data.objects["Walker"].select_set(False)
    with_viewport(hand, bpy.ops.softground.create_ground)
    scene().softground.cell_size = SLOW_CELLS
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene().collection.objects.link(camera)
    camera.location = (0.3, 0.0, 5.0)
    scene().camera = camera
    bpy.data.scenes.new("Other")
    with_viewport(hand, bpy.ops.wm.save_as_mainfile, filepath=str(path))


def keep_render_busy() -> None:
    """Have the next render last for some seconds."""
    bpy.context.preferences.view.render_display_type = "NONE"
    render, cycles = scene().render, scene().cycles
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = 256
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = 1_000_000, False, False
    cycles.time_limit = RENDER_SECONDS


def begin(hand: Hand, progress: float = READING) -> Steps:
    """Start a bake and wait until it is so far."""
    with_viewport(hand, bpy.ops.softground.bake, "INVOKE_DEFAULT")
    yield from hand.wait_for(lambda: session().progress > progress or not session().is_baking, 120)
    if not session().is_baking:
        raise RuntimeError(f"the bake was over before it came to {progress}")


def escape(hand: Hand) -> Steps:
    yield from hand.move(*hand.middle())
    yield from hand.key("ESC")
    yield from hand.wait_for(lambda: not session().is_baking, 10)


def reopen(hand: Hand, path: Path) -> Steps:
    with_viewport(hand, bpy.ops.wm.open_mainfile, filepath=str(path))
    yield 1.0


def delete(hand: Hand, kind: str) -> None:
    if kind == "scene":
        hand.window.scene = bpy.data.scenes["Other"]
        bpy.data.scenes.remove(bpy.data.scenes["Scene"])
    else:
        bpy.data.objects.remove(rig() if kind == "rig" else scene().softground.ground)


def without_traces(traces: dict) -> dict:
    """A fingerprint that was taken while a bake ran, without what exists only then."""
    return {
        kind: {k: v for k, v in things.items() if "SoftGround Sampling" not in k} for kind, things in traces.items()
    }


def differences(before: dict, after: dict) -> list[str]:
    """Names of what is not the same in two fingerprints."""
    return [
        f"{kind} {name}"
        for kind in before
        for name in {**before[kind], **after[kind]}
        if before[kind].get(name) != after[kind].get(name)
    ]


def with_viewport(hand: Hand, operator: Callable[..., Any], *arguments: str, **settings: Any) -> Any:
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("WINDOW")):
        return operator(*arguments, **settings)


def in_panel(hand: Hand) -> tuple[int, int]:
    region = hand.region()
    return region.x + region.width // 2, region.y + region.height // 2


def checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def rig() -> Any:
    return scene().softground.characters[0].armature


def scene() -> Any:
    return bpy.context.window_manager.windows[0].scene


def session() -> Any:
    return bpy.context.window_manager.softground
