"""Findings about animation that does not act in a scene, or acts otherwise in a bake; each with its remedy."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ...core.findings import Finding, listed
from ...core.settings import BakeSettings
from .. import settings
from ..animation_layer.constraint_layer import is_own
from ..animation_layer.layer_curves import animated_paths
from ..characters.selection import all_leaders
from ..compat import HAS_SLOTS, slot_of
from ..ground.still_ground import changes_shape
from ..placement import UP, world_matrix
from ..plants import give_way_nodes, trampling_table
from ..reading import staleness
from ..reading.shots import Shot
from ..rigs.frame_ranges import ancestors, playing_tracks
from ..rigs.worn_rigs import rigs_below
from ..sampling.body_sampling import deforms, meshes_of
from ..sampling.instances import crowd_finding, instancers
from ..sampling.sampling_scene import object_named
from ..settings import find

UPRIGHT = 0.9998
"""Gravity whose downward part is less than this points elsewhere (1°)."""

ROUNDING = 0.25
"""Rounding of positions from which steps are off, in cells."""

_NO_MOTION = ("hide", "show_", "color", "display", "layers", "is_visible")
"""Words in the paths of drivers that move nothing."""


def scene_findings(wanted: BakeSettings, shot: Shot) -> list[Finding]:
    """Findings about a scene whose shot was just read."""
    scene = settings.scene_named(wanted.scene)
    movers = [mover for character in wanted.characters for mover in staleness.movers_of(character)]
    followed = list(dict.fromkeys(node for mover in movers for node in (mover, *all_leaders(mover))))
    first, last = (frame * wanted.time_stretch for frame in wanted.frames)
    return [
        *shot.findings,
        *_distance(dict.fromkeys(movers), wanted),
        *_idle_actions(followed, first, last),
        *_idle_drivers(followed),
        *shape_findings(
            object_named(sole.object) for character in wanted.characters for sole in character.soles if sole.object
        ),
        *_followed_shapes(wanted),
        *_crowds(scene, staleness.bodies_of(scene.objects, wanted)),
        *_unseen_ground(scene, find(wanted.ground) if wanted.ground else None),
        *_rigs_below(scene.objects, wanted),
        *_edited_plants(),
        *_gravity(scene.gravity if scene.use_gravity else Vector(), wanted),
    ]


def _edited_plants() -> Iterator[Finding]:
    """Plants that give way by nodes of an earlier version, which stay because the user edited them."""
    for obj in bpy.data.objects:
        group = getattr(trampling_table.modifier_of(obj), "node_group", None)
        if group and group.get(give_way_nodes.MARK) != give_way_nodes.VERSION and give_way_nodes.is_edited(group):
            yield Finding(
                "give_way_edited",
                "note",
                f"'{obj.name}' gives way by '{group.name}' of an earlier version, which you edited and which stays as "
                "it is. It may not fit this bake.",
                "To have the nodes of this version, remove the modifier and choose Give Way again.",
            )


def _gravity(gravity: Vector, wanted: BakeSettings) -> Iterator[Finding]:
    """Gravity that does not point down."""
    direction = np.array(wanted.gravity_direction)
    up = np.array(wanted.frame.matrix)[2, :3] if wanted.frame and not wanted.frame.moves else np.array(UP)
    if -direction @ up < UPRIGHT and not (wanted.frame and wanted.frame.moves):
        yield Finding(
            "gravity_direction",
            "note",
            f"Gravity of scene '{wanted.scene.name}' points along ({', '.join(f'{part:g}' for part in gravity[:])}), "
            "but no character stands upright in it: bodies weigh straight down in the bake, by "
            f"{wanted.gravity_m_s2:.2f} m/s².",
            "Set Gravity in the Scene properties to point where the feet of the characters do.",
        )


def _distance(movers: Iterable[bpy.types.Object], wanted: BakeSettings) -> Iterator[Finding]:
    """Shots so far from the world's origin that Blender does not tell cells apart: what was moved there object by
    object is off by that, and the rest looks so."""
    if wanted.frame is None:
        return
    for mover in movers:
        far = float(np.abs(world_matrix(mover)[:3, 3]).max())
        step = float(np.spacing(np.float32(far))) * wanted.unit_scale_m
        if step <= ROUNDING * wanted.cell_size_m:
            continue
        off = [node for node in (mover, *ancestors(mover)) if _is_rounded(node, far)]
        where = f"'{mover.name}' is {far * wanted.unit_scale_m / 1e3:.0f} km from the world's origin, where Blender"
        if off:
            yield Finding(
                "far_from_origin",
                "warning",
                f"{where} rounds positions to {step * 100:.2g} cm, and keys or constraints move '{off[0].name}' there: "
                "steps are off by as much.",
                "Parent it to an empty at that place, keyed near the empty, or move the shot to the origin.",
            )
        else:
            yield Finding(
                "far_from_origin",
                "note",
                f"{where} shows positions rounded to {step * 100:.2g} cm. The bake is read and solved about its own "
                "ground, and is as exact as at the origin.",
                "Move the shot to the origin if it trembles in the viewport or in pictures.",
            )


def _is_rounded(node: bpy.types.Object, far: float) -> bool:
    """True if something moves an object to places that are far away themselves, about as far as that."""
    keyed = any(path.startswith("location") for path, _ in animated_paths(node))
    owners = (node, *(node.pose.bones if node.pose else ()))
    constraints = (constraint for owner in owners for constraint in owner.constraints if not is_own(constraint))
    is_held = any(not constraint.mute and constraint.influence for constraint in constraints)
    return is_held or (keyed and float(np.abs(np.array(node.location)).max()) > far / 2)


def _idle_actions(objects: Iterable[bpy.types.Object], first: float, last: float) -> Iterator[Finding]:
    """Actions and strips within some frames of the animation that move nothing."""
    for obj in objects:
        animation: Any = obj.animation_data
        if animation is None:
            continue
        if animation.action and not animation.use_tweak_mode and (lacking := _lacks(animation)):
            yield Finding(
                "no_slot",
                "warning",
                f"The action '{animation.action.name}' of '{obj.name}' has no {lacking} there and moves nothing",
                f"choose its {lacking} in the Action Editor, or unlink the action.",
            )
        tracks = playing_tracks(animation) if animation.use_nla else ()
        for strip in (strip for track in tracks for strip in _clips(track.strips)):
            within = strip.frame_start < last and strip.frame_end > first
            if within and not strip.mute and (lacking := _lacks(strip)):
                yield Finding(
                    "no_slot",
                    "warning",
                    f"NLA strip '{strip.name}' of '{obj.name}' has no {lacking}: nothing moves by it in frames "
                    f"{strip.frame_start:.0f}-{strip.frame_end:.0f}.",
                    f"Choose its {lacking} in the sidebar of the NLA editor, or mute the strip.",
                )


def _clips(strips: Iterable[Any]) -> Iterator[Any]:
    """The strips that play an action, also within meta strips."""
    for strip in strips:
        if strip.type == "META" and not strip.mute:
            yield from _clips(strip.strips)
        elif strip.type == "CLIP":
            yield strip


def _lacks(owner: Any) -> str:
    """Reason why animation data or a strip moves nothing; an empty text if it plays."""
    if owner.action is None:
        return "action"
    return "slot" if HAS_SLOTS and slot_of(owner) is None and len(owner.action.slots) else ""


def _idle_drivers(objects: Iterable[bpy.types.Object]) -> Iterator[Finding]:
    """Drivers that Blender could not evaluate as the shot was read."""
    owners: Any = dict.fromkeys(node for obj in objects for node in (obj, obj.data) if node and node.animation_data)
    idle = [
        (owner.name, curve.data_path)
        for owner in owners
        for curve in owner.animation_data.drivers
        if not (curve.mute or curve.driver.is_valid or any(word in curve.data_path for word in _NO_MOTION))
    ]
    if not idle:
        return
    names, paths = map(dict.fromkeys, zip(*idle, strict=True))
    held, several = bool(bpy.app.autoexec_fail), len(idle) > 1
    yield Finding(
        "idle_drivers",
        "warning",
        f"{len(idle)} driver{'s' if several else ''} of {listed(names)} {'do' if several else 'does'} not run (on "
        f"{listed(paths)}){', as Auto Run Python Scripts is off' if held else ''}, and nothing moves by "
        f"{'them' if several else 'it'}",
        "switch it on in Preferences > Save & Load and open the file again, or key what they do (Object > Animation > "
        "Bake Action)."
        if held
        else "correct its expression and variables in the Drivers editor, or remove it.",
    )


def _followed_shapes(wanted: BakeSettings) -> Iterator[Finding]:
    """Bodies without an armature, whose contacts are parts of a shape that changes."""
    for character in wanted.characters:
        if character.body and any(map(deforms, meshes_of(settings.resolve(character.body)))):
            yield Finding(
                "followed_shape",
                "note",
                f"'{character.name}' has no armature: its contacts {listed(sole.name for sole in character.soles)} are "
                "parts that keep their shape while it changes.",
                "Check in Contacts that each foot is there, and remove what is none.",
            )


def shape_findings(objects: Iterable[bpy.types.Object]) -> list[Finding]:
    """Objects that change their shape over time, and print as rigid bodies."""
    changing = [(obj.name, by) for obj in objects if (by := changes_shape(obj))]
    return [
        Finding(
            "changing_shape",
            "warning",
            f"'{name}' changes its shape by {by}, but prints as a rigid body, in the shape of the frame that is shown.",
            "Let an armature move its parts, or keys the object itself.",
        )
        for name, by in changing
    ]


def _crowds(scene: bpy.types.Scene, bodies: Collection[bpy.types.Object]) -> Sequence[Finding]:
    """Copies of what prints that are instances."""
    showing = instancers(scene, bodies)
    return [
        crowd_finding([name for name, other in showing.items() if other == shown], shown)
        for shown in dict.fromkeys(showing.values())
    ]


def _unseen_ground(scene: bpy.types.Scene, ground: bpy.types.Object | None) -> Iterator[Finding]:
    """A ground that is in another scene, or in none, so that its prints are seen there alone."""
    if ground is not None and ground.name not in scene.objects and not instancers(scene, [ground]):
        yield Finding(
            "unseen_ground",
            "warning",
            f"Ground '{ground.name}' is not in scene '{scene.name}', where its prints are not seen",
            "link it there (Object > Link/Transfer Data > Link Objects to Scene), or choose another one.",
        )


def _rigs_below(objects: settings.Objects, wanted: BakeSettings) -> Iterator[Finding]:
    """Rigs that nobody added under a character that was."""
    bodies = [settings.resolve(character.armature) for character in wanted.characters if character.armature]
    for body in bodies:
        if names := [rig.name for rig in rigs_below(objects, body, bodies)]:
            said = f"{listed(names)} stands under '{body.name}' and is no character: its feet do not print"
            yield Finding("rig_below", "warning", said, "add it, or join the two rigs of one body (Ctrl J).")
