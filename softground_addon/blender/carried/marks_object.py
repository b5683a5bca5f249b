"""The object `SoftGround Marks`: what soles leave on hard floors, put beside the ground of a bake and taken away."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ...core.carried.film import Meeting
from ...core.carried.floor_steps import FloorSteps, SoleOnFloors
from ...core.carried.marks import Marks
from ...core.ground import surfaces
from ...core.meshing.face_edges import face_edges
from ...core.numerics.arrays import Array
from ...core.record.record import EditableStep
from ...core.rig.recording import SceneUnits
from .. import compat, mesh_arrays
from ..belongings import Belonging, exchange
from ..drafts import none_left_if_it_fails
from ..nodes.node_modifiers import curves_of, inputs_of, modifier_with, set_inputs
from ..placement import hang_on
from ..playback import weather_modifier
from ..rigs.object_data import mesh_of
from . import marks_nodes as nodes
from .marks_material import material_for, reads_clock

NAME = nodes.GROUP
BELONGS = Belonging(nodes.MARK, "softground_marked", "softground_marked_by")
of = BELONGS.of
ORIGIN, MADE_FOR = "softground_marks_origin", "softground_marks_made_for"
"""Properties of its mesh, where its origin was [Blender units], and of its node group, for what it was made."""
LOOKS_OTHER = "softground_marks_look"
"""Of the object: true where a material was not ours, which may read what the viewport does not work out."""
WITHOUT_WEATHER = {name: value for name, value, *_ in nodes.SLIDERS}
"""Values at first of the sliders that follow the ground's weather."""
SELECTED = {".select_vert", ".select_edge", ".select_poly"}
"""What new elements of a mesh are, which takes a thirtieth of it in a file."""
FLOORS, THICKNESS = "softground_floors", "softground_thickness"
"""Of its mesh: steps on hard floors, and how much thicker it is for its mass [Blender units m²/kg]."""


def put(ground: bpy.types.Object, marks: Marks | None, *, surface: str, units: SceneUnits) -> bpy.types.Object | None:
    """Let a ground have marks in place of those that it may have; None takes them away."""
    older = BELONGS.remaining(ground, wanted=marks is not None and bool(len(marks.faces)))
    _remove_unused()
    if marks is None or not len(marks.faces):
        return None
    modifier: Any = _modifier_of(older) if older else None
    before = Vector(mesh_of(older).get(ORIGIN, older.location)) if older else Vector()
    with none_left_if_it_fails():
        mesh = _mesh(marks, surface, units)
        group = _group_for(modifier and modifier.node_group, surface, units)
        if not older or _is_ours_of_another(older, surface):
            mesh.materials.append(material_for(surfaces.sticking(surface)))
    obj = older or bpy.data.objects.new(NAME, mesh)
    if older:
        if len(mesh.materials):
            mesh_of(older).materials.clear()
        exchange(older, mesh)
    obj.location += Vector(mesh[ORIGIN]) - before
    BELONGS.give(ground, obj)
    if units.frame:
        hang_on(obj, ground, units.frame)
    is_known = modifier is not None and obj.get(LOOKS_OTHER, False)
    obj[LOOKS_OTHER] = not all(map(reads_clock, _looks(obj)))  # another's, or of an earlier version
    modifier = modifier or obj.modifiers.new(NAME, "NODES")
    _play(modifier, group)
    if obj[LOOKS_OTHER] and not is_known:  # from then on it is the user's choice
        set_inputs(modifier, {nodes.IN_VIEW.name: True})
    _remove_unused()
    return obj


