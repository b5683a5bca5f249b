"""Weather by what it comes to: how long the shot lasts in its time, and how deep new snow lies at the end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ...core.weather import weather, weather_course
from .. import compat, settings
from ..ground import baked_ground
from ..playback import weather_course_nodes, weather_modifier, weather_nodes
from . import weather_keys

NIGHT = 8.0
"""How long a shot lasts at first [h]: any slider shows at once what it does."""
MOST_SNOW, ROUNDS = 100.0, 40
"""Most snowfall [cm/h], and how often the range in which it is sought is halved."""


def modifier_of(ground: bpy.types.Object | None) -> Any:
    """The weather on a scene's ground; None where there is none."""
    modifier: Any = weather_modifier.modifier_of(baked_ground.display_mesh_of(ground)) if ground else None
    return modifier if modifier and modifier.node_group and weather_nodes.within(modifier.node_group) else None


def hours(options: Any) -> float:
    """Length of the scene in the time of its weather, whose scale is not keyed [h]."""
    modifier = modifier_of(options.ground)
    if not modifier:
        return 0.0
    return weather_keys.values_of(modifier)["Time Scale"] * _seconds(*_span(options, modifier)) / weather.HOUR


def set_hours(options: Any, wanted: float) -> None:
    """Have the scene last so long [h]; as much snow lies at its end as before."""
    if modifier := modifier_of(options.ground):
        depth = snow_cm(options)
        _write(modifier, "Time Scale", wanted * weather.HOUR / _seconds(*_span(options, modifier)))
        set_snow_cm(options, depth)


def snow_cm(options: Any) -> float:
    """Depth of the new snow on open ground at the end of the scene [cm]."""
    modifier = modifier_of(options.ground)
    return _cover_cm(modifier, options.material.surface, *_span(options, modifier))() if modifier else 0.0


def set_snow_cm(options: Any, wanted: float) -> None:
    """Let so much snow fall that it lies that deep at the end [cm], or the most that can fall."""
    if modifier := modifier_of(options.ground):
        cover = _cover_cm(modifier, options.material.surface, *_span(options, modifier))
        least, most = 0.0, MOST_SNOW if wanted > 0 else 0.0
        for _ in range(ROUNDS if most else 0):
            middle = (least + most) / 2
            least, most = (least, middle) if cover(middle) > wanted else (middle, most)
        _write(modifier, "Snowfall", most)


def _cover_cm(modifier: Any, surface: str, span: weather.Span, end: float) -> Callable[..., float]:
    """Depth of new snow at the end [cm] as a function of the snowfall [cm/h], by default that of the slider."""
    rates, matter = weather_keys.rates(modifier, span), weather.matter_of(surface, 0.0, 1.0)

    def cover(snowfall: float | None = None) -> float:
        falls = rates["snowfall"] if snowfall is None else snowfall * 0.01 / weather.HOUR
        course = weather_course.course_of(
            weather_course.Weather(**rates | {"snowfall": falls}), matter, frame=end, span=span
        )
        return 100.0 * float(course.cover[0])

    return cover


def _span(options: Any, modifier: Any) -> tuple[weather.Span, float]:
    """The span of the weather, and the last frame of the scene, both in the time that playback counts."""
    tree, timeline = modifier.node_group, settings.timeline_of(options.id_data)
    first = weather_nodes.within(tree).nodes[weather_course_nodes.FIRST].outputs[0].default_value
    end = float(max(timeline.end * timeline.stretch, first + 1.0))
    return weather.span_of(first, max(end, tree[weather_keys.LAST]), timeline.frame_rate * timeline.stretch), end


def _seconds(span: weather.Span, end: float) -> float:
    return (end - span.first) / span.frame_rate


def _write(modifier: Any, name: str, value: float) -> None:
    compat.write_input(modifier, weather_modifier.inputs_of(modifier)[name], value)
    modifier.id_data.update_tag()
