"""Animals of boxes with two to eight legs, at random: their rigs, names, sizes and gaits, and when each foot stands."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from tests.blender import rigs

RATES = (24, 25, 30, 48, 60, 120)
FEET = ("chain", "free", "split", "bare")
NAMES = ("named", "half", "unnamed", "prefixed")
HEEL = np.radians(20)
"""How far a heel rises before its toes lift."""
GRAVITY = 9.81
HIGHEST = 0.08
"""Largest rise and fall of hips, over their height."""


@dataclass(frozen=True)
class Animal:
    """What an animal is; lengths are in units of its hips' height, times in periods of its gait.

    Attributes
    ----------
    legs : int
    size : float
        Height of its hips [m].
    unit : float
        Scale of its armature object.
    rate : int
        Frames a second.
    period : float
        Time of a step and its swing [s].
    duty, stride, clearance : float
        Share of a period for which a foot stands, its way and its height in swing.
    cycles : float
        How many periods the shot shows.
    foot : str
        'chain': the last bone of a leg with inverse kinematics; 'free': a child of the root; 'split': the same, with
        an ankle on the last bone of the leg that touches too; 'bare': the same, but without skin.
    names : str
        Which bones tell what they are.
    tail, rolls, on_the_spot, carried : bool
        True if it has a tail, its heels rise before its toes, it stays where it is, its object travels.
    turn : float
        Its heading [rad].
    level : float
        Height of its ground.
    offset : float
        Phase between the pairs of legs.
    idle : bool
        True if it stands where it is and moves its trunk alone.
    skates, trembles, floats : float
        Share of its stride by which a standing foot slides, how far its feet tremble, and by how much the first of them
        stands higher than the others.
    toes, arms, grazes, fine : bool
        True if its feet have toes, it has arms or holds its head low, and its skin has more vertices than corners.
    seed : int
    """

    legs: int
    size: float
    unit: float
    rate: int
    period: float
    duty: float
    stride: float
    clearance: float
    cycles: float
    foot: str
    names: str
    tail: bool
    rolls: bool
    on_the_spot: bool
    carried: bool
    turn: float
    level: float
    offset: float
    idle: bool
    skates: float
    trembles: float
    floats: float
    toes: bool
    arms: bool
    grazes: bool
    fine: bool
    seed: int

    @staticmethod
    def drawn(seed: int) -> Animal:
        """The animal of a seed."""
        chance = np.random.default_rng(seed)
        legs = int(chance.choice([2, 2, 4, 4, 4, 6, 8]))
        size = float(10 ** chance.uniform(np.log10(0.02), np.log10(40)))
        foot = str(chance.choice(FEET))
        runs = legs <= 4 and chance.random() < 0.3
        return Animal(
            legs=legs,
            size=size,
            unit=float(chance.choice([1.0, 1.0, 0.01, 100.0])),
            rate=int(chance.choice(RATES)),
            period=float(chance.uniform(0.7, 1.3) * np.clip(np.sqrt(size), 0.6, 2.0)),
            duty=float(chance.uniform(0.32, 0.45) if runs else chance.uniform(0.55, 0.75)),
            stride=float(chance.uniform(0.25, 0.5)),
            clearance=float(chance.uniform(0.08, 0.2)),
            cycles=float(chance.uniform(2.2, 3.5)),
            foot=foot,
            names=str(chance.choice(NAMES)),
            tail=bool(chance.random() < 0.4),
            rolls=bool(chance.random() < 0.5) and foot in ("chain", "free"),
            on_the_spot=bool(chance.random() < 0.25),
            carried=bool(chance.random() < 0.3),
            turn=float(chance.uniform(0, 6.28)),
            level=float(chance.choice([0.0, 0.0, chance.uniform(-3, 3)])),
            offset=0.5 if legs == 2 else float(chance.uniform(0.1, 0.4)),
            idle=bool(chance.random() < 0.1),
            skates=float(chance.choice([0.0, 0.0, 0.0, chance.uniform(0.03, 0.12)])),
            trembles=float(chance.choice([0.0, 0.0, 0.0, chance.uniform(0.0005, 0.002)])),
            floats=float(chance.choice([0.0, 0.0, 0.0, chance.uniform(0.002, 0.008)])),
            toes=bool(chance.random() < 0.4) and foot in ("chain", "free"),
            arms=legs == 2 and bool(chance.random() < 0.5),
            grazes=legs == 4 and bool(chance.random() < 0.2),
            fine=bool(chance.random() < 0.4),
            seed=seed,
        )

    @property
    def frames(self) -> int:
        """Length of the shot."""
        return round(self.cycles * self.period * self.rate) + 1

    def feet(self) -> list[tuple[str, str, float, float]]:
        """Of each foot its names' end, its bones' stem, and where it is along the body and across it."""
        return [
            (side, stem, along, across)
            for number, along in enumerate(np.linspace(0.55, -0.55, self.legs // 2) if self.legs > 2 else [0.0])
            for side, across in (("L", 0.2), ("R", -0.2))
            for stem in [["", "Front", "Mid", "Fore"][number]]
        ]

    def bone(self, stem: str, part: str, side: str) -> str:
        """Name of a bone of a leg."""
        if self.names == "unnamed" or (self.names == "half" and stem):
            return f"b{1 + ['Thigh', 'Shin', 'Foot'].index(part)}{stem[:1]}{stem[-1:]}.{side}"
        return f"{side}_{stem}{part}" if self.names == "prefixed" else f"{stem}{part}.{side}"

    def phases(self) -> NDArray[np.float64]:
        """Periods since each foot first came down, (frames, legs)."""
        time = np.arange(self.frames)[:, None] / self.rate / self.period
        legs = np.arange(self.legs)
        return time + legs % 2 * 0.5 + legs // 2 * self.offset + 0.15

    def stands(self) -> NDArray[np.bool_]:
        """True while each foot is on the ground, (frames, legs)."""
        return (self.phases() % 1.0 < self.duty) | self.idle

    def ways(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Way ahead and height of each foot, and how far its heel is raised [rad], (frames, legs)."""
        if self.idle:
            still = np.zeros((self.frames, self.legs))
            return still, still + self.floats * (np.arange(self.legs) == 0), still
        phase = self.phases()
        share = phase % 1.0
        swing = np.clip((share - self.duty) / (1 - self.duty), 0, 1)
        ahead = np.floor(phase) + swing - np.sin(2 * np.pi * swing) / (2 * np.pi) + self.duty / 2
        ahead = (ahead - (phase if self.on_the_spot else phase[0])) * self.stride  # under its hips in mid-stance
        ahead += self.skates * self.stride * (np.clip(share / self.duty, 0, 1) - swing)
        rise = np.clip(1 - (self.duty - share) / (0.25 * self.duty), 0, 1) * (share < self.duty)
        heel = HEEL * np.where(swing > 0, np.clip(1 - 2.5 * swing, 0, 1), rise) * self.rolls
        chance = np.random.default_rng(self.seed)
        ahead = ahead + chance.normal(0, self.trembles, ahead.shape)
        height = self.clearance * np.sin(np.pi * swing) + chance.normal(0, self.trembles / 2, ahead.shape)
        return ahead, height + self.floats * (np.arange(self.legs) == 0), heel

    def travel(self) -> NDArray[np.float64]:
        """Way of its body, (frames,)."""
        along = np.arange(self.frames) / self.rate / self.period * self.stride
        return np.zeros(self.frames) if self.on_the_spot or self.idle else along

    def bob(self) -> NDArray[np.float64]:
        """Height of its hips, (frames,): a bob, or where no foot is down a fall, as far as its hips can take it."""
        time = np.arange(self.frames) / self.rate
        supported = self.stands().any(axis=1)
        if supported.all():
            return np.asarray(0.01 * np.cos(4 * np.pi * time / self.period))
        push = supported / supported.mean() - 1.0
        rise = np.cumsum(push - push.mean()) / self.rate
        fall = np.cumsum(rise - rise.mean()) / self.rate * GRAVITY / self.size
        return fall * min(1.0, HIGHEST / np.ptp(fall))


