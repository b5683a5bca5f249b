"""Reading `scene.softground` as the types of the core, and who and what in the file it means."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

from ..core.composers import relief_plan
from ..core.errors import InputError
from ..core.ground.material import MATERIAL_RANGES, GroundMaterial
from ..core.response import foot_holds, response
from ..core.response.performance import Performance
from ..core.response.tilt import TiltGains
from ..core.rig.mapping import SoleSource
from ..core.rig.recording import SceneUnits, Timeline
from ..core.settings import DOWN, BakeSettings, CharacterSettings, GroundSettings, ObjectName, ResponseOptions
from ..core.weather import felt_weather, weather
from . import further_grounds, ground_slots, tread_images
from .camera_views import camera_view
from .state import state

MATERIAL_FIELDS = tuple(MATERIAL_RANGES)

ADD_ON = __package__.rpartition(".")[0].removesuffix(".softground_addon")
"""The name by which Blender knows the add-on, which as an extension has `softground_addon` within it."""

Objects = Iterable[bpy.types.Object]
"""Objects among which some are sought, more than once: those of a scene."""

STANDARD_GRAVITY = 9.81
"""For scenes whose gravity is switched off [m/s²]."""


def scene_with(uid: int) -> bpy.types.Scene | None:
    """The scene of a session uid, also after an undo; None if it was deleted."""
    return next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)


def scene_named(name: ObjectName) -> bpy.types.Scene:
    """The scene of a name, whatever it is called by now; InputError if it was deleted."""
    scene = scene_with(name.uid)
    if scene is None:
        raise InputError(f"Scene '{name.name}' was deleted: start again in another one.")
    return scene


def options_of(context: bpy.types.Context) -> Any:
    """The settings of the context's scene."""
    return context.scene.softground


def exists(obj: bpy.types.Object | None) -> bool:
    """True if an object of the settings is there: those deleted in the viewport live on in the settings only."""
    if obj is None:
        return False
    users, linked = state.existing.get(obj.session_uid, (-1, False))
    if users != obj.users:
        linked = bool(obj.users_collection)
        state.existing[obj.session_uid] = obj.users, linked
    return linked


def hard_grounds_of(options: Any) -> list[bpy.types.Object]:
    """The hard objects of the settings that are there, each once."""
    listed, soft = dict.fromkeys(item.object for item in options.hard_grounds), grounds_of(options)
    return [obj for obj in listed if exists(obj) and obj not in soft]


def listed_grounds(options: Any) -> list[bpy.types.Object]:
    """The soft grounds of the settings, each once, deleted or not."""
    return [*filter(None, dict.fromkeys([options.ground, *(item.object for item in options.grounds)]))]


def grounds_of(options: Any) -> list[bpy.types.Object]:
    """The soft grounds of the settings that are there, each once; none without the first."""
    return list(filter(exists, listed_grounds(options))) if exists(options.ground) else []


def _further_grounds(options: Any, units: SceneUnits) -> tuple[GroundSettings, ...]:
    """The soft grounds beside the first; what no preset was chosen for is made of what the first is made of."""
    items = {item.object: item for item in reversed(options.grounds)}
    return tuple(
        GroundSettings(ground=name_of(obj), **_set_for(options, units, obj, items[obj]))
        for obj in grounds_of(options)[1:]
    )


def _set_for(options: Any, units: SceneUnits, ground: bpy.types.Object | None, group: Any) -> dict[str, Any]:
    """Values of a ground, which a group of settings has for it, as `GroundSettings` and `BakeSettings` call them."""
    material = group.material if group.material.is_property_set("preset") else options.material
    painted = group.painted
    return {
        "preset": material.preset,
        "surface": material.surface,
        "material": material_of(material),
        "painted": (painted.stiffness, painted.layer_depth, painted.rim),
        "weather": _calm(options, material.surface, units) if options.steps_feel_weather else None,
        "regions": ground_slots.regions_of(ground, typed(options.length_scale)) if ground else (),
        "under": group.under,
    }


def _wet_grounds(options: Any) -> tuple[str, ...]:
    """Liquid on each of the hard objects, "" for a dry one; empty if all are dry."""
    liquids = {item.object: item.wet.lower() for item in reversed(options.hard_grounds) if item.wet != "NONE"}
    wet = tuple(liquids.get(obj, "") for obj in hard_grounds_of(options))
    return wet if any(wet) else ()


def forget_deleted_ground(options: Any) -> None:
    """Take grounds that were deleted out of the settings; the next in the list becomes the first where that was."""
    if not exists(options.ground):
        options.ground = None
        if following := next((item for item in options.grounds if exists(item.object)), None):
            further_grounds.choose(options, following)
    for number in reversed(range(len(options.grounds))):
        if not exists(options.grounds[number].object):
            options.grounds.remove(number)


