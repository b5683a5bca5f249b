"""Handlers of Blender's events. Each returns at once unless something is armed, as `state` tells: what it needs then is
not even loaded before."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..core.errors import InputError
from . import session, settings, translation
from .animation_layer import constraint_layer
from .baking import bake_report
from .carried import marks_object
from .compat import remove_scene
from .debris import debris_object
from .ground import baked_ground
from .live import live
from .operators import give_way, modal_job
from .panels.outdated import compare_bake
from .plants import trampling_table
from .reading import analysis
from .sampling.sampling_scene import IS_TEMPORARY
from .state import state
from .viewport import overlay
from .weather import ground_weather, weather_keys

EDITED = ("ACTION", "ARMATURE", "KEY")
"""Kinds of data whose edits change what a character does; edited meshes may be what it steps on, or what prints."""

KEYED = ("ACTION", "OBJECT")
"""Kinds of data whose edits may change the keys of weather."""

SETTLED = 0.3
"""Time without edits after which what takes a while is worked out anew [s]."""


@persistent
def follow_frame(scene: bpy.types.Scene, depsgraph: Any = None) -> None:
    """Live mode shows the ground of the frame."""
    if state.live is not None:
        live.follow(scene, depsgraph)


@persistent
def notice_edits(scene: Any, depsgraph: Any = None) -> None:
    """An edited animation or mesh makes what was read from it worthless, and may leave a bake outdated."""
    if state.live is not None:
        live.watch()
    if depsgraph is not None and depsgraph.id_type_updated("IMAGE"):
        state.tread_maps.clear()
    if scene.softground.ground is not None:
        if not bpy.app.background:
            _later(compare_bake)
        _follow_deletion(scene.softground)
        if depsgraph is not None and any(depsgraph.id_type_updated(kind) for kind in KEYED):
            _follow_weather_keys(scene.softground)
            for copy in [update.id.original for update in depsgraph.updates if update.is_updated_geometry]:
                if isinstance(copy, bpy.types.Object):
                    weather_keys.follow(copy)
    if not state.analyses or depsgraph is None:
        return
    if any(depsgraph.id_type_updated(kind) for kind in EDITED):
        analysis.forget()
        if session.current().show_overlay:
            _later(overlay.read_again)
    elif bpy.app.background:  # where a timer that waits would keep the bpy module from ending
        return
    elif depsgraph.id_type_updated("MESH") and state.live is None:  # which writes a mesh at each frame
        _later(compare_prediction)


def _follow_deletion(options: Any) -> None:
    if options.printed:
        bake_report.forget_deleted(options)
    for ground in settings.listed_grounds(options) if state.live is None else ():
        is_deleted = baked_ground.is_deleted(ground)
        for belongs in (debris_object.BELONGS, marks_object.BELONGS):
            belongs.follow(ground, is_deleted=is_deleted)


def _follow_weather_keys(options: Any) -> None:
    for ground in settings.listed_grounds(options):
        ground_weather.follow(ground)


def compare_prediction() -> float | None:
    """Drop the predictions of what has changed; for a timer, as it may take a while."""
    if session.current().is_baking:
        return SETTLED
    analysis.look_again()
    session.redraw()
    return None


def _later(job: Callable[[], float | None]) -> None:
    """Do something once the edits have settled."""
    if bpy.app.timers.is_registered(job):
        bpy.app.timers.unregister(job)
    bpy.app.timers.register(job, first_interval=SETTLED)


@persistent
def begin_render(scene: Any = None, *_: Any) -> None:
    """Live mode stands still during renders, and weather has all keys."""
    if state.live is not None:
        live.rendering(True)
    if scene is not None:
        _follow_weather_keys(scene.softground)


@persistent
def end_render(*_: Any) -> None:
    """Live mode may go on."""
    if state.live is not None:
        live.rendering(False)


@persistent
def before_undo(*_: Any) -> None:
    """A bake cannot go on in a scene that is replaced."""
    modal_job.stop()


@persistent
def after_undo(*_: Any) -> None:
    """Live mode shows its ground on what the undo brought back."""
    _remove_left_over_scenes()
    state.tread_maps.clear()
    if state.analyses:
        analysis.look_again()
    if state.live is not None:
        live.after_undo()
    options = settings.options_of(bpy.context)
    constraint_layer.mend_after_undo(character.armature for character in options.characters)
    _follow_deletion(options)
    _follow_weather_keys(options)


@persistent
def before_load(*_: Any) -> None:
    """End with the file whatever goes on."""
    modal_job.stop()
    if state.live is not None or state.live_ended:
        try:
            live.discard()
        except InputError:  # with one in Edit Mode all keep their prints, for Clear Bake
            live.forget()
    state.analyses.clear()
    state.depths.clear()
    state.tread_maps.clear()
    state.results.clear()


@persistent
def after_load(*_: Any) -> None:
    """An autosave from within a bake may hold its working scene; opening a file ends all subscriptions."""
    _remove_left_over_scenes()
    translation.watch()
    _renew_tables()
    if not bpy.app.background and (
        session.current().stale or any(scene.softground.ground for scene in bpy.data.scenes)
    ):
        _later(compare_bake)


def _renew_tables() -> None:
    """Plants that play a table of an earlier version get one of this; those of a damaged record play on as they did."""
    for scene in bpy.data.scenes:
        for ground in settings.listed_grounds(scene.softground):
            if trampling_table.of(ground) and not (ground.library or trampling_table.is_current(ground)):
                scene.view_layers[0].update()
                with suppress(InputError):
                    give_way.renew_table(ground)


def _remove_left_over_scenes() -> None:
    """Scenes in which rigs are read may come back with an undo step or an autosave from within a bake."""
    for scene in [scene for scene in bpy.data.scenes if scene.get(IS_TEMPORARY)]:
        remove_scene(scene)


_HANDLERS = (
    ("frame_change_post", follow_frame),
    ("depsgraph_update_post", notice_edits),
    ("render_init", begin_render),
    ("render_complete", end_render),
    ("render_cancel", end_render),
    ("undo_pre", before_undo),
    ("redo_pre", before_undo),
    ("undo_post", after_undo),
    ("redo_post", after_undo),
    ("load_pre", before_load),
    ("load_post", after_load),
)


def register() -> None:
    """Add the handlers."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """End what goes on and take the handlers away."""
    before_load()
    for name, handler in reversed(_HANDLERS):
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    for job in (compare_bake, compare_prediction):
        if bpy.app.timers.is_registered(job):
            bpy.app.timers.unregister(job)