def follow(ground: bpy.types.Object, steps: Sequence[EditableStep], shed: Mapping[int, float]) -> None:
    """Have the marks of a ground, if there are any, weigh what steps on the soft ground come to, as they are edited.

    Parameters
    ----------
    ground : bpy.types.Object
    steps, shed
        As of `FloorSteps.films`.
    """
    obj = of(ground)
    mesh: Any = obj and obj.data
    if obj is None or not has_numbers(obj):
        return
    names = (nodes.SHARE, nodes.ZONE, nodes.STEP, nodes.BIRTH, nodes.MASS)
    share, zone, step, birth, before = (values(mesh, name) for name in names)
    films, _ = floors_of(obj).films(steps, shed)
    each = np.array([films[number] for number in range(len(films))])
    mass = each[step.astype(int), zone.astype(int)] * share
    birth = _or_never(birth - nodes.NEVER * (birth > nodes.NEVER / 2), mass, step.astype(int))
    place = mesh_arrays.positions(mesh)
    place[:, 2] += (mass - np.maximum(before, 0.0)) * mesh[THICKNESS]  # less than 0 of an earlier version
    mesh.vertices.foreach_set("co", place.astype(np.float32).ravel())
    for name, numbers in ((nodes.MASS, mass), (nodes.BIRTH, birth)):
        mesh.attributes[name].data.foreach_set("value", numbers.astype(np.float32))
    mesh.update()


def values(mesh: Any, name: str) -> NDArray[np.float64]:
    """One of the attributes of a mesh of marks, as numbers."""
    attribute = mesh.attributes[name].data
    numbers = np.empty(len(attribute), np.float32 if mesh.attributes[name].data_type == "FLOAT" else np.int32)
    attribute.foreach_get("value", numbers)
    return numbers.astype(float)


def follow_weather(ground: bpy.types.Object, shown: bpy.types.Object) -> None:
    """Have the marks of a ground, if there are any, follow the weather on what shows its prints; none without."""
    obj = of(ground)
    modifier = obj and not obj.library and _modifier_of(obj)
    if modifier:
        weather_modifier.lead(shown, modifier, WITHOUT_WEATHER)


def floors_of(obj: bpy.types.Object) -> FloorSteps:
    """Steps on hard floors from which marks follow."""
    mesh: Any = obj.data
    return _floors(mesh[FLOORS])


def has_numbers(obj: bpy.types.Object) -> bool:
    """True of marks whose numbers are all there: not of an earlier bake, nor changed by the user."""
    mesh: Any = obj.data
    names = {nodes.BIRTH, nodes.SHARE, nodes.ZONE, nodes.STEP, nodes.MASS}
    return mesh.get(FLOORS) is not None and names <= {*mesh.attributes.keys()}


def _or_never(birth: Array, mass: Array, step: NDArray[Any]) -> Array:
    """Births of vertices, without those of marks that weigh nothing."""
    return np.where(np.bincount(step, mass)[step] > 0, birth, birth + nodes.NEVER) if len(step) else birth


def _text(floors: FloorSteps) -> str:
    """Steps on hard floors as text."""
    return json.dumps(asdict(floors), default=np.ndarray.tolist)


def _floors(text: str) -> FloorSteps:
    """Steps on hard floors from `_text`."""
    said = json.loads(text)
    for sole in said["soles"]:
        for meeting in sole["meetings"]:
            meeting["shares"] = None if meeting["shares"] is None else np.array(meeting["shares"])
        sole["meetings"] = tuple(Meeting(**meeting) for meeting in sole["meetings"])
        sole["of"], sole["areas"] = tuple(sole["of"]), np.array(sole["areas"])
    return FloorSteps(**{**said, "soles": tuple(SoleOnFloors(**sole) for sole in said["soles"])})


def fields_of(obj: bpy.types.Object) -> list[tuple[str, tuple[Any, str]]]:
    """Sliders of the marks by name, as `layout.prop` takes them."""
    modifier = _modifier_of(obj)
    if modifier is None:
        return []
    inputs = inputs_of(modifier)
    return [(name, compat.input_field(modifier, inputs[name])) for name, *_ in nodes.SLIDERS if name in inputs]


def remove(ground: bpy.types.Object) -> None:
    """Take a ground's marks away; nothing happens where there are none."""
    BELONGS.remove(ground)
    _remove_unused()


def _remove_unused() -> None:
    """Remove groups and materials that no marks have any more."""
    blocks = (*bpy.data.node_groups, *bpy.data.materials)
    bpy.data.batch_remove([block for block in blocks if block.get(nodes.MARK) and not block.users])


def _is_ours_of_another(obj: bpy.types.Object, surface: str) -> bool:
    """True if its materials are ours, and none for this surface."""
    looks = [look.get(nodes.MARK) for look in _looks(obj)]
    return all(looks) and surface not in looks


