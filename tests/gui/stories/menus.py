"""Blender's own menus and the search, the preset menu with its pictures, the look on a terrain of one's own, and force
curves in the Graph Editor."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk
from tests.gui.stories.first_minutes import ended, layers
from tests.gui.stories.interrupted_bake import ADD_ON, scene, with_viewport
from tests.gui.stories.presets_and_search import search


def tell(hand: Hand, facts: dict) -> Steps:  # noqa: PLR0915  (a story is one after the other)
    armature = open_walk(48)
    terrain = terrain_of_the_user()
    yield from hand.open_sidebar()
    yield from hand.press_button("softground.add_character")
    yield from ended(hand)

    # a terrain with a material of its own
    select(terrain)
    yield from hand.press_button("softground.use_as_ground", offset=0.75)
    yield from ended(hand)
    yield 1.0
    facts["predicted"] = scene().softground.depth_cm
    facts["ground"] = scene().softground.ground.name if scene().softground.ground else ""

    # the preset menu
    with menu_timed("SOFTGROUND_MT_presets") as seconds:
        add = yield from hand.find_button("softground.save_preset", offset=0.83)
        for number in range(3):
            yield from hand.click(add[0] - 120, add[1])
            yield 1.0
            if number == 0:
                yield from hand.picture("preset_menu", in_docs=False)
            yield from hand.key("ESC")
            yield 0.3
        facts["preset menu"] = seconds
    facts["pictures"] = pictures()

    # the Object menu: Bake Footprints, by its place
    yield from hand.move(*hand.middle())
    with_viewport(hand, bpy.ops.wm.call_menu, name="VIEW3D_MT_object")
    yield 0.5
    yield from hand.picture("object_menu", in_docs=False)
    yield from hand.key("ESC")
    with_viewport(hand, bpy.ops.wm.call_menu, name="SOFTGROUND_MT_object")
    yield 0.5
    yield from hand.picture("softground_menu", in_docs=False)
    yield from hand.key("B")
    yield from ended(hand)
    facts["baked"] = "softground_summary" in displayed().data
    facts["before Apply Look"] = materials(terrain)
    yield from search(hand, "Apply Look")
    facts["after Apply Look"] = materials(displayed())
    facts["their material"] = materials(terrain)

    # force curves
    yield from search(hand, "Add Force Curves")
    area = hand.area("DOPESHEET_EDITOR")
    area.type = "GRAPH_EDITOR"
    yield 1.0
    with bpy.context.temp_override(window=hand.window, area=area, region=window_of(area)):
        bpy.ops.graph.view_all()
        facts["curves"] = sorted(curve.data_path for curve in bpy.context.visible_fcurves)
    yield 0.5
    yield from hand.picture("force_curves", in_docs=False)

    # the Add menu: the words that one types
    yield from hand.move(*hand.middle())
    yield from hand.key("A", shift=True)
    yield 0.5
    yield from hand.type("walking")
    yield 0.7
    yield from hand.picture("add_menu", in_docs=False)
    yield from hand.key("RET")
    yield 1.0
    facts["added"] = sorted(obj.name for obj in scene().objects if obj.type == "ARMATURE" and obj != armature)

    yield from search(hand, "Clear Bake")
    yield 0.5
    facts["cleared"] = materials(terrain), layers(armature)

    # the preferences: a manual and a bug report
    yield from open_preferences(hand, area)
    yield from hand.picture("preferences", in_docs=False)
    with addresses_noted(hand.pictures) as opened:
        for operator, offset in (("open_manual", 0.3), ("report_bug", 0.8)):
            bpy.context.window_manager.clipboard = ""
            yield from hand.press_button(f"softground.{operator}", offset, window_of(hand.area("PREFERENCES")))
            yield 1.0
        facts["manual"] = opened()
    facts["bug report"] = bpy.context.window_manager.clipboard


def open_preferences(hand: Hand, area: bpy.types.Area) -> Steps:
    """Show the add-on's preferences all over the window."""
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "SoftGround"
    area.type = "PREFERENCES"
    with bpy.context.temp_override(window=hand.window, area=area):
        bpy.ops.preferences.addon_expand(module=ADD_ON)
        bpy.ops.screen.screen_full_area()
    yield 1.0


@contextmanager
def addresses_noted(folder: Path) -> Iterator[Callable[[], list[str]]]:
    """While a program that writes addresses down stands in for the web browser; gives what they were."""
    noted, program = folder / "addresses.txt", folder / "browser.sh"
    program.write_text(f"#!/bin/sh\necho \"$1\" >> '{noted}'\n")
    program.chmod(0o755)
    browser, os.environ["BROWSER"] = os.environ.get("BROWSER", ""), str(program)
    yield lambda: noted.read_text().splitlines() if noted.exists() else []
    os.environ["BROWSER"] = browser


def terrain_of_the_user() -> bpy.types.Object:
    """A field about the walk, with a material."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=120, y_subdivisions=240, size=1.0, location=(0.0, -1.5, 0.0))
    terrain = bpy.context.window_manager.windows[0].view_layer.objects.active
    terrain.name, terrain.scale = "Terrain", (4.0, 8.0, 1.0)
    material = bpy.data.materials.new("Meadow")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.05, 0.2, 0.02, 1.0)
    terrain.data.materials.append(material)
    return terrain


def select(obj: bpy.types.Object) -> None:
    for other in scene().objects:
        other.select_set(other == obj)
    bpy.context.window_manager.windows[0].view_layer.objects.active = obj


def displayed() -> bpy.types.Object:
    """What takes the prints: the terrain or its finer copy."""
    ground = module("ground.baked_ground")
    return ground.display_mesh_of(scene().softground.ground)


def materials(obj: bpy.types.Object) -> list[str]:
    return [slot.material.name for slot in obj.material_slots]


def pictures() -> dict[str, bool]:
    """Which of the presets that come with the add-on have a picture in the menu."""
    menu, icons = module("panels.preset_menu"), module("panels.preset_icons")
    return {preset.name: icons.of(path) > 0 for path, preset in menu.listed(menu.presets.FOLDER)[0]}


def window_of(area: bpy.types.Area) -> bpy.types.Region:
    return next(region for region in area.regions if region.type == "WINDOW")


class menu_timed:  # noqa: N801
    """What each drawing of a menu takes of the processor [s]."""

    def __init__(self, name: str) -> None:
        self.menu = getattr(bpy.types, name)

    def __enter__(self) -> list[float]:
        seconds: list[float] = []
        self.draw = draw = self.menu.draw

        def timed(menu, context):
            started = time.thread_time()
            draw(menu, context)
            seconds.append(time.thread_time() - started)

        self.menu.draw = timed
        return seconds

    def __exit__(self, *_):
        self.menu.draw = self.draw
