"""The ground while a copy of it takes the prints: hidden, but for what is scattered on it."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, cast

import bpy

from ..animation_layer.layer_curves import animated_paths
from . import ground_mesh, ground_surface

WAS_HIDDEN = "softground_was_hidden"
"""Property of the ground while it is hidden: what of `_SHOWN` was set before."""

_SHOWN = ("hide_viewport", "hide_render", "show_instancer_for_viewport", "show_instancer_for_render")
_BY_DEFAULT = (False, False, True, True)


def hides(ground: bpy.types.Object) -> bool:
    """True if the ground is hidden in favour of a copy."""
    return WAS_HIDDEN in ground.keys()  # noqa: SIM118  (an ID is no mapping)


def may_hide(ground: bpy.types.Object) -> bool:
    """True if the ground stays hidden once it is, with nothing that shows it again at another frame."""
    return not any(path in _SHOWN for path, _ in animated_paths(ground))


def hide(ground: bpy.types.Object) -> None:
    """Hide the ground; where particles or instances are on it, its mesh only: what came onto a hidden one is shown."""
    is_hidden = hides(ground)
    before = _before(ground)
    scattered: dict[frozenset[str], bool] = {}  # by the modifiers that are shown, which mostly are the same in both
    for number, kind in enumerate(("viewport", "render")):
        if is_hidden and (before[number] or not getattr(ground, f"hide_{kind}")):
            continue
        shown = frozenset(modifier.name for modifier in ground.modifiers if getattr(modifier, f"show_{kind}"))
        if shown not in scattered:
            scattered[shown] = _is_scattered_on(ground, shown)
        if scattered[shown]:
            setattr(ground, f"show_instancer_for_{kind}", False)
        if is_hidden or not scattered[shown]:
            setattr(ground, f"hide_{kind}", not scattered[shown])
    ground[WAS_HIDDEN] = before


def _before(ground: bpy.types.Object) -> list[Any]:
    """Values of `_SHOWN` of a ground; of a hidden one, as they were before."""
    if not hides(ground):
        return [getattr(ground, name) for name in _SHOWN]
    before: list[Any] = getattr(ground[WAS_HIDDEN], "to_list", list)()  # whatever has been made of it
    return before if len(before) == len(_SHOWN) else list(_BY_DEFAULT)


def show_again(ground: bpy.types.Object) -> None:
    """Show a ground that is hidden in favour of a copy, or what was copied from it meanwhile, as it was before."""
    if not hides(ground):
        return
    for name, value in zip(_SHOWN, _before(ground), strict=True):
        setattr(ground, name, bool(value))
    del ground[WAS_HIDDEN]


def _is_scattered_on(ground: bpy.types.Object, shown: Collection[str]) -> bool:
    """True if the ground has particles, or instances while some of its modifiers are shown, by their names."""
    if ground.particle_systems:
        return True
    if not any(modifier.type == "NODES" and modifier.name in shown for modifier in ground.modifiers):
        return False
    with ground_surface.stand_in(ground, ground_mesh.mesh_of(ground)) as evaluated:
        copy = evaluated.original
        copy.hide_viewport = False
        for modifier in copy.modifiers:
            modifier.show_viewport = modifier.name in shown
        layer = copy.users_scene[0].view_layers[0]
        layer.update()
        depsgraph = cast("bpy.types.Depsgraph", layer.depsgraph)
        return any(
            instance.parent and instance.parent.original == copy
            for instance in depsgraph.object_instances
            if instance.is_instance
        )
