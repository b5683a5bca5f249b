"""Layers of keys on top of a rig's animation: hidden armatures carry the keys, constraints add them to the pose.

The armature of a layer has only the bones that the layer moves. Each of these bones of the rig gets a Copy Transforms
constraint at the end of its stack, which multiplies its pose by the layer's bone. A layer's armature is in no scene:
Blender evaluates it for the constraints, and exporters leave it out.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import Enum
from itertools import groupby
from typing import Any, cast

import bpy

from ...core.errors import InputError
from ..compat import remove_scene
from .layer_curves import LayerCurve, assign_action, new_action


class LayerKind(Enum):
    """Purpose of a layer, by the name of its objects and constraints; later ones lie on top of earlier ones."""

    ROOT_MOTION = "SoftGround Root Motion"
    CLEAN_FEET = "SoftGround Clean Feet"
    RESPONSE = "SoftGround Response"

    @property
    def strength(self) -> str:
        """Property of a character that scales it."""
        return f"{self.name.lower()}_strength"

    @property
    def order(self) -> int:
        """Place in the stack, from below."""
        return list(LayerKind).index(self)


_KIND = "softground_layer"
"""Property of a layer's armature: its kind."""


def has_layer(armature: bpy.types.Object, kind: LayerKind = LayerKind.RESPONSE) -> bool:
    """True if a layer of the kind lies on the armature."""
    return _layer_on(armature, kind) is not None


def is_own(constraint: bpy.types.Constraint) -> bool:
    """True if the constraint belongs to a layer."""
    return _kind_of(constraint) is not None


def is_response(constraint: bpy.types.Constraint) -> bool:
    """True if the constraint shows the ground's response, which bakes do not read."""
    return _kind_of(constraint) is LayerKind.RESPONSE


def check_layerable(armature: bpy.types.Object) -> None:
    """Raise InputError, naming the remedy, where an armature cannot be given constraints."""
    override = armature.override_library
    if armature.library is not None or (override is not None and override.is_system_override):
        raise InputError(
            f"'{armature.name}' is linked and cannot be given keys: make a library override of it (Object > Library "
            "Override > Make)."
        )


def put_layer(
    armature: bpy.types.Object, kind: LayerKind, curves: Sequence[LayerCurve], notes: Mapping[str, str]
) -> None:
    """Put a layer on an armature, in the place of one of its kind.

    Parameters
    ----------
    armature : bpy.types.Object
        Local or overridden.
    curves : sequence of LayerCurve
        Sorted by bone: the change of each bone in its own axes, or of root motion in the world's. Those that are not of
        a bone are of the armature as an object.
    notes : mapping of str to str
        Kept with the layer, for `notes_of`.

    Raises
    ------
    InputError
        If the armature cannot be given constraints.
    """
    check_layerable(armature)
    bones = [bone for bone, _ in groupby(curves, key=_bone_of)]
    helper = _new_helper(kind, list(filter(None, bones)))
    action = new_action(kind.value, helper, curves)
    assign_action(helper, action)
    for key, text in notes.items():
        helper[key] = text
    remove_layer(armature, kind)
    helper.name = cast("bpy.types.ID", helper.data).name = kind.value
    action.name = f"{armature.name} {kind.value.removeprefix('SoftGround ')}"
    # A property counts as a user, and is appended with the rig; overrides lose theirs.
    armature[kind.value] = helper
    helper.use_fake_user = armature.override_library is not None
    for bone in bones:
        _new_constraint(cast("bpy.types.Pose", armature.pose).bones[bone] if bone else armature, kind, helper, bone)
    armature.update_tag(refresh={"OBJECT", "DATA", "TIME"})