def typed(value: float) -> float:
    """The number that the user typed, from the single precision that Blender keeps it in: 0.01, not 0.00999999978."""
    return float(f"{value:.7g}")


def material_of(values: Any) -> GroundMaterial:
    """The settings of a ground's material as the core's type."""
    return GroundMaterial(**{field: typed(getattr(values, field)) for field in MATERIAL_FIELDS})


def timeline_of(scene: bpy.types.Scene) -> Timeline:
    """The frames of a scene, as they are now."""
    render = scene.render
    rate, stretch = render.fps / render.fps_base, render.frame_map_old / render.frame_map_new
    return Timeline(scene.frame_start, scene.frame_end, float(rate), float(stretch))


LONGEST_MAP = 900
"""Most that Blender takes for either number of a remapped time."""


def slow_down(scene: bpy.types.Scene, speed: float) -> None:
    """Play a scene at a part of the speed that the user has given it.

    Parameters
    ----------
    speed : float
        Of that which the scene has without this, however often it is asked for.
    """
    render, options = scene.render, scene.softground
    now = (render.frame_map_old, render.frame_map_new)
    if now != tuple(options.slowed_time):
        options.own_time = now
    old, new = options.own_time
    stretch = new / old / speed
    render.frame_map_old = 100 if stretch <= LONGEST_MAP / 100 else max(1, int(LONGEST_MAP / stretch))
    render.frame_map_new = max(1, round(render.frame_map_old * stretch))
    options.slowed_time = (render.frame_map_old, render.frame_map_new)


def gravity_direction_of(scene: bpy.types.Scene) -> tuple[float, float, float]:
    """Unit vector of a scene's gravity; down if it is switched off."""
    if not (scene.use_gravity and scene.gravity.length > 0):
        return DOWN
    x, y, z = scene.gravity.normalized()[:]
    return typed(x), typed(y), typed(z)


def units_of(scene: bpy.types.Scene) -> SceneUnits:
    """Frames, lengths and gravity of a scene, as they are now; the Earth's gravity where it is switched off."""
    timeline, pull = timeline_of(scene), float(scene.gravity.length) if scene.use_gravity else 0.0
    return SceneUnits(
        frame_rate=timeline.frame_rate,
        time_stretch=timeline.stretch,
        gravity_m_s2=typed(pull if pull > 0 else STANDARD_GRAVITY),
        unit_scale_m=typed(scene.unit_settings.scale_length),
    )


PERFORMANCE = ("knee_lift", "hold", "crouch", "arms")
"""What can be acted in deep ground, as the settings and the core call it."""

SIDE_TO_CODE = {"LEFT": "L", "RIGHT": "R", "NONE": ""}


def snapshot(scene: bpy.types.Scene, *, grounded: bool = False) -> BakeSettings:
    """All that a bake of the scene depends on, as it is now; a ground or characters that were deleted are left out.

    Parameters
    ----------
    grounded : bool
        As if Grounding were on.
    """
    options = scene.softground
    frames, has_ground = (options.frame_start, options.frame_end), exists(options.ground)
    units = units_of(scene)
    return BakeSettings(
        file=bpy.data.filepath,
        scene=name_of(scene),
        ground=name_of(options.ground) if has_ground else None,
        characters=tuple(character_of(entry) for entry in options.characters if is_set_up(entry)),
        pressure=options.pressure,
        cell_size_m=typed(options.cell_size),
        frames=frames,
        **vars(units),
        response=_response(options, grounded=grounded),
        sink_feet=options.sink_feet,
        carve=options.carve,
        output=options.output,
        detail=options.detail,
        shape_keys=options.shape_keys,
        dense_shape_keys=options.dense_shape_keys,
        tread_m=typed(options.tread),
        tread_pattern=options.tread_pattern,
        tread_image=tread_images.map_of(options.tread_image) if options.tread_pattern == relief_plan.IMAGE else "",
        relief=options.relief,
        relief_vertices=options.relief_vertices,
        relief_strength=typed(options.relief_strength),
        relief_look=options.material.surface if options.relief != "OFF" else "",
        margin_m=typed(options.ground_margin),
        keep_forces=options.keep_forces,
        longest_bake_s=60.0 * typed(options.longest_bake),
        debris=options.debris,
        camera=None if has_ground and options.relief != "CLOSE_UP" else camera_view(scene, frames),
        hard_grounds=tuple(name_of(obj) for obj in hard_grounds_of(options)),
        wet_grounds=_wet_grounds(options),
        marks=options.marks,
        carried=(typed(options.carried_amount), typed(options.carried_reach)),
        gravity_direction=gravity_direction_of(scene),
        **_set_for(options, units, options.ground if has_ground else None, options),
        grounds=_further_grounds(options, units),
    )