def _looks(obj: bpy.types.Object) -> list[bpy.types.Material]:
    """Materials that an object shows, whether they are its own or of its mesh."""
    return [slot.material for slot in obj.material_slots if slot.material]


def _modifier_of(obj: bpy.types.Object) -> Any:
    return modifier_with(obj, lambda group: bool(group.get(nodes.MARK)))


def _group_for(group: Any, surface: str, units: SceneUnits) -> Any:
    """The node group that marks have, or a new one if it is for another surface, other units or by earlier laws."""
    frame_rate = units.frame_rate * units.time_stretch
    made_for = f"{surface} {frame_rate} {nodes.VERSION}"
    if not group or group.get(MADE_FOR) != made_for:
        group = nodes.build(surfaces.sticking(surface), frame_rate=frame_rate)
        group[MADE_FOR] = made_for
    return group


def _play(modifier: Any, group: Any) -> None:
    """Have marks play a group, with what the artist has set."""
    if modifier.node_group == group:
        return
    if modifier.node_group:
        weather_modifier.let_go(modifier, WITHOUT_WEATHER)
    chosen = _sliders(modifier)
    modifier.node_group = group
    set_inputs(modifier, chosen)


def sliders_of(obj: bpy.types.Object, frame: float) -> dict[str, float]:
    """Values of the sliders of marks at a frame of the animation by name, those at first where the artist has none."""
    modifier = _modifier_of(obj)
    if not (modifier and modifier.node_group):
        return _sliders(modifier)
    keyed = {name: curve.evaluate(frame) for name, curve in curves_of(modifier).items()}
    return _sliders(modifier) | weather_modifier.led_values(modifier, frame) | keyed


def _sliders(modifier: Any) -> dict[str, float]:
    inputs = inputs_of(modifier) if modifier and modifier.node_group else {}
    chosen = {name: compat.read_input(modifier, inputs[name]) for name, *_ in nodes.INPUTS if name in inputs}
    first = {name: value for name, value, *_ in nodes.INPUTS}
    return first | {name: value for name, value in chosen.items() if value is not None}


def _mesh(marks: Marks, surface: str, units: SceneUnits) -> bpy.types.Mesh:
    """The mesh of marks, as seen from its first vertex."""
    record = surfaces.sticking(surface)
    assert record.carried is not None
    unit_scale = units.unit_scale_m
    marks = marks.in_turn()
    birth = np.round(marks.birth * units.time_stretch * 8) / 8  # which is so as well where they never come
    place = marks.position / unit_scale
    place[:, 2] += marks.mass / record.density / unit_scale
    origin = marks.position[0] / unit_scale
    corners, starts = marks.faces.ravel(), 4 * np.arange(len(marks.faces))
    edges, of_corner = face_edges(corners, starts)
    columns = (
        (nodes.BIRTH, "FLOAT", _or_never(birth, marks.mass, marks.step)),
        (nodes.MASS, "FLOAT", marks.mass),
        (nodes.SHARE, "FLOAT", marks.share),
        (nodes.ZONE, "INT8", marks.zone),
        (nodes.TREAD, "FLOAT", marks.tread),
        (nodes.KIND, "INT8", np.full(len(place), surfaces.CARRIED_KINDS.index(record.carried.kind))),
        (nodes.STEP, "INT", marks.step),
        (nodes.SOLE, "FLOAT_VECTOR", marks.sole),
    )
    pads = ((nodes.PAD, "FLOAT_VECTOR", marks.pad),) if marks.pad.any() else ()
    mesh = mesh_arrays.points(NAME, place - origin, (*columns, *pads))
    mesh[ORIGIN], mesh[FLOORS] = origin.tolist(), _text(marks.floors)
    mesh[THICKNESS] = 1.0 / record.density / unit_scale
    mesh_arrays.add_faces(mesh, corners, starts, edges, of_corner)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(starts), bool))
    for name in SELECTED & {*mesh.attributes.keys()}:
        mesh.attributes.remove(mesh.attributes[name])
    mesh.update()
    return mesh
