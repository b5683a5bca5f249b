"""Weather over a bake: put on the ground that carries it, made to fit the record, set from presets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.numerics.arrays import Array, Indices
from ...core.numerics.slices import Slices, result_of, sliced
from ...core.playback.keyframe_tables import NO_CONTACT
from ...core.record.footprints import Footprint
from ...core.record.record import BakeRecord
from ...core.settings import BakeSettings
from ...core.weather.felt_weather import felt_in
from ...core.weather.weather import Matter, Span, moment_of, span_of
from ...core.weather.weather_places import NOT_YET, POWERS, WeatherPlaces, soaking_shares, weather_places
from .. import compat, jobs, settings
from ..carried import marks_object
from ..ground import baked_ground, ground_mesh, ground_surface
from ..plants import trampling_table, wind_nodes
from ..playback import own_data, weather_inputs, weather_modifier, weather_table
from ..playback import playback_nodes as played
from ..playback import weather_nodes as nodes
from ..playback.weather_course_nodes import HOLLOWS
from ..playback.weather_inputs import PRESETS
from . import weather_keys
from .weather_keys import WeatherBefore
from .weather_regions import WeatherRegions, regions_of

READING = jobs.Progress("sample", 0.5)


def add(ground: bpy.types.Object, record: BakeRecord | None = None) -> Any:
    """Put weather on a ground with a bake, or renew what there is, at once; the modifier. See `adding`."""
    return jobs.run(adding(ground, record))


def adding(ground: bpy.types.Object, record: BakeRecord | None = None, preset: str = "") -> jobs.Job[Any]:
    """Put weather on a ground with a bake, or renew what there is, in the last step; the modifier.

    Parameters
    ----------
    record : BakeRecord, optional
        Record of the bake, if it is at hand; otherwise read from the ground.
    preset : str, optional
        One of `PRESETS` to set it to.

    Raises
    ------
    InputError
        If there is no bake, or its record does not say what is needed.
    """
    name = settings.name_of(ground)
    _check_names(baked_ground.display_mesh_of(ground))
    footprints, about = (record.shaping, record.about) if record else baked_ground.load(ground)
    places = yield from _places(ground, footprints, about)
    ground = settings.resolve(name)
    display_mesh = baked_ground.display_mesh_of(ground)
    existing: Any = weather_modifier.modifier_of(display_mesh)
    if existing:
        weather_modifier.separate(existing)
    tree = existing.node_group if existing else weather_inputs.new()
    fit = _fit.slices(ground, display_mesh, tree, footprints, about, places)
    try:
        if existing:  # which would not be whole between two slices
            result_of(fit)
        else:
            yield from jobs.meanwhile(jobs.Progress("write", 0.5), fit)
    except BaseException:
        weather_modifier.remove_unused()
        raise
    display_mesh = baked_ground.display_mesh_of(settings.resolve(name))
    modifier = existing or weather_modifier.put(display_mesh, tree)
    weather_keys.follow(display_mesh)
    lead(settings.resolve(name))
    if preset:
        set_preset(modifier, preset)
    return modifier


def remove(ground: bpy.types.Object) -> None:
    """Take the weather off a ground; the bake stays as it is."""
    weather_modifier.remove(baked_ground.display_mesh_of(ground))
    lead(ground)


def follow(ground: bpy.types.Object) -> None:
    """Have the weather of a ground follow its keys, and plants and marks none where the user has removed it."""
    display_mesh = baked_ground.display_mesh_of(ground)
    weather_keys.follow(display_mesh)
    if weather_modifier.modifier_of(display_mesh) is None:
        lead(ground)


def lead(ground: bpy.types.Object) -> None:
    """Have plants and marks of a ground follow its weather, or none."""
    shown = baked_ground.display_mesh_of(ground)
    table = trampling_table.of(ground)
    if table and not table.library:
        wind_nodes.follow(table, shown)
    marks_object.follow_weather(ground, shown)


def values_of(ground: bpy.types.Object) -> dict[str, float]:
    """Slider values of a ground's weather; empty if it has none."""
    modifier: Any = weather_modifier.modifier_of(baked_ground.display_mesh_of(ground))
    return {} if modifier is None else weather_keys.values_of(modifier)


def before(ground: bpy.types.Object) -> WeatherBefore:
    """A ground's weather, for `renew`; without values if it has none."""
    modifier = weather_modifier.modifier_of(baked_ground.display_mesh_of(ground))
    return WeatherBefore() if modifier is None else weather_keys.before(modifier)


def renew(ground: bpy.types.Object, known: WeatherBefore, record: BakeRecord) -> None:
    """Fit weather to the record of a new bake, with the values and keys that the ground had before it, if any."""
    existing = weather_modifier.modifier_of(baked_ground.display_mesh_of(ground))
    if existing is None and not known.values:
        return
    modifier = add(ground, record)
    if existing is None:
        _set(modifier, known.values)
        weather_keys.take_over(modifier, known)


