"""A hand on mouse and keyboard of a real Blender, and an eye on its window. Runs inside Blender."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from math import pi
from pathlib import Path
from typing import Any

import bpy
from mathutils import Euler

Pause = float
"""Seconds until the story goes on; Blender handles events and draws in between."""

Steps = Iterator[Pause]

PAGES = 2
"""How often the sidebar is looked through, each time further down."""

PATIENCE = 4.0
"""How many times longer than a quiet machine a busy one may take before a story gives up."""

SHORT: Pause = 0.03
ROW = 11
"""Distance between two places where a button is looked for, little more than half a button's height [px]."""


def module(name: str) -> Any:
    """A module of the add-on's Blender side, whatever Blender has named its package."""
    return next(item for key, item in sys.modules.items() if key.endswith(f"softground_addon.blender.{name}"))


class Hand:
    """Moves, clicks, types and looks, by simulated events of the first window."""

    def __init__(self, pictures: Path) -> None:
        self.pictures = pictures
        self.for_docs = "PICTURES_OF_DOCS" in os.environ
        """Pictures of materials in light, which take minutes without a graphics card, are wanted too."""
        self.place = (0, 0)

    @property
    def window(self) -> Any:
        return bpy.context.window_manager.windows[0]

    def area(self, kind: str = "VIEW_3D") -> Any:
        return max((a for a in self.window.screen.areas if a.type == kind), key=lambda a: a.width * a.height)

    def region(self, kind: str = "UI", area: str = "VIEW_3D") -> Any:
        return next(region for region in self.area(area).regions if region.type == kind)

    def event(self, kind: str, value: str, **modifiers: bool) -> None:
        x, y = self.place
        self.window.event_simulate(kind, value, x=x, y=y, **modifiers)

    def move(self, x: int, y: int) -> Steps:
        self.place = (int(x), int(y))
        self.event("MOUSEMOVE", "NOTHING")
        yield SHORT

    def click(self, x: int, y: int) -> Steps:
        yield from self.move(x, y)
        yield SHORT
        self.event("LEFTMOUSE", "PRESS")
        yield SHORT
        self.event("LEFTMOUSE", "RELEASE")
        yield SHORT

    def key(self, kind: str, **modifiers: bool) -> Steps:
        self.event(kind, "PRESS", **modifiers)
        yield SHORT
        self.event(kind, "RELEASE", **modifiers)
        yield SHORT

    def type(self, text: str) -> Steps:
        names = {".": "PERIOD", " ": "SPACE", "_": "MINUS", **dict(zip("0123456789", _DIGITS, strict=True))}
        for letter in text:
            x, y = self.place
            kind = names.get(letter, letter.upper())
            self.window.event_simulate(kind, "PRESS", unicode=letter, x=x, y=y)
            yield SHORT
            self.window.event_simulate(kind, "RELEASE", x=x, y=y)
        yield SHORT

    def wait_for(self, condition: Callable[[], bool], seconds: float) -> Steps:
        """Wait for what a quiet machine does in some seconds, and a busy one in `PATIENCE` times as many."""
        waited = 0.0
        while not condition():
            if waited > PATIENCE * seconds:
                raise TimeoutError(f"waited {seconds} s in vain")
            yield 0.1
            waited += 0.1

    def picture(self, name: str, *, of: str = "", is_high: bool = False, in_docs: bool = True) -> Steps:
        """Keep what the window shows, or one region of the viewport; as high as the window where a menu hangs out."""
        yield 0.5
        place = f"{self.window.width}x{self.window.height}+0+0"
        if of:
            region = self.region(of)
            height, below = (self.window.height, 0) if is_high else (region.height, region.y)
            place = f"{region.width}x{height}+{region.x}+{below}"
        crop = ["-gravity", "SouthWest", "-crop", place, "+repage"]
        folder = self.pictures / "docs" if in_docs else self.pictures
        folder.mkdir(exist_ok=True)
        subprocess.run(["import", "-window", "root", *crop, str(folder / f"{name}.png")], check=True)

    def open_sidebar(self, tab: str = "SoftGround") -> Steps:
        self.area().spaces.active.show_region_ui = True
        yield 0.5
        self.region().active_panel_category = tab
        self.region().tag_redraw()
        yield 0.5

    def middle(self) -> tuple[int, int]:
        """A place in the viewport, beside the panels."""
        region = self.region("WINDOW")
        return region.x + region.width // 3, region.y + region.height // 3

    def frame_all(self) -> Steps:
        """Show all objects in the viewport."""
        with bpy.context.temp_override(window=self.window, area=self.area(), region=self.region("WINDOW")):
            bpy.ops.view3d.view_all()
        yield 0.5

    def look_at_walk(self) -> Steps:
        """Look along the walk from the side and above, at the height of the feet."""
        space = self.area().spaces.active
        space.region_3d.view_perspective = "PERSP"
        place = self.window.scene.objects["Walker"].pose.bones[0].head
        space.region_3d.view_location = (place.x, place.y, 0.25)
        space.region_3d.view_distance = 3.2
        space.region_3d.view_rotation = Euler((1.05, 0.0, 0.9)).to_quaternion()
        yield 0.7

    def look_at_prints(self, place: tuple[float, float, float], turn: float, distance: float) -> Steps:
        """Look somewhat down at prints around a place, without what else the viewport draws over them."""
        over, view = self.area().spaces.active.overlay, self.area().spaces.active.region_3d
        over.show_outline_selected = over.show_floor = over.show_axis_x = over.show_axis_y = over.show_bones = False
        view.view_perspective, view.view_location, view.view_distance = "PERSP", place, distance
        view.view_rotation = Euler((1.05, 0.0, turn)).to_quaternion()
        yield 0.7

    def show_wires(self) -> None:
        """What a story without pictures looks at: without a graphics card, light takes seconds to draw."""
        self.area().spaces.active.shading.type = "WIREFRAME"

    def show_materials(self, sun: tuple[float, float]) -> None:
        """Materials in the light of a low sun, as high and at such an angle about z [rad], and of little else."""
        light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        light.data.energy, light.data.color, light.data.angle = 5.0, (1.0, 0.84, 0.66), 0.02
        light.rotation_euler = (pi / 2 - sun[0], 0.0, sun[1])
        self.window.scene.collection.objects.link(light)
        shading = self.area().spaces.active.shading
        shading.type, shading.studio_light, shading.studiolight_intensity = "MATERIAL", "forest.exr", 0.6
        shading.use_scene_lights, shading.use_studiolight_view_rotation = True, False

    def choose_in_menu(self, place: tuple[int, int], letter: str) -> Steps:
        """Open a menu and choose the entry that is underlined at a letter."""
        yield from self.click(*place)
        yield 0.5
        yield from self.key(letter)
        yield 0.5

    def click_down_from(self, place: tuple[int, int], *, until: Callable[[], bool]) -> Steps:
        """Click at a place and, row by row, below it, where keys such as those of `find_button` are not taken."""
        x, y = place
        while not until() and y > self.region().y:
            yield from self.click(x, y)
            yield 0.1
            y -= ROW

    def find_button(self, operator: str, offset: float = 0.5, region: Any = None) -> Any:
        """Place of the button that runs an operator, by what Ctrl-C copies from it; None where there is none.

        A generator like the others: `place = yield from hand.find_button(...)`. Looks in the sidebar if no other region
        is given, and scrolls down if the button is not in sight.
        """
        for _ in range(PAGES):
            place = yield from self._find_in_sight(operator, offset, region or self.region())
            if place:
                return place
            for _turn in range(6):
                yield from self.key("WHEELDOWNMOUSE")
        return None

    def _find_in_sight(self, operator: str, offset: float, region: Any) -> Any:
        x = region.x + int(region.width * offset)
        for y in range(region.y + region.height - ROW, region.y, -ROW):
            bpy.context.window_manager.clipboard = ""
            yield from self.move(x, y)
            yield from self.key("C", ctrl=True)
            if operator in bpy.context.window_manager.clipboard:
                return x, y
        return None

    def find_field(self, path: str, offset: float = 0.75) -> Any:
        """Place of the field of a property, by the end of the data path that Shift-Ctrl-C copies from it."""
        region = self.region()
        x = region.x + int(region.width * offset)
        for y in range(region.y + region.height - ROW, region.y, -ROW):
            bpy.context.window_manager.clipboard = ""
            yield from self.move(x, y)
            yield from self.key("C", ctrl=True, shift=True)
            if bpy.context.window_manager.clipboard.endswith(path):
                return x, y
        raise LookupError(f"there is no field for {path} in the sidebar")

    def drag(self, place: tuple[int, int], by: int, *, steps: int, seconds: float) -> Steps:
        """Drag a field sideways by some pixels, in even steps."""
        x, y = place
        yield from self.move(x, y)
        self.event("LEFTMOUSE", "PRESS")
        for step in range(1, steps + 1):
            self.place = (x + by * step // steps, y)
            self.event("MOUSEMOVE", "NOTHING")
            yield seconds / steps
        self.event("LEFTMOUSE", "RELEASE")
        yield SHORT

    def press_button(self, operator: str, offset: float = 0.5, region: Any = None) -> Steps:
        place = yield from self.find_button(operator, offset, region)
        if place is None:
            raise LookupError(f"there is no button for {operator}")
        yield from self.click(*place)


_DIGITS = ("ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
