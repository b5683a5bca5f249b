"""Who crawls prints with hands, knees and the feet that lie behind them, whatever the bones are called."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from softground_addon.blender.characters.character_setup import add_character
from softground_addon.core.numerics.intervals import runs
from tests.blender import grounds, rigs

RATE, FRAMES, PERIOD = 30, 90, 36
DUTY, STRIDE, LIFT = 0.65, 0.45, 0.05
THICK = 0.05
"""Radius of the limbs [m]."""

KNEES_UNDER, HANDS_UNDER = np.array([0.1, 0.0]), np.array([0.18, -0.55])
"""Where knee and hand stand under the body on the left, x and y [m]; it faces -Y."""


def reach(side: int, limb: str) -> tuple[np.ndarray, np.ndarray]:
    """Where a knee or hand is (F, 3) [m], and when it stands (F,): each hand goes with the other side's knee."""
    cycle = np.arange(FRAMES) / PERIOD + (0.5 if side == (limb == "hand") else 0.0) + 0.1
    phase = cycle % 1.0
    swing = np.clip((phase - DUTY) / (1 - DUTY), 0, 1)
    ahead = np.floor(cycle) + swing - np.sin(2 * np.pi * swing) / (2 * np.pi) - (0.5 if side == (limb == "hand") else 0)
    x, y = HANDS_UNDER if limb == "hand" else KNEES_UNDER
    height = (0.04 if limb == "hand" else THICK) + LIFT * np.sin(np.pi * swing)
    return np.stack([np.full(FRAMES, x * (1 - 2 * side)), y - STRIDE * ahead, height], axis=-1), phase < DUTY


