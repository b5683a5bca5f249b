"""*Show Prints*: the last steps in the viewport, close by and at a low angle, in a light that rakes over them."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, pi, radians
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Quaternion, Vector
from numpy.typing import NDArray

from ..baking import bake_report
from ..ground import baked_ground, baked_steps, ground_mesh
from ..operator_base import Act, OnBake
from ..placement import in_scene
from ..state import state

SHOWN = 4
"""Prints that the view frames."""
LOW, ASIDE = radians(25), radians(60)
"""How far the view looks down, and past the way of the last step."""
DISTANCE = 2.1
"""Distance of the view from the middle of the prints, over how far they reach from it, with a lens of 50 mm."""
RAISED = 0.1
"""How far the view looks over the prints, at whom they are of, over its distance."""
LONGEST = 20.0
"""How far prints are framed from their middle at most, in widths of a print: tracks of wheels go on and on."""
DEFAULT_LIGHT, LOW_SUN = "Default", "outdoor.sl"
"""Studio lights of Blender: the one it starts with, and one whose sun is low."""


def last_step(options: Any) -> int:
    """The frame from which on all prints of the bake on the scene's ground are there."""
    summary = ground_mesh.summary_of(baked_ground.display_mesh_of(options.ground))
    return ceil(summary.get(bake_report.LAST_FRAME) or options.frame_end)


def is_first_bake(scene: bpy.types.Scene) -> bool:
    """True if no bake of the scene was shown in this session, and none is on its ground."""
    ground = scene.softground.ground
    return scene.session_uid not in state.seen_prints and not (ground and baked_ground.is_baked(ground))


def show_first(scene: bpy.types.Scene, area: Any) -> None:
    """Show the prints of a first bake in an area, if its view is free."""
    state.seen_prints.add(scene.session_uid)
    if is_free(area):
        _show(_last_prints(scene.softground.ground, scene.frame_current), area, scene.unit_settings.scale_length)


def is_free(area: Any) -> bool:
    """True if an area is a viewport with a free perspective of the whole scene."""
    space = _viewport(area)
    return bool(space and space.region_3d.view_perspective == "PERSP" and not space.local_view)


def centre(area: Any, step: baked_steps.BakedStep) -> None:
    """Move the middle of the view in an area to a step; the view through a camera stays."""
    space = _viewport(area)
    if space and space.region_3d.view_perspective != "CAMERA":
        space.region_3d.view_location = _in_view(_middle(step))


def _in_view(point: NDArray[np.float64]) -> Vector:
    """A point of the bake [m] where the view shows it."""
    scene: Any = bpy.context.scene
    return Vector(in_scene(point, scene, baked_steps.frame_of(scene.softground.ground)).tolist())


def _viewport(area: Any) -> Any:
    """The space of an area if it is a viewport that may turn; None in background too."""
    if bpy.app.background or area is None or area.type != "VIEW_3D":
        return None
    space = area.spaces.active
    return None if space.region_quadviews or space.region_3d.lock_rotation else space


def _last_prints(ground: bpy.types.Object | None, frame: int) -> list[baked_steps.BakedStep]:
    """The last step that is in the ground at a frame, and those next to it."""
    visible = [step for step in baked_steps.of(ground) if step.footprint and step.there_from <= frame]
    if not visible:
        return []
    last = max(visible, key=lambda step: step.there_from)
    at = _middle(last)
    return sorted(visible, key=lambda step: float(np.linalg.norm(_middle(step) - at)))[:SHOWN]


def _middle(step: baked_steps.BakedStep) -> NDArray[np.float64]:
    return step.outline().mean(axis=0)


def _show(prints: Sequence[baked_steps.BakedStep], area: Any, unit_scale: float) -> None:
    """Frame prints in an area, if there are any, and light them; `unit_scale` is that of their scene [m]."""
    space = area.spaces.active
    if not prints:
        return
    points = np.concatenate([step.outline() for step in prints])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    width = np.ptp(prints[0].outline()[:, :2], axis=0).min()
    reach = min(float(np.linalg.norm(points - middle, axis=1).max()), LONGEST * float(width))
    look = (prints[0].footprint or prints[0].baked).heading + ASIDE
    metre = 1.0 / unit_scale
    view, distance = space.region_3d, DISTANCE * reach * metre * space.lens / 50.0
    at = _in_view(middle)
    view.view_perspective = "PERSP"
    turn(area, at + Vector((0.0, 0.0, RAISED * distance)), look, distance)
    light(space.shading, look)


def turn(area: Any, middle: Vector, look: float, distance: float) -> None:
    """Have the view in an area look at a place, beside its sidebar, from a distance and low; `look` is its heading."""
    space, view = area.spaces.active, area.spaces.active.region_3d
    view.view_rotation, view.view_distance = low_from(look), distance
    beside = Vector((_hidden(area) * distance * 36.0 / space.lens, 0.0, 0.0))
    view.view_location = middle + view.view_rotation @ beside


def low_from(look: float, low: float = LOW) -> Quaternion:
    """Rotation of a view or a camera with a heading that looks somewhat down."""
    return Euler((pi / 2 - low, 0.0, look - pi / 2)).to_quaternion()


def _hidden(area: Any) -> float:
    """Share of a viewport's width that its sidebar lies over."""
    width = {region.type: region.width for region in area.regions}
    overlaps = bpy.context.preferences.system.use_region_overlap
    return float(width["UI"] / width["WINDOW"]) if overlaps and width["UI"] > 1 else 0.0


def light(shading: Any, look: float) -> None:
    """Let a low sun rake over what Solid shading shows, from where a view looks to, if its light is Blender's own."""
    if shading.type != "SOLID":
        return
    shading.show_cavity, shading.cavity_type = True, "BOTH"
    shading.show_object_outline = False  # black around each piece of debris
    lights = bpy.context.preferences.studio_lights
    if shading.light == "STUDIO" and shading.studio_light in (DEFAULT_LIGHT, LOW_SUN) and LOW_SUN in lights:
        shading.studio_light, shading.use_world_space_lighting = LOW_SUN, True
        shading.studiolight_rotate_z = (look + pi) % (2 * pi) - pi


class SOFTGROUND_OT_show_prints(OnBake, Act):
    """Go to the frame where the last foot leaves its print, and look at the last steps from close by, in a low light"""

    bl_idname = "softground.show_prints"
    bl_label = "Show Prints"
    bl_options = {"REGISTER"}

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        scene.frame_set(last_step(scene.softground))
        if _viewport(context.area):
            prints = _last_prints(scene.softground.ground, scene.frame_current)
            _show(prints, context.area, scene.unit_settings.scale_length)


CLASSES = (SOFTGROUND_OT_show_prints,)