Point = tuple[float, float, float]
FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass
class _Model:
    """Bones with their heads and tails, what they hang on, and the boxes that are their skin."""

    bones: dict[str, tuple[Point, Point]]
    parents: dict[str, str]
    boxes: list[tuple[list[Point], str]]

    def bone(self, name: str, head: Point, tail: Point, parent: str) -> None:
        self.bones[name], self.parents[name] = (head, tail), parent

    def box(self, bone: str, low: Point, high: Point) -> None:
        self.boxes.append(
            ([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])], bone)
        )


def make(animal: Animal) -> tuple[bpy.types.Object, list[set[str]]]:
    """The armature of an animal with its skin and keys in the open scene, and the bones that carry each of its feet."""
    model = _Model({"Root": ((0, 0, 0), (0, 0.2, 0))}, {}, [])
    _add_trunk(animal, model)
    legs = [_add_leg(animal, model, *foot) for foot in animal.feet()]
    size = animal.size / animal.unit
    bones = {name: tuple(tuple(size * along for along in end) for end in ends) for name, ends in model.bones.items()}
    armature = rigs.build(
        "Animal", bones, model.parents, steering=[leg.target for leg in legs if leg.target != leg.foot]
    )
    armature.scale = (animal.unit,) * 3
    armature.rotation_euler.z = animal.turn
    armature.location = (0, 0, animal.level * animal.size)
    _skin(armature, model.boxes, size, cuts=3 if animal.fine else 0)
    _keys(animal, armature, legs, size)
    return armature, [leg.carriers for leg in legs]


