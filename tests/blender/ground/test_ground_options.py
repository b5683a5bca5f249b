"""The ground's options and what is painted on it, from the scene's settings to the baked mesh."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import ground_presets, jobs, settings
from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import painted_ground
from softground_addon.blender.properties import material, setting_paths
from softground_addon.blender.reading import analysis
from softground_addon.core.errors import InputError
from softground_addon.core.ground.material import MATERIAL_RANGES, GroundMaterial
from softground_addon.core.ground.presets import find
from tests.blender import shots
from tests.blender.grounds import bake, heights, plane, rest


@pytest.fixture
def walk(scene):
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    return scene


def paint(ground, name, values):
    attribute = ground.data.attributes.new(name, "FLOAT", "POINT")
    attribute.data.foreach_set("value", np.asarray(values, np.float32))


def place(ground):
    points = np.empty(len(ground.data.vertices) * 3, np.float32)
    ground.data.vertices.foreach_get("co", points)
    return points.reshape(-1, 3)


def depth(ground):
    return rest(ground)[:, 2] - heights(ground)[:, 2]


def test_every_field_of_the_material_is_a_setting_with_a_tooltip_and_off_beyond_the_paper(scene):
    known = scene.softground.material.bl_rna.properties
    for name, (low, high) in MATERIAL_RANGES.items():
        assert known[name].description
        assert (known[name].hard_min, known[name].hard_max) == pytest.approx((low, high))
    plain = GroundMaterial(1.0, 0.0, 1.0)
    assert all(
        getattr(settings.material_of(scene.softground.material), name) == 0
        for name in MATERIAL_RANGES
        if name != "poisson_ratio" and getattr(plain, name) == 0
    )


def test_a_preset_with_options_sets_them_and_the_next_one_takes_them_back(scene):
    ground_presets.apply_preset(scene.softground, find("loose_dry_sand"))
    assert scene.softground.material.repose_angle == pytest.approx(np.radians(32.0), abs=1e-4)
    assert settings.material_of(scene.softground.material) == find("loose_dry_sand").material
    ground_presets.apply_preset(scene.softground, find("snow"))
    assert settings.material_of(scene.softground.material) == find("snow").material


def test_options_are_assigned_by_their_path(scene):
    for path, text in (
        ("material.repose_angle", "0.5585"),
        ("material.hardening", "10"),
        ("pressure", "CENTRE_OF_PRESSURE"),
        ("painted.stiffness", "path"),
    ):
        setting_paths.assign(scene.softground, path, text)
    assert scene.softground.material.hardening == 10
    assert scene.softground.pressure == "CENTRE_OF_PRESSURE"
    assert scene.softground.painted.stiffness == "path"


@pytest.mark.slow
def test_sand_with_an_angle_of_repose_bakes_within_its_checks_and_leaves_no_steeper_wall(walk):
    ground_presets.apply_preset(walk.softground, find("loose_dry_sand"))
    walk.softground.ground = plane(walk, vertices=560, size=5.6)  # a vertex on every cell of 1 cm
    bake(walk)
    ground = walk.softground.ground
    assert depth(ground).max() > 0.01
    height = heights(ground)[:, 2].reshape(560, 560)
    steepest = max(abs(np.diff(height, axis=axis)).max() for axis in (0, 1)) / (5.6 / 559)
    assert steepest < 1.05 * np.tan(np.radians(32.0))


def test_rolling_pressure_changes_the_prints_and_all_options_bake_within_the_checks(walk):
    walk.softground.pressure = "UNIFORM"
    even = jobs.run(bake_job.bake(walk, write=False)).report
    walk.softground.pressure = "CENTRE_OF_PRESSURE"
    rolling = jobs.run(bake_job.bake(walk, write=False)).report
    assert rolling["totals"]["max_depth_m"] > 1.1 * even["totals"]["max_depth_m"]
    assert rolling["inputs"]["pressure"] == "CENTRE_OF_PRESSURE"
    material = walk.softground.material
    material.rim_bias, material.repose_angle, material.shortest_time = 0.8, 0.6, 0.02
    material.hardening, material.crust_stress, material.firm_depth = 10.0, 5e3, 0.02
    everything = jobs.run(bake_job.bake(walk, write=False)).report
    assert 0 < everything["totals"]["max_depth_m"] < rolling["totals"]["max_depth_m"]


@pytest.mark.slow
def test_each_side_of_a_painted_border_is_as_if_all_ground_were_like_it(walk):
    ground = walk.softground.ground = plane(walk, vertices=300)
    modulus = walk.softground.material.youngs_modulus
    alone = {}
    for factor in (1.0, 0.5):
        walk.softground.material.youngs_modulus = modulus * factor
        bake(walk)
        alone[factor] = depth(ground)
        bpy.ops.softground.clear_bake()
    walk.softground.material.youngs_modulus = modulus
    under = alone[1.0] > 0.5 * alone[1.0].max()
    across = np.ptp(place(ground)[under, :2], axis=0).argmin()  # the left and the right foot's prints
    y = place(ground)[:, across]
    between = (y[under].min() + y[under].max()) / 2
    paint(ground, "softground_stiffness", np.where(y > between, 0.5, 1.0))
    report = bake(walk).report
    after = depth(ground)
    assert "painted_crc32" in report["inputs"]
    for factor, side in ((0.5, y > between + 0.02), (1.0, y < between - 0.02)):
        pressed = side & (abs(alone[factor]) > 0)
        assert pressed.sum() > 100
        assert after[pressed] == pytest.approx(alone[factor][pressed], abs=1e-6)


def test_a_vertex_group_scales_its_members_only(walk):
    ground = walk.softground.ground = plane(walk)
    group = ground.vertex_groups.new(name="softground_layer_depth")
    group.add(list(range(len(ground.data.vertices))), 0.0, "REPLACE")
    bake(walk)
    assert not depth(ground).any()
    bpy.ops.softground.clear_bake()
    x = place(ground)[:, 0]
    y = place(ground)[:, 1]
    group.remove(np.flatnonzero((x > 0) | (y > 0)).tolist())
    factors = painted_ground.factors(
        ground, ground.data, painted_ground.names_of(ground, settings.snapshot(walk).painted)
    )
    assert (factors[:, 1] == ((x > 0) | (y > 0))).all()
    assert (factors[:, [0, 2]] == 1).all()
    bake(walk)
    assert depth(ground).max() > 0.01


def test_a_painted_rim_passes_the_check_of_volumes(walk):
    ground_presets.apply_preset(walk.softground, find("mud"))
    ground = walk.softground.ground = plane(walk)
    paint(ground, "softground_rim_factor", np.where(place(ground)[:, 0] > 0, 0.0, 3.0))
    totals = bake(walk).report["totals"]
    assert 0 <= totals["rim_m3"] <= totals["compressed_m3"]


@pytest.mark.slow
def test_paint_is_seen_through_modifiers(walk):
    ground = walk.softground.ground = plane(walk)
    paint(ground, "softground_layer_depth", np.zeros(len(ground.data.vertices)))
    ground.modifiers.new("Dense", "SUBSURF").levels = 1
    bake(walk)
    assert not depth(ground).any()


@pytest.mark.slow
def test_a_name_that_is_not_there_or_of_another_kind_is_refused_with_the_remedy(walk):
    ground = walk.softground.ground = plane(walk)
    walk.softground.painted.stiffness = "gone"
    with pytest.raises(InputError, match="no vertex group or attribute 'gone'"):
        bake(walk)
    ground.data.attributes.new("gone", "FLOAT_COLOR", "CORNER")
    with pytest.raises(InputError, match="not a float attribute on vertices"):
        bake(walk)
    walk.softground.painted.stiffness = ""
    bake(walk)


def test_a_depth_cannot_be_matched_on_ground_that_takes_no_print(walk):
    walk.softground.ground = plane(walk)
    paint(walk.softground.ground, "softground_layer_depth", np.zeros(len(walk.softground.ground.data.vertices)))
    with pytest.raises(InputError, match="takes none under the feet"):
        analysis.match_depth(walk, 0.05)


def test_a_ground_that_changes_over_time_is_told_of_with_the_remedy(walk):
    ground = plane(walk, vertices=60)
    walk.softground.frame_start = 3
    ground.modifiers.new("Swell", "WAVE").height = 0.01
    bpy.context.view_layer.update()
    (warning,) = bake(walk, ground=ground, output="PRINTS", detail="AUTO").report["warnings"]
    for part in ("'Field'", "'Swell'", "frame 3", "Apply that"):
        assert part in warning


def test_what_can_be_painted_is_offered_and_what_is_not_there_yet_is_told_apart(walk):
    bpy.ops.softground.create_ground()
    ground, painted = walk.softground.ground, walk.softground.painted
    ground.vertex_groups.new(name="trodden")
    ground.data.attributes.new("damp", "FLOAT", "POINT")
    ground.data.attributes.new("colour", "FLOAT_COLOR", "POINT")
    bpy.ops.softground.bake()  # its own attributes are none that one paints
    assert material._paintable(painted, bpy.context, "") == ["trodden", "damp"]
    assert not painted_ground.is_there(ground, painted.stiffness)
    ground.vertex_groups.new(name=painted.stiffness)
    assert painted_ground.is_there(ground, painted.stiffness)
    walk.softground.ground = None
    assert material._paintable(painted, bpy.context, "") == []


def test_hand_hardness_reads_the_snow_and_sets_stiffness_and_layer(scene):
    options = scene.softground
    for preset, hardness in (("powder", 1.12), ("settled_snow", 2.16), ("piste", 4.8)):
        ground_presets.apply_preset(scene.softground, find(preset))
        assert options.hand_hardness == pytest.approx(hardness, abs=0.02)
    rim = options.material.rim_reach
    options.hand_hardness = 2.16
    settled = find("settled_snow").material
    for field in ("youngs_modulus", "layer_depth", "densest", "exponent", "edge_width"):
        assert getattr(options.material, field) == pytest.approx(getattr(settled, field), rel=0.01)
    assert options.material.rim_reach == rim


def test_moisture_reads_the_sand_and_sets_how_firm_it_is(scene):
    options = scene.softground
    for preset, moisture in (("dune", 0.0), ("wet_beach", 0.3), ("firm_wet_sand", 0.6), ("soaked_sand", 1.0)):
        ground_presets.apply_preset(scene.softground, find(preset))
        assert options.moisture == pytest.approx(moisture, abs=0.03)
    options.moisture = 0.6
    assert options.material.youngs_modulus == pytest.approx(2040e3, rel=0.05)


def test_moisture_reads_soil_and_mud_and_sets_how_firm_they_are(scene):
    options = scene.softground
    for preset, moisture in (
        ("firm_loam", 0.0),
        ("soil", 0.25),
        ("stiff_mud", 0.5),
        ("soft_mud", 0.75),
        ("liquid_mud", 1),
    ):
        ground_presets.apply_preset(scene.softground, find(preset))
        assert options.soil_moisture == pytest.approx(moisture, abs=0.01)
    options.soil_moisture = 0.75
    assert options.material.youngs_modulus == pytest.approx(find("soft_mud").material.youngs_modulus, rel=0.02)
    assert options.material.poisson_ratio == find("liquid_mud").material.poisson_ratio


def test_packing_is_switched_by_a_box(scene):
    material = scene.softground.material
    assert not material.packs
    material.packs = True
    assert 0 < material.densest < 1
    material.packs = False
    assert material.densest == 0
