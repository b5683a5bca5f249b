"""Filling `scene.softground`: from a rig, from a preset, from `PATH=VALUE`; and reading it as the core's types."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import bpy

from ..core.composers.relief_plan import IMAGE
from ..core.errors import InputError
from ..core.ground import presets
from ..core.ground.material import MATERIAL_RANGES, GroundMaterial
from ..core.ground.presets import Preset
from ..core.motion.sole_motion import shortest_length
from ..core.response.foot_holds import FootHold
from ..core.response.performance import Performance
from ..core.response.response import GroundingOptions, TiltOptions
from ..core.response.tilt import TiltGains
from ..core.settings import BakeSettings, CharacterSettings, ObjectName, ResponseOptions, SceneUnits, SoleSource
from ..core.weather.felt_weather import FeltWeather
from ..core.weather.weather import span_of
from . import tread_images
from .camera_views import camera_view
from .state import state

MATERIAL_FIELDS = tuple(MATERIAL_RANGES)

STANDARD_GRAVITY = 9.81
"""For scenes whose gravity is switched off [m/s²]."""

USER_FOLDER = "presets/softground"
"""Where the user's presets are, below the folder of Blender's user scripts."""


ADD_ON = __package__.rpartition(".")[0].removesuffix(".softground_addon")
"""The name by which Blender knows the add-on, which as an extension has `softground_addon` within it."""


def scene_of(context: bpy.types.Context) -> bpy.types.Scene:
    """The context's scene, which an operator or a panel always has."""
    return cast("bpy.types.Scene", context.scene)


def options_of(context: bpy.types.Context) -> Any:
    """The settings of the context's scene."""
    return cast("Any", context.scene).softground


def exists(obj: bpy.types.Object | None) -> bool:
    """Return whether an object of the settings is there: those deleted in the viewport live on in the settings only."""
    if obj is None:
        return False
    users, linked = state.existing.get(obj.session_uid, (-1, False))
    if users != obj.users:
        linked = bool(obj.users_collection)
        state.existing[obj.session_uid] = obj.users, linked
    return linked


def hard_grounds_of(options: Any) -> list[bpy.types.Object]:
    """The hard objects of the settings that are there, each once."""
    listed = dict.fromkeys(item.object for item in options.hard_grounds)
    return [obj for obj in listed if exists(obj) and obj != options.ground]


def forget_deleted_ground(scene: bpy.types.Scene) -> None:
    """Take a ground that was deleted out of the settings."""
    if scene.softground.ground is not None and not exists(scene.softground.ground):
        scene.softground.ground = None


def typed(value: float) -> float:
    """The number that the user typed, from the single precision that Blender keeps it in: 0.01, not 0.00999999978."""
    return float(f"{value:.7g}")


def material_of(options: Any) -> GroundMaterial:
    """The scene's ground material as the core's type."""
    values = options.material
    return GroundMaterial(**{field: typed(getattr(values, field)) for field in MATERIAL_FIELDS})


def frame_rate_of(scene: bpy.types.Scene) -> float:
    """Scene frames per second [Hz]."""
    return float(scene.render.fps / scene.render.fps_base)


def time_stretch_of(scene: bpy.types.Scene) -> float:
    """Frames of the animation per frame of the scene: 1 unless its time is remapped.

    Keys, strips, nodes and caches count the animation's frames; the timeline, and with it a bake, the scene's.
    """
    return float(scene.render.frame_map_old / scene.render.frame_map_new)


LONGEST_MAP = 900
"""Most that Blender takes for either number of a remapped time."""


