"""Regions of a baked ground that take weather each in its own way, and which of them is where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.ground import surfaces
from ...core.ground.presets import validate_material
from ...core.ground.regions import HARD
from ...core.ground.terrain import MeshTerrain
from ...core.numerics.arrays import Array, Indices
from ...core.record.footprints import Footprint
from ...core.settings import RegionSettings
from ...core.weather.weather import HARD_FLOOR, Matter, matter_of
from ...core.weather.weather_places import section_of
from .. import ground_slots, mesh_arrays
from ..ground import baked_ground, ground_surface


@dataclass(frozen=True)
class WeatherRegions:
    """Kinds of a ground, and its regions, which are of one or more of those kinds that weather acts on alike.

    Attributes
    ----------
    numbers : mapping of int to float
        Of the kind of each material slot that names a preset; `core.ground.regions.HARD` of a hard floor.
    matters : (N,) tuple of Matter
        What each kind is to weather; the last is a hard floor.
    pressable : (N,) float array
        How far the loose layer of each can be pressed [m].
    """

    numbers: Mapping[int, float]
    matters: tuple[Matter, ...]
    pressable: Array

    def of_vertices(self, mesh: bpy.types.Mesh) -> Indices:
        """Number of the kind that most faces around each vertex of a display mesh are of, (V,)."""
        count, names = len(mesh.vertices), len(self.matters)
        if not self.numbers:
            return np.zeros(count, np.intp)
        of_faces = ground_surface.numbers_of(ground_slots.of_faces(mesh), self.numbers).astype(np.intp) % names
        vertex, kind = mesh_arrays.of_corners(mesh, of_faces)
        faces = np.bincount(vertex * names + kind, minlength=count * names).reshape(count, names)
        return np.asarray(faces.argmax(axis=1))

    def at(self, display_mesh: bpy.types.Object, about: Mapping[str, Any], position: Array) -> Indices:
        """Number of the kind at undisturbed positions (K, 3) on a display mesh [m], (K,)."""
        kinds = np.zeros(len(position), np.intp)
        if not self.numbers or not len(position):
            return kinds
        inputs = about["inputs"]
        unit_scale, frame = baked_ground.unit_of(inputs, "unit_scale_m"), baked_ground.frame_in(inputs)
        surface = ground_surface.undisturbed_surface(display_mesh, unit_scale, regions=self.numbers, frame=frame)
        if surface.kinds is None:
            return kinds
        terrain = MeshTerrain.from_mesh(surface.surface_vertices, surface.triangles, of_faces=surface.kinds)
        number = terrain.interpolated(*position[:, :2].T)[-1]
        return np.where(np.isnan(number), 0.0, number).astype(np.intp) % len(self.matters)

    def regions(self, mesh: bpy.types.Mesh) -> tuple[list[Matter], Indices]:
        """What the regions of a display mesh are to weather, and the number of the region of each kind, (N,).

        Kinds that are not there count to the first region.
        """
        present = np.unique(self.of_vertices(mesh)).tolist()
        matters = list(dict.fromkeys(self.matters[kind] for kind in present or [0]))
        return matters, np.array([matters.index(each) if each in matters else 0 for each in self.matters])

    @property
    def hard(self) -> int:
        """Number of the kind that is a hard floor."""
        return len(self.matters) - 1


def regions_of(footprints: Sequence[Footprint], about: Mapping[str, Any]) -> WeatherRegions:
    """The regions of a ground by its footprints and what the record says about them.

    Raises
    ------
    KeyError, TypeError, ValueError, OverflowError, InputError
        If that is damaged.
    """
    inputs = about["inputs"]
    baked_with = {name: baked_ground.baked_with(about, name) for name in ("layer_depth", "densest")}
    kinds, numbers = [(str(inputs["surface"]), baked_with["layer_depth"], baked_with["densest"])], {}
    for region in regions_in(inputs):
        numbers[region.slot] = float(len(kinds)) if region.material else HARD
        if region.material:
            kinds.append((region.surface, region.material.layer_depth, region.material.densest))
    sections = {surface: _section(footprints, surface) for surface, *_ in kinds}
    matters = [matter_of(surface, depth, sections[surface]) for surface, depth, _ in kinds]
    pressable = [depth * (densest or 1.0) for _, depth, densest in kinds]
    return WeatherRegions(numbers, (*matters, HARD_FLOOR), np.array([*pressable, 1.0]))


def regions_in(inputs: Mapping[str, Any]) -> tuple[RegionSettings, ...]:
    """Slots of a ground that named a preset as it was baked, by the inputs that its record has.

    Raises
    ------
    KeyError, TypeError, ValueError, OverflowError, InputError
        If they are damaged.
    """
    return tuple(map(_region, inputs.get("regions", ())))


def _region(said: Mapping[str, Any]) -> RegionSettings:
    material = validate_material(said["material"], "record") if said["material"] else None
    if material:
        surfaces.find(said["surface"])
    return RegionSettings(int(said["slot"]), str(said["preset"]), str(said["surface"]), material)


def _section(footprints: Sequence[Footprint], surface: str) -> float:
    """Mean volume of the prints that a surface bears most of, over their width; of all where it bears none [m²]."""
    return section_of([each for each in footprints if each.surface == surface] or footprints)