def _add_trunk(animal: Animal, model: _Model) -> None:
    """Trunk, head, arms and tail."""
    if animal.legs == 2:
        model.bone("Pelvis", (0, 0, 1.0), (0, 0, 1.2), "Root")
        model.bone("Spine", (0, 0, 1.2), (0, 0, 1.7), "Pelvis")
        model.bone("Head", (0, 0, 1.7), (0, 0, 2.0), "Spine")
        model.box("Spine", (-0.2, -0.15, 1.0), (0.2, 0.15, 1.7))
        model.box("Head", (-0.1, -0.15, 1.75), (0.1, 0.1, 2.0))
    else:
        model.bone("Pelvis", (0, 0.6, 1.1), (0, 0.2, 1.1), "Root")
        model.bone("Spine", (0, 0.2, 1.1), (0, -0.6, 1.1), "Pelvis")
        model.bone("Head", (0, -0.6, 1.2), (0, -1.0, 0.5 if animal.grazes else 1.4), "Spine")
        model.box("Spine", (-0.25, -0.7, 0.95), (0.25, 0.7, 1.4))
        model.box("Head", (-0.12, -1.1, 0.3 if animal.grazes else 1.2), (0.12, -0.95, 0.6 if animal.grazes else 1.5))
    for side, x in (("L", 0.3), ("R", -0.3)) if animal.arms else ():
        model.bone(f"Arm.{side}", (x, 0, 1.6), (x, 0, 1.1), "Spine")
        model.bone(f"Hand.{side}", (x, 0, 1.1), (x, 0, 0.9), f"Arm.{side}")
        model.box(f"Arm.{side}", (x - 0.04, -0.04, 1.1), (x + 0.04, 0.04, 1.6))
        model.box(f"Hand.{side}", (x - 0.03, -0.04, 0.85), (x + 0.03, 0.04, 1.1))
    ends = [(0.0, (0.15 if animal.legs == 2 else 0.7) + 0.3 * n, 1.1 - 0.15 * n) for n in range(4)]
    for number, (here, end) in enumerate(pairwise(ends) if animal.tail else ()):
        model.bone(f"Tail{number}", here, end, f"Tail{number - 1}" if number else "Pelvis")
        low, high = np.minimum(here, end) - 0.03, np.maximum(here, end) + 0.03
        model.box(f"Tail{number}", tuple(low), tuple(high))


@dataclass(frozen=True)
class _Leg:
    """Bones of a leg: what moves its foot, and those that carry it."""

    target: str
    shin: str
    foot: str
    carriers: set[str]


def _add_leg(animal: Animal, model: _Model, side: str, stem: str, y: float, x: float) -> _Leg:
    thigh, shin, foot = (animal.bone(stem, part, side) for part in ("Thigh", "Shin", "Foot"))
    if animal.foot in ("split", "bare"):
        model.bone(shin, (x, y, 0.4), (x, y, 0.1), "Root")
        model.bone(foot, (x, y, 0.1), (x, y - 0.15, 0.03), "Root")
        if animal.foot == "bare":
            model.box(shin, (x - 0.07, y - 0.18, 0), (x + 0.07, y + 0.08, 0.6))
            return _Leg(foot, shin, foot, {shin})
        model.box(foot, (x - 0.07, y - 0.18, 0), (x + 0.07, y + 0.02, 0.08))
        model.box(shin, (x - 0.05, y + 0.03, 0.004), (x + 0.05, y + 0.12, 0.6))
        return _Leg(foot, shin, foot, {shin, foot})
    model.bone(thigh, (x, y, 1.0), (x, y - 0.06, 0.55), "Pelvis" if y >= 0 else "Spine")
    model.bone(shin, (x, y - 0.06, 0.55), (x, y, 0.1), thigh)
    model.bone(foot, (x, y, 0.1), (x, y - 0.08, 0.03), shin if animal.foot == "chain" else "Root")
    model.box(thigh, (x - 0.06, y - 0.09, 0.52), (x + 0.06, y + 0.04, 1.0))
    model.box(shin, (x - 0.05, y - 0.08, 0.1), (x + 0.05, y + 0.04, 0.56))
    model.box(foot, (x - 0.07, y - (0.08 if animal.toes else 0.18), 0), (x + 0.07, y + 0.08, 0.08))
    target, carriers = foot, {foot}
    if animal.foot == "chain":
        target = f"Target{stem}.{side}"
        model.bone(target, *model.bones[foot], "Root")
    if animal.toes:
        toe = foot.replace("Foot", "Toe") if "Foot" in foot else foot.replace("b3", "b4")
        model.bone(toe, (x, y - 0.08, 0.03), (x, y - 0.17, 0.02), foot)
        model.box(toe, (x - 0.07, y - 0.18, 0), (x + 0.07, y - 0.08, 0.05))
        carriers.add(toe)
    return _Leg(target, shin, foot, carriers)