def remove_layer(armature: bpy.types.Object, kind: LayerKind = LayerKind.RESPONSE) -> bool:
    """Take the layer of a kind off an armature, which then moves as without it; False where there is none."""
    constraints = list(_constraints(armature, kind))
    if not constraints and kind.value not in armature.keys():  # noqa: SIM118  (an ID is no mapping)
        return False
    helpers = {armature.pop(kind.value, None)}
    for owner, constraint in constraints:
        helpers.add(constraint.target)
        _remove_constraint(owner, constraint)
    for helper in helpers:
        if isinstance(helper, bpy.types.Object) and not bpy.data.user_map(subset=[helper])[helper]:
            _remove(helper)
    armature.update_tag(refresh={"OBJECT", "DATA", "TIME"})
    return True


def take_off(armature: bpy.types.Object, names: Container[str]) -> None:
    """Take all layers off some of the `owners_of` an armature."""
    for kind in LayerKind:
        for owner, constraint in list(_constraints(armature, kind)):
            if ("" if owner == armature else owner.name) in names:
                _remove_constraint(owner, constraint)
        if not has_layer(armature, kind):
            remove_layer(armature, kind)


def notes_of(armature: bpy.types.Object, kind: LayerKind = LayerKind.RESPONSE) -> dict[str, str]:
    """Notes of a layer; empty if there is no layer."""
    constraint = _layer_on(armature, kind)
    helper: Any = constraint.target if constraint else None
    return {key: str(helper[key]) for key in helper.keys()} if helper else {}  # noqa: SIM118  (an ID is no mapping)


def set_strength(armature: bpy.types.Object, kind: LayerKind, strength: float) -> None:
    """Scale a layer, 0 to 2: beyond 1 a second constraint adds its keys once more."""
    owners: dict[int, list[tuple[Any, Any]]] = {}
    for owner, constraint in _constraints(armature, kind):
        owners.setdefault(owner.as_pointer(), []).append((owner, constraint))
    for (owner, constraint), *further in owners.values():
        constraint.influence = min(strength, 1.0)
        for _, second in further:
            _remove_constraint(owner, second)
        if strength > 1.0 and constraint.target:
            second = _new_constraint(owner, kind, constraint.target, constraint.subtarget)
            second.influence = strength - 1.0


def mend_after_undo(armatures: Iterable[bpy.types.Object | None]) -> None:
    """Point the layers of rigs at their armatures where an undo has left them pointing at the rig.

    Undo reads what has changed into new memory. Where that is the memory that a layer's armature had when it was
    removed, Blender takes the rig's pointers to the layer for pointers to the rig.
    """
    for armature in filter(None, armatures):
        turned = [
            (owner, constraint)
            for owner, constraint in _all_constraints(armature)
            if constraint.type == "COPY_TRANSFORMS" and constraint.target == armature
        ]
        for kind in LayerKind:
            # Of a bone's constraint that points at the bone itself, Blender may have cleared the name.
            lost: list[Any] = [
                (constraint, constraint.subtarget or ("" if owner == armature else owner.name))
                for owner, constraint in turned
                if _is_of(constraint.name, kind)
            ]
            bones = {bone for _, bone in lost} - {""}
            unused = [
                layer
                for layer in (bpy.data.objects if lost else ())
                if _is_of(layer.get(_KIND), kind) and not bpy.data.user_map(subset=[layer])[layer]
            ]
            for layer in unused:
                if bones == set(cast("bpy.types.Armature", layer.data).bones.keys()):
                    armature[kind.value] = layer
                    for constraint, bone in lost:
                        constraint.target, constraint.subtarget = layer, bone
                    break


@contextmanager
def without_layers(armature: bpy.types.Object, lowest: LayerKind = LayerKind.RESPONSE) -> Iterator[None]:
    """The armature without its layers from one kind on; the constraints are as they were afterwards."""
    kinds = [kind for kind in LayerKind if kind.order >= lowest.order]
    shown = [each for kind in kinds for _, each in _constraints(armature, kind) if not each.mute]
    for constraint in shown:
        constraint.mute = True
    try:
        yield
    finally:
        for constraint in shown:
            constraint.mute = False


def owners_of(armature: bpy.types.Object) -> dict[str, Any]:
    """Owners of layers: pose bones by name, and the armature itself by the empty name."""
    owners = (owner for kind in LayerKind for owner, _ in _constraints(armature, kind))
    return {"" if owner == armature else owner.name: owner for owner in owners}


