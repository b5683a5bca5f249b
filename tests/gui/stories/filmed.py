"""For the moving picture of docs/gallery.md: live mode played in the viewport, then the depth dragged in the panel."""

from __future__ import annotations

import subprocess
from math import pi, sin

import bpy
from mathutils import Euler

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk
from tests.gui.stories.live_answers import answering, heights, on_new_ground, press_live, scene

FRAMES, FIRST, LAST = 100, 8, 84
"""Of the walk, and of it what is shown."""
DEEPER, BEGUN = 130, 0.58
"""How far the field of the depth is dragged, and then back again by a third [px]; where, over the sidebar's width."""


def tell(hand: Hand, facts: dict) -> Steps:
    open_walk(FRAMES)
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("WINDOW")):
        bpy.ops.screen.screen_full_area(use_hide_panels=True)
    yield 0.5
    yield from on_new_ground(hand)
    yield 0.5
    yield from press_live(hand)
    field = yield from hand.find_field("depth_cm", BEGUN)
    set_the_view(hand)  # which is slow to draw, so that nothing is looked for in it
    scene().frame_set(FIRST)
    yield 1.0

    film = Film(hand, facts)
    scene().sync_mode = "NONE"  # every frame, however long each takes to be drawn by software
    yield from hand.move(*hand.middle())
    yield from hand.key("SPACE")
    while scene().frame_current < LAST:
        film.take("played", scene().frame_current)
        yield 0.01
    yield from hand.key("SPACE")
    scene().frame_set(LAST)
    yield 0.5

    facts["depths"], facts["deepest"] = [], [float(heights().min())]
    yield from hand.move(*field)
    hand.event("LEFTMOUSE", "PRESS")
    for moment in range(41):
        hand.place = (field[0] + round(DEEPER * sin(0.75 * pi * moment / 40)), field[1])
        hand.event("MOUSEMOVE", "NOTHING")
        yield 0.1
        yield from hand.wait_for(lambda: not answering(), 30)
        yield 0.1
        film.take("dragged", moment)
        facts["depths"].append(scene().softground.depth_cm)
        facts["deepest"][1:] = [min(facts["deepest"][-1], float(heights().min()))]
    hand.event("LEFTMOUSE", "RELEASE")
    yield 0.2


def set_the_view(hand: Hand) -> None:
    """Over the prints, in materials and low sun, with nothing of Blender's own drawn over it."""
    space = hand.area().spaces.active
    space.overlay.show_overlays = space.show_gizmo = False
    hand.show_materials((0.21, 0.535))
    view = space.region_3d
    view.view_perspective = "PERSP"
    view.view_location, view.view_distance = (-0.45, -1.95, 0.0), 2.9
    view.view_rotation = Euler((1.15, 0.0, 2.55)).to_quaternion()


class Film:
    """Pictures of the window, and where the mouse was in each, as the screen's pictures leave it out."""

    def __init__(self, hand: Hand, facts: dict) -> None:
        self.hand, self.pictures = hand, facts.setdefault("pictures", [])

    def take(self, part: str, moment: int) -> None:
        """Keep what the window shows now, once for each moment of a part."""
        if self.pictures and self.pictures[-1][:2] == [part, moment]:
            return
        window, path = self.hand.window, self.hand.pictures / f"{part}_{moment:03d}.png"
        crop = ["-gravity", "SouthWest", "-crop", f"{window.width}x{window.height}+0+0", "+repage"]
        subprocess.run(["import", "-window", "root", *crop, "-quality", "10", str(path)], check=True)
        self.pictures.append([part, moment, self.hand.place[0], window.height - self.hand.place[1]])