def set_preset(modifier: Any, preset: str) -> None:
    """Set all inputs of a weather modifier as one of `PRESETS` has them."""
    _set(modifier, {**{name: value for name, value, *_ in weather_inputs.INPUTS}, **PRESETS[preset][1]})


def _set(modifier: Any, values: Mapping[str, float]) -> None:
    for name, identifier in weather_modifier.inputs_of(modifier).items():
        if name in values:
            compat.write_input(modifier, identifier, float(values[name]))
    modifier.id_data.update_tag()


def _check_names(display_mesh: bpy.types.Object) -> None:
    mesh = ground_mesh.mesh_of(display_mesh)
    taken = [name for name in nodes.OF_WEATHER if name in mesh.attributes and name not in own_data.made(mesh)]
    if taken:
        raise InputError(
            f"'{display_mesh.name}' has an attribute '{taken[0]}' of your own: rename it, as weather needs that name."
        )


def felt(wanted: BakeSettings) -> BakeSettings:
    """Settings with the weather that is on each of their grounds, where steps feel it."""
    further = [
        replace(ground, weather=_felt(of_ground).weather)
        for ground, of_ground in zip(wanted.grounds, wanted.of_each_ground[1:], strict=True)
    ]
    return replace(_felt(wanted), grounds=tuple(further))


def _felt(wanted: BakeSettings) -> BakeSettings:
    ground = settings.find(wanted.ground) if wanted.weather and wanted.ground else None
    modifier: Any = weather_modifier.modifier_of(baked_ground.display_mesh_of(ground)) if ground else None
    if wanted.weather is None or modifier is None or modifier.node_group is None:
        return wanted
    first, last = (frame * wanted.time_stretch for frame in wanted.frames)
    return replace(wanted, weather=replace(wanted.weather, **weather_keys.rates(modifier, span_of(first, last))))


@sliced
def _fit(
    ground: bpy.types.Object,
    display_mesh: bpy.types.Object,
    tree: Any,
    footprints: list[Footprint],
    about: Mapping[str, Any],
    read: tuple[WeatherPlaces, WeatherRegions, Indices],
) -> Slices[None]:
    """Fill the group, and write what it reads in the last slice."""
    with damage_named(ground):
        inputs = about["inputs"]
        known, units = of_bake(footprints, about)[0], baked_ground.units_of(inputs)
        first, last = (frame * units.time_stretch for frame in baked_ground.frames_of(inputs))
        rate = units.frame_rate * units.time_stretch
    up = ground_surface.up_of(display_mesh, units.unit_scale_m, units.frame)
    places, of_ground, kinds = read
    since = places.times[:, 1]
    span = span_of(first, max(last, float(since.max(initial=last, where=since < NOT_YET))), rate)
    mesh = ground_mesh.mesh_of(display_mesh)
    matters, region_of = of_ground.regions(mesh)
    regions = region_of[kinds]
    values, hollows = _of_vertices(places, matters, regions, span)
    again, has_water = nodes.AGAIN in values, nodes.WATER in mesh.attributes
    parts = [(matter, soaking_shares(places, regions == number)) for number, matter in enumerate(matters)]
    given = {"up": up.tolist(), "span": span, "felt": known["felt"], "again": again, "has_water": has_water}
    yield from nodes.build.slices(tree, parts, **given)
    _store(mesh, values)
    for table in hollows_of(tree):
        weather_table.fill(table, hollows)
    tree[weather_keys.LAST] = span.last


@contextmanager
def damage_named(ground: bpy.types.Object) -> Iterator[None]:
    """InputError in place of what the damaged inputs of a bake raise where they are read."""
    try:
        yield
    except (KeyError, TypeError, ValueError, IndexError, OverflowError):
        raise InputError(f"The bake on '{ground.name}' does not say how it was made: bake again.") from None


def of_bake(footprints: Sequence[Footprint], about: Mapping[str, Any]) -> tuple[dict[str, Any], WeatherRegions]:
    """Input of `weather_places` from a bake but for the depth of its layers, and the regions of its ground.

    By its footprints and what its record says about it; raises what `units_of` and `baked_with` of `baked_ground` do
    for damage.
    """
    inputs, regions = about["inputs"], regions_of(footprints, about)
    known = {
        "cell_size": baked_ground.unit_of(inputs, "cell_size_m"),
        "time_stretch": baked_ground.units_of(inputs).time_stretch,
        "felt": felt_in(inputs) is not None,
        "puddles": any(matter.soaking for matter in regions.matters),
        "blur_sigma": baked_ground.baked_with(about, "blur_sigma"),
    }
    return known, regions


