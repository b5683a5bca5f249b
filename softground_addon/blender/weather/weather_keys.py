"""Keys on the sliders of weather, kept current in its group, where they are there at every frame without the add-on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.weather.weather import PARTS, Span, span_of
from .. import compat
from ..nodes import node_modifiers
from ..playback import weather_modifier, weather_table
from ..playback.weather_course_nodes import FIRST, KEYED, STEP, SUMMED, UNITS, field_of, keys_of, switch_of
from ..playback.weather_nodes import groups_within, within
from ..settings import typed

ON_PRINTS = {name: unit for name, unit in UNITS.items() if name != "Drying"}
"""The inputs of which prints are others, and their units."""
LAST = "softground_weather_last"
"""Custom property of the group: the frame up to which it tells moments apart, keys or none."""


def follow(display_mesh: bpy.types.Object) -> None:
    """Have the weather of an object, if any, keep to its keys; nothing is touched where it does.

    Where a copy of the object has the same group, the object gets its own.
    """
    modifier: Any = weather_modifier.modifier_of(display_mesh)
    tree: Any = modifier.node_group if modifier else None
    if tree is None or tree.library or LAST not in tree.keys():  # noqa: SIM118  (an ID is no mapping)
        return
    keyed = _keyed(modifier)
    inners = groups_within(tree)
    first = inners[0].nodes[FIRST].outputs[0].default_value
    span = span_of(first, max([tree[LAST], *(curve.range()[1] for curve in keyed.values())]))
    means = {name: _means(curve, span) for name, curve in keyed.items()}
    changes = [change for inner in inners for change in _keyed_as(inner.nodes, means, span)]
    if changes and weather_modifier.separate(modifier):
        follow(display_mesh)
        return
    for change in changes:
        change()
    changed = bool(changes)
    if not keyed:
        last = max([span.last, *(scene.frame_end for scene in display_mesh.users_scene)])
        values = values_of(modifier)
        followed = [weather_table.follow(inner, values, last - first) for inner in inners]
        changed |= any(followed)
    for inner in inners if changed else ():
        inner.update_tag()


def moments_of(display_mesh: bpy.types.Object) -> Span:
    """The span of which the weather of an object tells the moments apart, keys or none."""
    modifier: Any = weather_modifier.modifier_of(display_mesh)
    tree = modifier.node_group
    return span_of(within(tree).nodes[FIRST].outputs[0].default_value, tree[LAST])


def values_of(modifier: Any) -> dict[str, float]:
    """What the sliders are at, by name."""
    values = dict(compat.node_inputs(modifier))
    return {name: values[key] for name, key in weather_modifier.inputs_of(modifier).items() if key in values}


def rates(modifier: Any, span: Span) -> dict[str, Any]:
    """What acts on prints, as `core.weather.weather_course.Weather` has it: numbers, or means of each part if keyed."""
    keyed, values, means_by_field = _keyed(modifier), values_of(modifier), {}
    for name, unit in ON_PRINTS.items():
        means = _means(keyed[name], span) if name in keyed else np.float64(typed(values[name]))
        means_by_field[field_of(name)] = (means.astype(np.float64) * unit).tolist()
    return {name: tuple(value) if isinstance(value, list) else value for name, value in means_by_field.items()}


@dataclass(frozen=True)
class WeatherBefore:
    """Weather of a ground before a bake, by which it goes over to another mesh.

    Attributes
    ----------
    values : mapping
        What the sliders were at, by name.
    modifier, action, slot : str
        Names of the modifier and of the action that keyed it, and the identifier of its slot; empty without one.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    modifier: str = ""
    action: str = ""
    slot: str = ""


def before(modifier: Any) -> WeatherBefore:
    """The weather of a modifier, to be kept where the modifier is not."""
    animation = modifier.id_data.animation_data
    action = animation.action.name if animation and animation.action else ""
    slot = getattr(compat.slot_of(animation), "identifier", "") if animation else ""
    return WeatherBefore(values_of(modifier), modifier.name, action, slot)


def take_over(modifier: Any, known: WeatherBefore) -> None:
    """Key a modifier as the weather before it was keyed: by the action that its object plays, or else by a copy."""
    owner = modifier.id_data
    modifier.name = known.modifier
    keyed: Any = bpy.data.actions.get(known.action)
    paths = {compat.input_path(modifier, key) for key in weather_modifier.inputs_of(modifier).values()}
    slot = _slot_named(keyed, known.slot)
    if keyed and not _plays(owner) and paths & {curve.data_path for curve in compat.action_curves(keyed, slot)}:
        animation = owner.animation_data or owner.animation_data_create()
        animation.action = action = keyed.copy()
        slot = _slot_named(action, known.slot)
        compat.set_slot(animation, slot)
        channels = compat.channels_of(action, slot)
        for curve in [curve for curve in channels if curve.data_path not in paths]:
            channels.remove(curve)
    follow(owner)


def _plays(owner: bpy.types.Object) -> bool:
    return owner.animation_data is not None and owner.animation_data.action is not None


def _slot_named(action: Any, identifier: str) -> Any:
    """The slot of an action with an identifier; None where there is none."""
    return next((slot for slot in getattr(action, "slots", ()) if slot.identifier == identifier), None)


def is_keyed(modifier: Any, *names: str) -> bool:
    """True if the keys of some inputs count."""
    return not _keyed(modifier).keys().isdisjoint(names)


def _keyed(modifier: Any) -> Mapping[str, bpy.types.FCurve]:
    """The curves of those inputs that are keyed and summed up, by name."""
    return {name: curve for name, curve in node_modifiers.curves_of(modifier).items() if name in SUMMED}


def _means(curve: bpy.types.FCurve, span: Span) -> NDArray[np.float32]:
    """What a curve is at in the mean of each part, and at the end."""
    frames = span.first + np.arange(round(PARTS * span.step)) + 0.5
    values = np.array([curve.evaluate(frame) for frame in frames])
    return np.append(values.reshape(PARTS, -1).mean(axis=1), curve.evaluate(span.last)).astype(np.float32)


def _keyed_as(nodes: Any, means: Mapping[str, NDArray[np.float32]], span: Span) -> Iterator[Callable[[], None]]:
    """What lets the nodes of a group have these keys and this span, as far as they have others."""
    yield from _set(nodes[STEP].outputs[0], span.step)
    yield from _set(nodes[KEYED].outputs[0], len(means))
    for name in SUMMED:
        yield from _set(nodes[switch_of(name)].inputs["Switch"], name in means)
        if name in means:
            yield from _drawn(nodes[keys_of(name)].mapping, means[name])


def _set(socket: Any, value: float | bool) -> Iterator[Callable[[], None]]:
    """What sets a socket, unless it has the value."""
    if socket.default_value != value:
        yield partial(setattr, socket, "default_value", value)


def _drawn(mapping: Any, values: NDArray[np.float32]) -> Iterator[Callable[[], None]]:
    """What lets a curve have these values at even steps from 0 to 1, unless it has them."""
    points = mapping.curves[0].points
    if len(points) != len(values) or not np.array_equal([point.location[1] for point in points], values):
        yield partial(_draw, mapping, values)


def _draw(mapping: Any, values: NDArray[np.float32]) -> None:
    points = mapping.curves[0].points
    while len(points) < len(values):
        points.new(1.0, 0.0)
    for number, (point, value) in enumerate(zip(points, values.tolist(), strict=True)):
        point.location, point.handle_type = (number / PARTS, value), "VECTOR"
    mapping.update()