def _calm(options: Any, surface: str, units: SceneUnits) -> felt_weather.FeltWeather:
    """No weather, for steps that would feel it."""
    stretch = units.time_stretch
    span = weather.span_of(options.frame_start * stretch, options.frame_end * stretch)
    first, last = span.first / stretch, span.last / stretch
    return felt_weather.FeltWeather(surface=surface, first=first, last=last, frame_rate=units.frame_rate)


def is_prop(character: Any) -> bool:
    """True if an entry of the characters is of objects without a rig."""
    return not (character.armature or character.body) and any(sole.object for sole in character.soles)


def body_of(character: Any) -> bpy.types.Object | None:
    """The object that stands for a character: its armature, its body, or the prop itself."""
    return character.armature or character.body or next((sole.object for sole in character.soles if sole.object), None)


def is_set_up(character: Any) -> bool:
    """True if an entry of the characters still has what leaves prints: an armature, a body or an object."""
    owner = character.armature or character.body
    return exists(owner) if owner else is_prop(character)


def _is_renamed(character: Any) -> bool:
    """True of a character by whose rig's former name it is known: files of earlier versions may have two of one."""
    others = [each.name for each in character.id_data.softground.characters]
    return bool(character.name != character.armature.name and others.count(character.name) == 1)


def character_of(character: Any) -> CharacterSettings:
    """An entry of the characters, with its joints and soles as the user left them."""
    armature = character.armature
    soles = tuple(
        SoleSource(
            sole.name,
            SIDE_TO_CODE.get(sole.side, ""),
            sole.bone,
            sole.toe_bone,
            sole.object.name_full if sole.object else "",
            sole.kind == "LIMB",
            tuple(sole.parts.keys()),
        )
        for sole in character.soles
        if sole.object or (sole.bone and (armature or character.body))
    )
    return CharacterSettings(
        armature=name_of(armature) if armature else None,
        name=armature.name if armature else character.name,
        mass_kg=typed(character.mass),
        skin_mass_kg=typed(character.skin_mass),
        size_m=typed(character.size),
        force_model=character.force_model,
        joints={entry.name: (bone, entry.end.lower()) for entry in character.joints if (bone := entry.bone)},
        soles=soles,
        holds=tuple(
            foot_holds.FootHold(
                hold.foot, float(hold.frame), hold.mode, typed(hold.strength), float(hold.ease_in), float(hold.ease_out)
            )
            for hold in character.holds
        ),
        body=name_of(character.body) if character.body and not armature else None,
        dirty_soles=character.dirty_soles,
        dirty_with="" if character.dirty_with == "GROUND" else character.dirty_with.lower(),
        added_as=character.name if armature and _is_renamed(character) else "",
    )


def _response(options: Any, *, grounded: bool) -> ResponseOptions | None:
    """Responses that are asked of the characters, None if nothing."""
    grounded = grounded or sinks_feet(options) or (options.grounding.use and options.output != "PRINTS")
    tilted = options.tilt.use and (grounded or options.output != "PRINTS")
    if not (tilted or grounded):
        return None
    tilt, grounding = options.tilt, options.grounding
    gains = TiltGains(typed(tilt.frequency), typed(tilt.damping))
    acted = Performance(**{part: typed(getattr(grounding, part)) for part in PERFORMANCE})
    return ResponseOptions(
        response.TiltOptions(gains, typed(tilt.strength), typed(tilt.lateral)) if tilted else None,
        response.GroundingOptions(typed(grounding.align), typed(grounding.lock), acted) if grounded else None,
    )


def sinks_feet(options: Any) -> bool:
    """True if a bake lowers the feet of characters into their prints."""
    sinks = options.sink_feet and options.output == "BOTH"
    return sinks and any(character.armature for character in options.characters)


def name_of(obj: bpy.types.Object | bpy.types.Scene) -> ObjectName:
    """An object or a scene by its name, to be found again."""
    return ObjectName(obj.name, obj.session_uid)


def find(name: ObjectName) -> bpy.types.Object | None:
    """The object of a name, whatever it is called by now; None if it was deleted."""
    obj = bpy.data.objects.get(name.name)
    if obj is None or obj.session_uid != name.uid:
        obj = next((other for other in bpy.data.objects if other.session_uid == name.uid), None)
    return obj


def resolve(name: ObjectName) -> bpy.types.Object:
    """The object of a name, whatever it is called by now.

    Raises
    ------
    InputError
        If it was deleted.
    """
    obj = find(name)
    if obj is None:
        raise InputError(f"'{name.name}' was deleted: choose another object, or take it out of the settings.")
    return obj