def along(head: np.ndarray, tail: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Matrices (F, 4, 4) of a bone from one path (F, 3) toward another, its x near `across`."""
    y = (tail - head) / np.linalg.norm(tail - head, axis=-1, keepdims=True)
    z = np.cross(np.broadcast_to(across, y.shape), y)
    z /= np.linalg.norm(z, axis=-1, keepdims=True)
    matrix = np.broadcast_to(np.eye(4), (len(y), 4, 4)).copy()
    matrix[:, :3, 0], matrix[:, :3, 1], matrix[:, :3, 2], matrix[:, :3, 3] = np.cross(y, z), y, z, head
    return matrix


def poses() -> dict[tuple[str, int], np.ndarray]:
    """Where each bone of the figure is, by part and side (0 for those of the trunk), (F, 4, 4) [m]."""
    body = np.zeros((FRAMES, 3))
    body[:, 1] = -STRIDE * np.arange(FRAMES) / PERIOD
    sideways, ahead = np.array([1.0, 0, 0]), np.array([0.0, -1.0, 0.16]) / np.hypot(1, 0.16)
    places, at = {}, np.add(body, (0, 0, 0.47))
    for part, (head, tail) in rigs.TRUNK.items():
        end = at + ahead * (tail[2] - head[2])
        places[part, 0] = along(at, end, sideways)
        at = end
    for side in (0, 1):
        mirror = np.array([1 - 2 * side, 1, 1])
        knee, hand = reach(side, "knee")[0], reach(side, "hand")[0]
        hip = body + mirror * (0.1, 0.0, 0.47)
        ankle, instep, toes = (np.add(knee, (0, behind, 0)) for behind in (0.41, 0.54, 0.61))
        shoulder = body + mirror * (0.18, -0.55, 0.56)
        elbow = (shoulder + hand) / 2 + (0, 0.08, 0)
        joints = {
            "collar": (shoulder - mirror * (0.15, 0, 0), shoulder),
            "upper_arm": (shoulder, elbow),
            "forearm": (elbow, hand),
            "hand": (hand, np.add(hand, (0, -0.12, 0))),
            "thigh": (hip, knee),
            "shin": (knee, ankle),
            "foot": (ankle, instep),
            "toe": (instep, toes),
        }
        up = np.array([0.0, 0.0, 1.0])
        places |= {(part, side): along(*ends, up if part == "collar" else sideways) for part, ends in joints.items()}
    return places


def tube(length: float, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and faces of a bar along y from the origin."""
    angle, share = np.meshgrid(np.linspace(0, 2 * np.pi, 12, endpoint=False), np.linspace(0, 1, 6))
    points = np.stack([radius * np.cos(angle), length * share, radius * np.sin(angle)], axis=-1).reshape(-1, 3)
    ring, corner = np.divmod(np.arange(60), 12)
    here, beside = 12 * ring + corner, 12 * ring + (corner + 1) % 12
    return points, np.stack([here, beside, beside + 12, here + 12], axis=-1)


def crawler(family: rigs.Family) -> bpy.types.Object:
    """A figure that stands at rest and crawls, in a skin of bars around its bones."""
    armature = rigs.human(family)
    rest = {bone.name: np.array(bone.matrix_local) for bone in armature.data.bones}
    placed = {family.name(*key): matrix for key, matrix in poses().items()}
    points, faces, owners = [], [], []
    for name, matrix in placed.items():
        pose, bone = armature.pose.bones[name], armature.data.bones[name]
        still = np.broadcast_to(np.eye(4), matrix.shape)
        above, above_rest = (placed[bone.parent.name], rest[bone.parent.name]) if bone.parent else (still, np.eye(4))
        basis = np.linalg.inv(above @ np.linalg.inv(above_rest) @ rest[name]) @ matrix
        pose.rotation_mode = "QUATERNION"
        for frame, in_bone in enumerate(basis):
            pose.matrix_basis = in_bone.T.tolist()
            pose.keyframe_insert("location", frame=frame + 1)
            pose.keyframe_insert("rotation_quaternion", frame=frame + 1)
        bar, sides = tube(bone.length, 0.04 if "hand" in name.lower() else THICK)
        faces += (sides + sum(map(len, points))).tolist()
        points.append(bar @ rest[name][:3, :3].T + rest[name][:3, 3])
        owners += [name] * len(bar)
    mesh = bpy.data.meshes.new("Skin")
    mesh.from_pydata(np.concatenate(points).tolist(), [], faces)
    skin = bpy.data.objects.new("Skin", mesh)
    bpy.context.scene.collection.objects.link(skin)
    skin.parent = armature
    skin.modifiers.new("Armature", "ARMATURE").object = armature
    for name in placed:
        skin.vertex_groups.new(name=name).add([n for n, owner in enumerate(owners) if owner == name], 1.0, "REPLACE")
    return armature


@pytest.mark.slow
@pytest.mark.parametrize("named", [True, False])
def test_hands_knees_and_feet_of_who_crawls_print_as_they_stand(scene, named):
    scene.render.fps = RATE
    armature = crawler(rigs.FAMILIES["mixamo"])
    for number, bone in enumerate(() if named else armature.data.bones):
        bone.name = f"Q{number * 7 % 31}"
    bpy.context.view_layer.update()
    add_character(scene, armature)
    steps = grounds.bake(scene, cell_size=0.02).report["steps"]
    seen = set()
    for side in (0, 1):
        for limb, length, behind in (("hand", 0.12, -0.06), ("knee", 0.41, 0.205), ("foot", 0.20, 0.51)):
            path, stands = reach(side, "knee" if limb == "foot" else limb)
            middle = path[:, :2] + (0, behind)
            for first, end in zip(*runs(stands), strict=True):
                place = middle[(first + end) // 2]
                here = [
                    number
                    for number, step in enumerate(steps)
                    if np.abs(step["position"][:2] - place).max() < length / 2 + 0.05
                    and abs(step["frame_start"] - 1 - first) < 4
                    and abs(step["frame_end"] - end) < 4
                ]
                assert len(here) == 1, (side, limb, first)
                seen |= {*here}
    assert seen == {*range(len(steps))}
