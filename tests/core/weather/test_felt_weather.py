"""Weather that a record says its steps felt is what a bake can have felt, or damage."""

import json
from dataclasses import asdict

import pytest

from softground_addon.core.weather.felt_weather import FeltWeather, felt_in

KEYED = FeltWeather(snowfall=(1e-6,) * 257, temperature=-5.0, surface="snow", last=257.0)


def test_weather_comes_back_from_the_text_of_a_record():
    assert felt_in(json.loads(json.dumps({"weather": asdict(KEYED)}))) == KEYED
    assert felt_in({"weather": None}) is felt_in({}) is None


@pytest.mark.parametrize("weather", [True, [1], "x", 1.0, {"hail": 1.0}])
def test_weather_that_is_none_is_damage(weather):
    with pytest.raises((TypeError, ValueError)):
        felt_in({"weather": weather})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("time_scale", value) for value in (float("nan"), float("inf"), 1e300, 10**400, "x", None, {}, [])),
        *(("snowfall", value) for value in ([1e-6] * 3, [float("nan")] * 257, [[1.0]] * 257, ["x"])),
        *(("frame_rate", value) for value in (0.0, -24.0)),
        *(("last", value) for value in (-1.0, 0.0, float("nan"))),
    ],
)
def test_weather_of_numbers_that_no_bake_has_is_damage(name, value):
    with pytest.raises((TypeError, ValueError, OverflowError)):
        felt_in({"weather": asdict(KEYED) | {name: value}})