def _skin(armature: bpy.types.Object, boxes: list[tuple[list[Point], str]], size: float, *, cuts: int) -> None:
    corners = np.concatenate([box for box, _ in boxes]) * size
    faces = [tuple(8 * number + corner for corner in face) for number in range(len(boxes)) for face in FACES]
    mesh = bpy.data.meshes.new("Skin")
    mesh.from_pydata(corners.tolist(), [], faces)
    skin = bpy.data.objects.new("Skin", mesh)
    bpy.context.scene.collection.objects.link(skin)
    skin.parent = armature
    for number, (_, bone) in enumerate(boxes):
        group = skin.vertex_groups.get(bone) or skin.vertex_groups.new(name=bone)
        group.add(range(8 * number, 8 * number + 8), 1.0, "REPLACE")
    if cuts:
        model = bmesh.new()
        model.from_mesh(mesh)
        bmesh.ops.subdivide_edges(model, edges=model.edges[:], cuts=cuts, use_grid_fill=True)
        model.to_mesh(mesh)
        model.free()
    skin.modifiers.new("Armature", "ARMATURE").object = armature


def _keys(animal: Animal, armature: bpy.types.Object, legs: list[_Leg], size: float) -> None:
    """Keys on every frame: of feet, trunk and tail, and where it carries all of them of the object."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = animal.rate, 1.0
    scene.frame_start, scene.frame_end = 1, animal.frames
    for number, leg in enumerate(legs):
        _key_foot(animal, armature, number, leg, size)
        if animal.foot in ("chain", "free"):
            reach = armature.pose.bones[leg.shin].constraints.new("IK")
            reach.target, reach.subtarget, reach.chain_count = armature, leg.target, 2
        if animal.foot == "chain":
            copy = armature.pose.bones[leg.foot].constraints.new("COPY_ROTATION")
            copy.target, copy.subtarget = armature, leg.target
    travel, bob = animal.travel(), animal.bob()
    heading, start = Matrix.Rotation(animal.turn, 3, "Z") @ Vector((0, -1, 0)), armature.location.copy()
    for frame in range(animal.frames):
        along = 0.0 if animal.carried else travel[frame]
        _pose(armature, "Pelvis", Matrix.Translation(size * Vector((0, -along, bob[frame] - 0.06))), frame)
        if animal.carried:
            armature.location = start + heading * (travel[frame] * animal.size)
            armature.keyframe_insert("location", frame=frame + 1)
        if animal.tail:
            wag = Matrix.Rotation(0.2 * np.sin(2 * np.pi * frame / animal.rate / animal.period), 4, "Z")
            _pose(armature, "Tail1", wag, frame, in_own_axes=True)


def _key_foot(animal: Animal, armature: bpy.types.Object, number: int, leg: _Leg, size: float) -> None:
    ahead, height, heel = (way[:, number] for way in animal.ways())
    if animal.carried:
        ahead = ahead - animal.travel()
    toe = Vector(armature.data.bones[leg.foot].head_local) + size * Vector((0, -0.18, -0.1))
    moved = {leg.target} if animal.foot in ("chain", "free") else {leg.foot, leg.shin}
    for frame in range(animal.frames):
        shift = Matrix.Translation(size * Vector((0, -ahead[frame], height[frame])))
        roll = Matrix.Translation(toe) @ Matrix.Rotation(heel[frame], 4, "X") @ Matrix.Translation(-toe)
        still = Matrix.Translation(size * Vector((0, -ahead[frame], 0)))
        for bone in moved:
            is_bare = animal.foot == "bare" and bone == leg.foot
            _pose(armature, bone, still if is_bare else shift @ roll, frame)


def _pose(
    armature: bpy.types.Object, bone: str, displacement: Matrix, frame: int, *, in_own_axes: bool = False
) -> None:
    """Keys that displace a bone in the armature's space, or turn it in its `own`."""
    posed = armature.pose.bones[bone]
    rest = posed.bone.matrix_local
    posed.rotation_mode = "QUATERNION"
    posed.matrix_basis = displacement if in_own_axes else rest.inverted() @ displacement @ rest
    posed.keyframe_insert("location", frame=frame + 1)
    posed.keyframe_insert("rotation_quaternion", frame=frame + 1)