def _places(
    ground: bpy.types.Object, footprints: list[Footprint], about: Mapping[str, Any]
) -> jobs.Job[tuple[WeatherPlaces, WeatherRegions, Indices]]:
    """Places of the vertices, for weather; the regions of the ground, and the number of the kind of each vertex."""
    display_mesh = baked_ground.display_mesh_of(ground)
    with damage_named(ground):
        known, regions = of_bake(footprints, about)
        unit_scale = baked_ground.unit_of(about["inputs"], "unit_scale_m")
    name, frame = settings.name_of(display_mesh), baked_ground.frame_in(about["inputs"])
    reading = ground_surface.undisturbed_surface.slices(display_mesh, unit_scale, frame=frame)
    del display_mesh
    position = (yield from jobs.meanwhile(READING, reading)).vertices
    display_mesh = settings.resolve(name)
    mesh, up = ground_mesh.mesh_of(display_mesh), ground_surface.up_of(display_mesh, unit_scale, frame)
    rest = ground_mesh.rest_positions(mesh).astype(np.float64)
    relief = (ground_mesh.displayed_positions(display_mesh) - rest) @ up / (up @ up)
    start, end, last = (_values(mesh, name) for name in (played.START, played.END, played.LAST_CONTACT))
    last[last >= NO_CONTACT] = -NO_CONTACT
    start[start <= -NO_CONTACT] = NO_CONTACT
    kinds = regions.of_vertices(mesh)
    del mesh, display_mesh
    depth = regions.pressable[kinds]
    working = weather_places.slices(
        footprints, position, relief, start, np.maximum(end, last), layer_depth=depth, **known
    )
    places = yield from jobs.meanwhile(READING, working)
    yield READING
    return places.without_prints(kinds == regions.hard), regions, kinds


def hollows_of(tree: Any) -> list[bpy.types.Object]:
    """The tables of the hollows that a group of weather fills, one for each region in which water stands."""
    tables = [weather_table.named(inner, HOLLOWS) for inner in nodes.groups_within(tree)]
    return [table for table in tables if table]


def store(
    mesh: bpy.types.Mesh, places: WeatherPlaces, matters: Sequence[Matter], regions: Indices, span: Span
) -> dict[str, NDArray[np.float64]]:
    """Give a mesh what the node group reads, of its vertices (V,) in regions; nothing that it does not ask for.

    Returns
    -------
    dict of arrays
        The table of the hollows in which its vertices lie; see `weather_course_nodes.HOLLOWS`.
    """
    values, hollows = _of_vertices(places, matters, regions, span)
    _store(mesh, values)
    return hollows


def _of_vertices(
    places: WeatherPlaces, matters: Sequence[Matter], regions: Indices, span: Span
) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[np.float64]]]:
    """Attributes that the node group reads, by their names, and the table of the hollows; see `store`."""
    pressed, since, compacted = places.times.T
    capacity, above, remaining = places.pool.T
    rise, filled = places.levels[:, :POWERS], 1 + moment_of(places.levels[:, POWERS], span)
    each, of_wet = np.unique(
        np.column_stack([capacity, remaining, filled, rise])[capacity > 0], axis=0, return_inverse=True
    )
    hollow = np.zeros(len(capacity), dtype=np.intp)
    hollow[capacity > 0] = 1 + of_wet.ravel()
    values: dict[str, NDArray[Any]] = {
        nodes.BLUR: places.blur,
        nodes.TRODDEN: places.trodden,
        nodes.PRESSED: pressed,
        nodes.MOMENT: np.where(since < NOT_YET, 1 + moment_of(since, span), 0),
    }
    if len(matters) > 1:
        values[nodes.REGION] = regions
    if any(matter.snow_depth for matter in matters):
        values[nodes.COMPACTED] = compacted
    if any(matter.soaking for matter in matters):
        values[nodes.HOLLOW], values[nodes.ABOVE] = hollow, above
    if (again := places.again[:, 1] < NOT_YET).any():
        values[nodes.AGAIN] = places.again[:, 0]
        values[nodes.BEFORE] = np.where(again, 1 + moment_of(places.again[:, 1], span), 0)
        values[nodes.BLUR_BEFORE] = places.blur_before
    pool, rise = np.split(np.vstack([np.zeros(6), each]), 2, axis=1)
    return values, {"pool": pool, "rise": rise}


def _store(mesh: bpy.types.Mesh, values: Mapping[str, NDArray[Any]]) -> None:
    own_data.remove(mesh, set(nodes.OF_WEATHER) - set(values))
    for name, of_vertices in values.items():
        kind = nodes.OF_WEATHER[name]
        stored = of_vertices.astype(np.int32 if kind == "INT" else np.float32)
        field = "vector" if kind == "FLOAT_VECTOR" else "value"
        own_data.attribute(mesh, name, kind).data.foreach_set(field, stored.ravel())
    mesh.update()


def _values(mesh: bpy.types.Mesh, name: str) -> Array:
    attribute: Any = mesh.attributes.get(name)
    if attribute is None:
        raise InputError("The bake has lost its playback modifier: bake again.")
    values = np.empty(len(attribute.data), dtype=np.float32)
    attribute.data.foreach_get("value", values)
    return values.astype(np.float64)