def _bone_of(curve: LayerCurve) -> str:
    return curve.group if curve.path.startswith("pose.bones[") else ""


def _kind_of(constraint: Any) -> LayerKind | None:
    """The layer that a constraint belongs to: by its target, or where that was deleted, by its name.

    An override's constraints from its library are part of the animation.
    """
    if constraint.type != "COPY_TRANSFORMS" or constraint.is_override_data:
        return None
    name = constraint.name if constraint.target is None else constraint.target.get(_KIND)
    return next((kind for kind in LayerKind if _is_of(name, kind)), None)


def _is_of(name: str | None, kind: LayerKind) -> bool:
    """True if a constraint or a layer's armature of that name is of the kind."""
    return bool(name) and str(name).partition(".")[0] == kind.value


def _constraints(armature: bpy.types.Object, kind: LayerKind) -> Iterator[tuple[Any, Any]]:
    """The constraints of a layer, each with its bone or object."""
    return ((owner, constraint) for owner, constraint in _all_constraints(armature) if _kind_of(constraint) is kind)


def _all_constraints(armature: bpy.types.Object) -> Iterator[tuple[Any, Any]]:
    """All constraints of an armature, each with its bone or object."""
    for owner in (armature, *(armature.pose.bones if armature.pose else ())):
        yield from ((owner, constraint) for constraint in owner.constraints)


def _layer_on(armature: bpy.types.Object, kind: LayerKind) -> Any:
    return next((constraint for _, constraint in _constraints(armature, kind)), None)


def _new_constraint(owner: Any, kind: LayerKind, helper: bpy.types.Object, bone: str) -> Any:
    """A constraint that multiplies an owner's pose by a layer's bone, with those of higher layers moved above it."""
    active = owner.constraints.active
    constraint = owner.constraints.new("COPY_TRANSFORMS")
    constraint.name = kind.value
    constraint.target, constraint.subtarget = helper, bone
    constraint.target_space = "LOCAL" if bone else "WORLD"
    in_world = kind is LayerKind.ROOT_MOTION
    constraint.owner_space = "WORLD" if in_world else "POSE"
    constraint.mix_mode = "BEFORE_FULL" if in_world else "AFTER_FULL"
    above = [each.name for each in owner.constraints if (other := _kind_of(each)) and other.order > kind.order]
    for name in above:
        owner.constraints.move(owner.constraints.find(name), len(owner.constraints) - 1)
    owner.constraints.active = active
    return constraint


def _remove_constraint(owner: Any, constraint: Any) -> None:
    """Remove a constraint of a layer; the user's active one stays active."""
    active = owner.constraints.active
    owner.constraints.remove(constraint)
    owner.constraints.active = active


def _new_helper(kind: LayerKind, bones: Sequence[str]) -> bpy.types.Object:
    """A hidden armature in no scene, with such bones, whose rest pose is that of space."""
    data = bpy.data.armatures.new(kind.value)
    helper = bpy.data.objects.new(kind.value, data)
    helper[_KIND] = kind.value
    scene = bpy.data.scenes.new(kind.value)  # bones are made in Edit Mode, which wants a scene with nothing else
    try:
        scene.collection.objects.link(helper)
        layer = scene.view_layers[0]
        layer.objects.active = helper
        with bpy.context.temp_override(scene=scene, view_layer=layer, object=helper, active_object=helper):
            bpy.ops.object.mode_set(mode="EDIT")
            for bone in bones:
                data.edit_bones.new(bone).tail = (0.0, 1.0, 0.0)
            bpy.ops.object.mode_set(mode="OBJECT")
    finally:
        remove_scene(scene)
    helper.hide_viewport = helper.hide_render = True
    return helper


def _remove(helper: bpy.types.Object) -> None:
    animation, data = helper.animation_data, helper.data
    action = animation.action if animation else None
    bpy.data.batch_remove([helper, *(block for block in (data, action) if block is not None and block.users == 1)])
