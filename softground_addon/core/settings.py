"""Everything that a bake depends on, as it was when the bake began.

The names of the fields are those of the report's inputs. A field says what it acts on first; where it says nothing,
that is what the one says that it is part of, and `Acts.READING` at the top: of a setting that somebody adds without a
thought, everything depends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import IntEnum
from typing import Any

from .ground.camera_view import CameraView
from .ground.material import UNSAID, GroundMaterial, Pressure
from .ground.regions import GroundKind, numbered
from .loads import estimate
from .loads.cell_limits import Fineness
from .motion.ground_frame import rows
from .response import foot_holds
from .response import response as responses
from .rig.mapping import SoleSource
from .rig.recording import SceneUnits
from .weather import felt_weather

DOWN = (0.0, 0.0, -1.0)


class Acts(IntEnum):
    """First stage that a setting acts on, in the order of a bake: a later one leaves what came before as it is."""

    READING = 0
    """What is read from the scene."""
    LOADS = 1
    """The forces on the ground."""
    PRESSING = 2
    """The prints."""
    RESPONDING = 3
    """The characters, and through them the prints."""
    WRITING = 4
    """How the prints are put on the ground."""
    OUTPUT = 5
    """Which results are made and where they go: a bake still fits when it changes."""


def _on(acts: Acts) -> Mapping[str, Acts]:
    return {"acts": acts}


@dataclass(frozen=True)
class ObjectName:
    """An object, or a scene: its name, and its number in this session, by which it is found whatever its name is."""

    name: str
    uid: int


@dataclass(frozen=True)
class CharacterSettings:
    """One character.

    Attributes
    ----------
    armature : ObjectName or None
        None for props without a rig, and for bodies.
    name : str
        What the user calls it.
    skin_mass_kg, size_m : float
        Mass by the volume of its skin and the size of its rig, both when it was added; 0 where unknown.
    force_model : 'WHOLE_BODY' or 'IMPULSE'
    joints : mapping of str to (str, str)
        Canonical joint to a bone and its end, "head" or "tail".
    holds : tuple of FootHold
        How Clean Feet holds single contacts.
    body : ObjectName or None
        The mesh that moves its own parts, or the empty above rigid ones, of a body without an armature; the bones of
        its soles are parts of it.
    dirty_soles, dirty_with : float, str
        Film on its soles as the shot starts, over the thickest that they carry, and its surface or liquid: that of the
        ground if empty.
    added_as : str
        Name of its rig as it was added; empty if it still is called so.
    """

    armature: ObjectName | None
    name: str
    mass_kg: float = field(metadata=_on(Acts.LOADS))
    skin_mass_kg: float
    size_m: float
    force_model: estimate.ForceModel = field(metadata=_on(Acts.LOADS))
    joints: Mapping[str, tuple[str, str]]
    soles: tuple[SoleSource, ...]
    holds: tuple[foot_holds.FootHold, ...] = field(default=(), metadata=_on(Acts.OUTPUT))
    body: ObjectName | None = field(default=None, metadata={"said_if_on": True})
    dirty_soles: float = field(default=0.0, metadata={"said_if_on": True, **_on(Acts.RESPONDING)})
    dirty_with: str = field(default="", metadata={"said_if_on": True, **_on(Acts.RESPONDING)})
    added_as: str = field(default="", metadata={"said_if_on": True, **_on(Acts.OUTPUT)})


def identity_of(said: Mapping[str, Any]) -> str:
    """Name by which a character of the inputs of a bake was added: the same however often its rig is renamed."""
    return str(said.get("added_as") or said["name"])


def renamed(before: Sequence[Mapping[str, Any]], now: Sequence[CharacterSettings]) -> dict[str, str]:
    """Present names of the characters in the inputs of a bake, by their names then.

    Those that nothing identifies, as they were removed and added again, follow the order of the list.
    """
    present = {each.added_as or each.name: each.name for each in now}
    names = {str(said["name"]): present.pop(identity_of(said)) for said in before if identity_of(said) in present}
    others = [str(said["name"]) for said in before if str(said["name"]) not in names]
    return names | (dict(zip(others, present.values(), strict=True)) if len(others) == len(present) else {})


@dataclass(frozen=True)
class RegionSettings:
    """A material slot of the ground that names a preset.

    Attributes
    ----------
    preset : str
        Its file name, or 'none' of a hard floor.
    material : GroundMaterial or None
        None of a hard floor, and of a preset that is not there.
    """

    slot: int
    preset: str
    surface: str
    material: GroundMaterial | None

    @property
    def kind(self) -> GroundKind | None:
        """Kind of its ground; None if it is hard."""
        return GroundKind(self.surface, self.material) if self.material else None


@dataclass(frozen=True)
class GroundSettings:
    """A soft ground beside the first, with what is set for it; the fields as of `BakeSettings`."""

    ground: ObjectName
    preset: str = field(metadata=_on(Acts.PRESSING))
    surface: str = field(metadata=_on(Acts.OUTPUT))
    material: GroundMaterial = field(metadata=_on(Acts.PRESSING))
    painted: tuple[str, str, str]
    weather: felt_weather.FeltWeather | None = field(metadata=_on(Acts.PRESSING))
    regions: tuple[RegionSettings, ...]
    under: str = field(metadata=_on(Acts.WRITING))


@dataclass(frozen=True)
class ResponseOptions:
    """Responses that are asked of the characters; None where something is off."""

    tilt: responses.TiltOptions | None
    grounding: responses.GroundingOptions | None


@dataclass(frozen=True)
class BakeSettings(SceneUnits):
    """Everything that a bake depends on, beside the objects themselves.

    Attributes
    ----------
    file, scene : str, ObjectName
        Where the shot is.
    ground : ObjectName or None
        None where one is to be made.
    preset, surface : str
        Preset that was loaded last, and the render material of a ground that is made.
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'
    painted : (str, str, str)
        What stiffness, layer depth and rim are painted with.
    frames : (int, int)
        First and last of the scene.
    sink_feet : bool
        True if feet are let down where a rig can take it, and are left as they are where not.
    output : 'BOTH', 'PRINTS' or 'RESPONSE'
    detail : 'AUTO', 'ALWAYS' or 'NEVER'
    shape_keys, dense_shape_keys : bool
        True if they are kept, and also where the ground is dense.
    tread_pattern : str
        One of `relief.tread.PATTERNS`, 'IMAGE' or 'SHOES'.
    tread_image : str
        A `relief.tread_map` as text; empty where the pattern is none of an image, or that cannot be read.
    relief : 'OFF', 'FINE' or 'CLOSE_UP'
    relief_vertices : int
        Most that a close-up may have along the trail.
    relief_strength : float
        Of all relief: 1 is as the look's amounts say.
    relief_look : str
        The look whose relief is shown; empty where none is.
    margin_m : float
        How far a ground that is made reaches beyond the walk.
    longest_bake_s : float
        A bake that would take longer is refused.
    debris : bool
        True if steps throw what physics says, which is then missing from their rims.
    shoe_treads : tuple of (str, str, str)
        Character, name of a sole, and its `relief.tread_map` as text, as a bake has read them from its meshes.
    weather : FeltWeather or None
        What steps find of earlier ones follows from it; None where they feel none.
    camera : CameraView or None
        The scene's, where a ground is to be made or shown close up; None without one.
    hard_grounds : tuple of ObjectName
        Objects that soles stand on without a print.
    wet_grounds : tuple of str
        What wets each of the `hard_grounds`, empty of a dry one; none if all are dry.
    marks : bool
        True if soles leave on hard ground what sticks to them.
    carried : (float, float)
        How much sticks to soles, and how far they carry it, over what is usual.
    carve : bool
        True if bodies carve deep ground where their feet are let down.
    regions : tuple of RegionSettings
        Slots of the ground that are made of something else, or are hard.
    gravity_direction : (float, float, float)
        Unit vector in the world.
    under : 'AUTO', 'ALWAYS' or 'NEVER'
        True if prints show what lies below the layer; by default where that is thin.
    grounds : tuple of GroundSettings
        Soft grounds beside the first.
    """

    file: str = field(metadata=_on(Acts.OUTPUT))
    scene: ObjectName = field(metadata=_on(Acts.OUTPUT))
    ground: ObjectName | None
    characters: tuple[CharacterSettings, ...]
    preset: str = field(metadata=_on(Acts.PRESSING))
    surface: str = field(metadata=_on(Acts.OUTPUT))
    material: GroundMaterial = field(metadata=_on(Acts.PRESSING))
    pressure: Pressure = field(metadata=_on(Acts.PRESSING))
    painted: tuple[str, str, str]
    cell_size_m: float = field(metadata=_on(Acts.PRESSING))
    frames: tuple[int, int]
    response: ResponseOptions | None = field(metadata=_on(Acts.RESPONDING))
    sink_feet: bool = field(metadata=_on(Acts.OUTPUT))
    output: str = field(metadata=_on(Acts.OUTPUT))
    detail: str = field(metadata=_on(Acts.WRITING))
    shape_keys: bool = field(metadata=_on(Acts.WRITING))
    dense_shape_keys: bool = field(metadata=_on(Acts.WRITING))
    tread_m: float = field(metadata=_on(Acts.WRITING))
    tread_pattern: str = field(metadata=_on(Acts.WRITING))
    tread_image: str = field(metadata=_on(Acts.WRITING))
    relief: str = field(metadata=_on(Acts.WRITING))
    relief_vertices: int = field(metadata=_on(Acts.WRITING))
    relief_strength: float = field(metadata=_on(Acts.WRITING))
    relief_look: str = field(metadata=_on(Acts.WRITING))
    margin_m: float = field(metadata=_on(Acts.OUTPUT))
    keep_forces: bool = field(metadata=_on(Acts.OUTPUT))
    longest_bake_s: float = field(metadata=_on(Acts.OUTPUT))
    debris: bool = field(default=False, metadata=_on(Acts.RESPONDING))
    shoe_treads: tuple[tuple[str, str, str], ...] = field(default=(), metadata=_on(Acts.OUTPUT))
    weather: felt_weather.FeltWeather | None = field(default=None, metadata=_on(Acts.PRESSING))
    camera: CameraView | None = field(default=None, metadata=_on(Acts.OUTPUT))
    hard_grounds: tuple[ObjectName, ...] = field(default=(), metadata=UNSAID)
    wet_grounds: tuple[str, ...] = field(default=(), metadata={**UNSAID, **_on(Acts.RESPONDING)})
    marks: bool = field(default=True, metadata={**UNSAID, **_on(Acts.RESPONDING)})
    carried: tuple[float, float] = field(default=(1.0, 1.0), metadata={**UNSAID, **_on(Acts.RESPONDING)})
    carve: bool = field(default=True, metadata={**UNSAID, **_on(Acts.RESPONDING)})
    regions: tuple[RegionSettings, ...] = field(default=(), metadata=UNSAID)
    gravity_direction: tuple[float, float, float] = field(default=DOWN, metadata=UNSAID)
    under: str = field(default="AUTO", metadata={**UNSAID, **_on(Acts.WRITING)})
    grounds: tuple[GroundSettings, ...] = field(default=(), metadata=UNSAID)

    @property
    def soft_grounds(self) -> list[ObjectName]:
        """All soft grounds; none where one is to be made."""
        return [self.ground, *(further.ground for further in self.grounds)] if self.ground else []

    @property
    def of_each_ground(self) -> tuple[BakeSettings, ...]:
        """The settings as each ground has them: these, and after them with each of `grounds` as the first."""
        return self, *(self._with_first(number) for number in range(len(self.grounds)))

    def _with_first(self, number: int) -> BakeSettings:
        first, names = self.grounds[number], [each.name for each in fields(GroundSettings)]
        before = GroundSettings(**{name: getattr(self, name) for name in names})
        frame = self.frame
        if frame is not None and frame.moves:
            frame = replace(frame, matrix=rows(frame.riding[first.ground.name]))
        return replace(
            self,
            **{name: getattr(first, name) for name in names},
            grounds=(*self.grounds[:number], before, *self.grounds[number + 1 :]),
            relief_look=first.surface if self.relief_look else "",
            frame=frame,
        )

    @property
    def spacing_m(self) -> float:
        """Distance of the vertices along the trail [m]: that of the cells, or less where pictures come close."""
        return self.fineness.spacing

    @property
    def kinds(self) -> tuple[tuple[GroundKind, ...], dict[int, float]]:
        """Kinds of ground, and the number of that of each slot which names one; see `regions.numbered`."""
        return numbered(GroundKind(self.surface, self.material), {each.slot: each.kind for each in self.regions})

    @property
    def carves(self) -> bool:
        """True if bodies may carve the ground: their feet are let down into it, and both are shown."""
        return self.carve and self.output == "BOTH" and self.sinks

    @property
    def sinks(self) -> bool:
        """True if feet are let down into their prints."""
        return self.response is not None and self.response.grounding is not None

    @property
    def fineness(self) -> Fineness:
        """Fineness at which the ground is pressed and shown, from which follows what a bake takes."""
        return Fineness(self.cell_size_m, self.material.rim_reach, self.relief, self.relief_vertices)

    def between(self, first: Acts, last: Acts) -> dict[str, Any]:
        """The settings that act first on one of these stages."""
        return _part(self, first, last)

    def inputs(self, last: Acts = Acts.OUTPUT) -> dict[str, Any]:
        """The settings that act up to a stage, by names and numbers alone, as the report has them."""
        named: dict[str, Any] = _by_name(self.between(Acts.READING, last))
        return named


def _part(group: Any, first: Acts, last: Acts, inherited: Acts = Acts.READING) -> dict[str, Any]:
    """The fields of a dataclass that act on some stages, and those of what it holds."""
    values: dict[str, Any] = {}
    for setting in fields(group):
        if not setting.compare:
            continue
        value, acts = getattr(group, setting.name), setting.metadata.get("acts", inherited)
        if setting.metadata.get("said_if_on") and value == setting.default:
            continue
        if _is_group(value):
            value = _part(value, first, last, acts)
            is_in = bool(value)
        elif isinstance(value, tuple) and any(map(_is_group, value)):
            value = [_part(item, first, last, acts) for item in value]
            is_in = any(value)
        else:
            is_in = first <= acts <= last
        if is_in:
            values[setting.name] = value
    return values


def _is_group(value: Any) -> bool:
    return is_dataclass(value) and not isinstance(value, ObjectName)


def _by_name(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _by_name(part) for key, part in value.items()}
    if isinstance(value, tuple | list):
        return [_by_name(part) for part in value]
    return value.name if isinstance(value, ObjectName) else value