def slow_down(scene: bpy.types.Scene, speed: float) -> None:
    """Play a scene at a part of the speed that the user has given it.

    Parameters
    ----------
    scene : bpy.types.Scene
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


def gravity_of(scene: bpy.types.Scene) -> float:
    """Magnitude of gravity [m/s²]; the Earth's where the scene's is switched off."""
    return float(scene.gravity.length) if scene.use_gravity and scene.gravity.length > 0 else STANDARD_GRAVITY


def units_of(scene: bpy.types.Scene) -> SceneUnits:
    """Frames and lengths of a scene, as they are now."""
    return SceneUnits(
        frame_rate=frame_rate_of(scene),
        time_stretch=time_stretch_of(scene),
        gravity_m_s2=typed(gravity_of(scene)),
        unit_scale_m=typed(scene.unit_settings.scale_length),
    )


PERFORMANCE = ("knee_lift", "hold", "crouch", "arms")
"""What can be acted in deep ground, as the settings and the core call it."""

SIDE_TO_CODE = {"LEFT": "L", "RIGHT": "R", "NONE": ""}


def snapshot(scene: bpy.types.Scene, *, grounded: bool = False) -> BakeSettings:
    """All that a bake of the scene depends on, as it is now; a ground or characters that were deleted are left out.

    Parameters
    ----------
    scene : bpy.types.Scene
    grounded : bool
        As if Grounding were on.
    """
    options = scene.softground
    frames, has_ground = (options.frame_start, options.frame_end), exists(options.ground)
    return BakeSettings(
        file=bpy.data.filepath,
        scene=scene.name,
        ground=name_of(options.ground) if has_ground else None,
        characters=tuple(character_of(entry) for entry in options.characters if is_set_up(entry)),
        preset=options.material.preset,
        surface=options.material.surface,
        material=material_of(options),
        pressure=options.pressure,
        painted=(options.painted.stiffness, options.painted.layer_depth, options.painted.rim),
        cell_size_m=typed(options.cell_size),
        frames=frames,
        **vars(units_of(scene)),
        response=_response(options, grounded=grounded),
        sink_feet=options.sink_feet,
        output=options.output,
        detail=options.detail,
        shape_keys=options.shape_keys,
        dense_shape_keys=options.dense_shape_keys,
        tread_m=typed(options.tread),
        tread_pattern=options.tread_pattern,
        tread_image=tread_images.map_of(options.tread_image) if options.tread_pattern == IMAGE else "",
        relief=options.relief,
        relief_vertices=options.relief_vertices,
        relief_strength=typed(options.relief_strength),
        relief_look=options.material.surface if options.relief != "OFF" else "",
        margin_m=typed(options.ground_margin),
        keep_forces=options.keep_forces,
        longest_bake_s=60.0 * typed(options.longest_bake),
        debris=options.debris,
        weather=_calm(options, units_of(scene)) if options.steps_feel_weather else None,
        camera=None if has_ground else camera_view(scene, frames),
        hard_grounds=tuple(name_of(obj) for obj in hard_grounds_of(options)),
    )


def _calm(options: Any, units: SceneUnits) -> FeltWeather:
    """No weather, for steps that would feel it."""
    stretch = units.time_stretch
    span = span_of(options.frame_start * stretch, options.frame_end * stretch)
    first, last = span.first / stretch, span.last / stretch
    return FeltWeather(surface=options.material.surface, first=first, last=last, frame_rate=units.frame_rate)


def is_prop(character: Any) -> bool:
    """Return whether an entry of the characters is of objects without a rig."""
    return not (character.armature or character.body) and any(sole.object for sole in character.soles)


def is_set_up(character: Any) -> bool:
    """Return whether an entry of the characters still has what leaves prints: an armature, a body or an object."""
    owner = character.armature or character.body
    return exists(owner) if owner else is_prop(character)


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
            FootHold(
                hold.foot, float(hold.frame), hold.mode, typed(hold.strength), float(hold.ease_in), float(hold.ease_out)
            )
            for hold in character.holds
        ),
        body=name_of(character.body) if character.body and not armature else None,
    )


def _response(options: Any, *, grounded: bool) -> ResponseOptions | None:
    """Responses that are asked of the characters, None if nothing."""
    sunk = (
        options.sink_feet and options.output == "BOTH" and any(character.armature for character in options.characters)
    )
    grounded = grounded or sunk or (options.grounding.use and options.output != "PRINTS")
    tilted = options.tilt.use and (grounded or options.output != "PRINTS")
    if not (tilted or grounded):
        return None
    tilt, grounding = options.tilt, options.grounding
    gains = TiltGains(typed(tilt.frequency), typed(tilt.damping))
    acted = Performance(**{part: typed(getattr(grounding, part)) for part in PERFORMANCE})
    return ResponseOptions(
        TiltOptions(gains, typed(tilt.strength), typed(tilt.lateral)) if tilted else None,
        GroundingOptions(typed(grounding.align), typed(grounding.lock), acted) if grounded else None,
    )


def name_of(obj: bpy.types.Object) -> ObjectName:
    """An object by its name, to be found again."""
    return ObjectName(obj.name, obj.session_uid)


def find(name: ObjectName) -> bpy.types.Object | None:
    """The object of a name, whatever it is called by now; None if it was deleted."""
    obj = bpy.data.objects.get(name.name)
    if obj is None or obj.session_uid != name.uid:
        obj = next((other for other in bpy.data.objects if other.session_uid == name.uid), None)
    return obj


def found(name: ObjectName) -> bpy.types.Object:
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


def user_folder() -> Path:
    """Folder of the user's presets, which may not be there yet."""
    return Path(bpy.utils.user_resource("SCRIPTS", path=USER_FOLDER))


