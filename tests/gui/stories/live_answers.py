"""A slider dragged in live mode at frame 150 of a walk: what the viewport shows meanwhile, and how soon."""

from __future__ import annotations

import time

import bpy
import numpy as np

from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk

FRAME = 150


def tell(hand: Hand, facts: dict) -> Steps:
    open_walk(FRAME)
    yield from on_new_ground(hand)
    scene().softground.carve = False  # live mode shows prints alone
    yield 0.5
    yield from hand.look_at_walk()
    yield from press_live(hand)
    scene().frame_set(FRAME)
    yield 1.0
    before, age = heights(), ages()
    newest, oldest = (age >= 0) & (age < 0.4), age > 3.0
    facts["before"] = [float(before[newest].min()), float(before[oldest].min())]

    field = yield from hand.find_field("depth_cm")
    depth = scene().softground.depth_cm
    with parts_timed() as parts:
        seen: list[list[float]] = []
        for _ in hand.drag(field, 200, steps=25, seconds=2.5):
            now = heights()
            seen.append([float(now[newest].min()), float(now[oldest].min())])
            yield _
        let_go, before_it = time.perf_counter(), len(parts)
        facts["while dragged"] = seen
        yield from hand.wait_for(lambda: not answering(), 10)
        facts["seconds after letting go"] = time.perf_counter() - let_go
        facts["parts after letting go"] = parts[before_it:]
    facts["parts"] = sorted(parts, reverse=True)[:8]
    facts["number of parts"] = len(parts)
    facts["depth"] = [depth, scene().softground.depth_cm]
    facts["after"] = [float(heights()[newest].min()), float(heights()[oldest].min())]
    yield from hand.picture("live_answers", in_docs=False)

    yield from press_live(hand, offset=0.75)
    yield 3.0
    ground = scene().softground.ground
    facts["kept"] = "softground_record" in ground.data
    facts["outdated"] = bpy.context.window_manager.softground.stale
    kept_heights = heights()
    bpy.ops.softground.bake("EXEC_DEFAULT")
    facts["baked again: differs by"] = float(np.abs(heights() - kept_heights).max())


def scene():
    return bpy.context.window_manager.windows[0].scene


def on_new_ground(hand: Hand) -> Steps:
    """Add the selected character and make a ground for it, in the panel."""
    yield from hand.open_sidebar()
    yield from hand.press_button("softground.add_character")
    yield 0.2
    yield from hand.wait_for(lambda: not bpy.context.window_manager.softground.is_baking, 60)
    yield from hand.press_button("softground.create_ground", offset=0.25)
    yield 0.2
    yield from hand.wait_for(lambda: not bpy.context.window_manager.softground.is_baking, 60)


def press_live(hand: Hand, offset: float = 0.5) -> Steps:
    """Start or end live mode in the panel, and wait for it."""
    yield from hand.press_button("softground.live", offset=offset)
    yield 0.2
    yield from hand.wait_for(lambda: not bpy.context.window_manager.softground.is_baking, 60)


def live():
    return module("live.live")


def answering():
    return live().is_answering()


class parts_timed:  # noqa: N801
    """What the parts of an answer take of the processor, in the order in which they are done [s]."""

    def __enter__(self) -> list[float]:
        mode, self.parts = live().state.live, []
        self.mode, self.answer = mode, mode.answer

        def timed(*arguments):
            started = time.thread_time()
            try:
                return self.answer(*arguments)
            finally:
                self.parts.append(time.thread_time() - started)

        mode.answer = timed
        return self.parts

    def __exit__(self, *_):
        del self.mode.answer


def heights():
    mesh = scene().softground.ground.data
    positions = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", positions)
    return positions.reshape(-1, 3)[:, 2].copy()


def ages():
    mesh = scene().softground.ground.data
    age = np.empty(len(mesh.vertices), dtype=np.float32)
    mesh.attributes["softground_age"].data.foreach_get("value", age)
    return age