def apply_preset(options: Any, preset: Preset) -> None:
    """Set the scene's ground to a preset's; what the preset does not say, and a cell size of the user's own, stay."""
    for group, field, value in _of_preset(options, preset):
        setattr(group, field, value)
    if preset.cells_along_sole is not None and options.cells_along_sole > 0:
        options.cells_along_sole = preset.cells_along_sole
        fit_cells(options)


def as_preset(options: Any, name: str, source: str = "") -> Preset:
    """The scene's ground as a preset of that name."""
    material = material_of(options)
    scale = typed(options.length_scale)
    return Preset(
        name,
        source,
        options.material.surface,
        replace(material, **{field: float(f"{getattr(material, field) / scale:.5g}") for field in _LENGTHS}),
        options.pressure,
        typed(options.tread),
        typed(options.cells_along_sole) or None,
        options.debris,
    )


def holds(options: Any, preset: Preset) -> bool:
    """Return whether the scene's ground is as a preset says, or will be with its first character."""
    for group, field, value in _of_preset(options, preset):
        if not options.characters and not group.is_property_set(field):
            continue
        if not _is(group, field, value):
            return False
    return True


def _is(group: Any, field: str, value: Any) -> bool:
    """True if a setting has a value, but for rounding."""
    now = getattr(group, field)
    return bool(abs(now - value) <= 1e-6 * abs(value) if isinstance(value, float) else now == value)


def take_defaults(options: Any) -> None:
    """Set what the user has not set of the ground to the preset of the preferences, and the cells to fit the soles.

    For the first character of a scene. What is as by default is set too: a file keeps only what was set.
    """
    preset = default_preset()
    for group, field, value in _of_preset(options, preset):
        if not group.is_property_set(field):
            setattr(group, field, value)
    if not options.is_property_set("cell_size") and not options.is_property_set("cells_along_sole"):
        options.cells_along_sole = preset.cells_along_sole or options.cells_along_sole


def default_preset() -> Preset:
    """Preset that scenes start with: the one of the user's preferences, or the add-on's own where that is gone."""
    with suppress(InputError):
        return presets.find(_preferred(), (presets.FOLDER, user_folder()))
    return presets.find(presets.DEFAULT)


def _preferred() -> str:
    """The preset that the user's preferences name; in background the add-on's own, for farms to bake alike."""
    add_on = bpy.context.preferences.addons.get(ADD_ON)
    if bpy.app.background or add_on is None or add_on.preferences is None:
        return presets.DEFAULT
    return str(add_on.preferences.default_preset)


def preset_of(options: Any) -> str:
    """The name of the preset that a scene was set to last, or will be with its first character."""
    if options.characters or options.material.is_property_set("preset"):
        return str(options.material.preset)
    return _preferred()


def untouched(options: Any) -> list[tuple[Any, str]]:
    """The settings that `take_defaults` would set, as groups and names."""
    fields = [(group, field) for group, field, _ in _of_preset(options, default_preset())]
    fields += [(options, "cell_size"), (options, "cells_along_sole")]
    return [(group, field) for group, field in fields if not group.is_property_set(field)]


def _of_preset(options: Any, preset: Preset) -> list[tuple[Any, str, Any]]:
    """Contents of a preset: groups of settings, names in them, values."""
    material = options.material
    scale = {field: typed(options.length_scale) for field in _LENGTHS}
    said = [(material, field, getattr(preset.material, field) * scale.get(field, 1.0)) for field in MATERIAL_FIELDS]
    said += [(material, "preset", preset.name), (material, "surface", preset.surface)]
    said += [(options, "pressure", preset.pressure), (options, "tread", preset.tread)]
    said += [(options, "debris", preset.debris)]
    return [entry for entry in said if entry[2] is not None]


SMALL_SOLE = 0.1
"""Lengths of presets are those of soles of a person; of soles smaller than this they are as much smaller [m]."""

_LENGTHS = ("rim_reach", "blur_sigma")
"""Fields of a material that go with the soles."""


def fit_cells(options: Any) -> None:
    """Set the cell size, and lengths for small soles, to what the preset says of them, unless the user has set them."""
    count, lengths = (
        options.cells_along_sole,
        [character.sole_length for character in options.characters if character.sole_length > 0],
    )
    if not lengths:
        return
    shortest = shortest_length(lengths)
    if count > 0:
        options.cell_size = float(f"{shortest / count:.2g}")
        options.cells_along_sole = count  # which a cell size of the user's own switches off
    with suppress(InputError):
        preset = presets.find(preset_of(options), (presets.FOLDER, user_folder()))
        as_said = [
            character for character in _of_preset(options, preset) if character[1] in _LENGTHS and _is(*character)
        ]
        before, options.length_scale = options.length_scale, min(1.0, shortest / SMALL_SOLE)
        for group, field, value in as_said if options.length_scale != before else ():
            setattr(group, field, value / before * options.length_scale)
