"""Hard objects that soles stand on: those of the settings, and those that a shot shows under its feet."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress

import numpy as np

from ...core.errors import InputError
from ...core.findings import Finding, listed
from ...core.ground.hard_ground import HardOnSoft, SeveralGrounds
from ...core.ground.heightfield import Terrain
from ...core.ground.terrain import MeshTerrain
from ...core.loads.raised_rests import RaisedRest, carried_by, raised_rests, reach_of
from ...core.motion.motion import CharacterMotion
from ...core.numerics.arrays import Array
from ...core.numerics.slices import Slices, sliced
from ...core.settings import BakeSettings, ObjectName
from .. import settings
from ..ground import ground_checks, ground_surface, trail_detail
from ..ground.baked_ground import display_mesh_of
from ..placement import matrix_in
from . import staleness


@sliced
def with_hard_objects(
    wanted: BakeSettings,
    motions: Sequence[CharacterMotion],
    grounds: Sequence[Terrain],
    bounds: Array,
    hard_parts: Sequence[MeshTerrain] = (),
) -> Slices[tuple[Terrain, list[HardOnSoft], list[Finding]]]:
    """Soft grounds with the hard objects that soles stand on.

    Parameters
    ----------
    bounds : (2, 2) float array
        Lower and upper corner of what is looked at [m].
    hard_parts : sequence of MeshTerrain
        What of the grounds themselves is hard.

    Returns
    -------
    terrain : Terrain
        All of it.
    apart : list of HardOnSoft
        Each of several grounds, on which all others stand like hard objects; none of a single one.
    findings : list of Finding
        Objects that are not in the settings.
    """
    reach = reach_of(motions)
    meshes = tuple(ground for ground in grounds if isinstance(ground, MeshTerrain))
    ground = SeveralGrounds(meshes, reach) if len(grounds) > 1 else grounds[0]
    listed_tops = yield from _tops(wanted.hard_grounds, wanted, bounds)
    hard, wet = [*hard_parts, *(top for _, top in listed_tops)], dict[str, MeshTerrain]()
    liquids = dict(zip(wanted.hard_grounds, wanted.wet_grounds, strict=False))
    for liquid in sorted({*wanted.wet_grounds} - {""}):
        pools = [top for name, top in listed_tops if liquids[name] == liquid]
        wet |= {liquid: (yield from MeshTerrain.joined.slices(pools))} if pools else {}
    terrain = HardOnSoft(ground, (yield from MeshTerrain.joined.slices(hard)), reach, wet) if hard else ground
    raised = [rest for motion in motions for rest in raised_rests(motion, terrain)]
    yield
    shown = yield from _tops(_still_meshes(wanted, raised) if raised else (), wanted, bounds)
    carried = [(name, top, rests) for name, top in shown if (rests := carried_by(top.heights, raised, terrain))]
    if carried:
        hard += [top for _, top, _ in carried]
        terrain = HardOnSoft(ground, (yield from MeshTerrain.joined.slices(hard)), reach, wet)
    apart = (yield from ground.apart.slices(ground, hard)) if isinstance(ground, SeveralGrounds) else []
    return terrain, apart, [_finding(name.name, rests) for name, _, rests in carried]


def _tops(
    names: Iterable[ObjectName], wanted: BakeSettings, bounds: Array
) -> Slices[list[tuple[ObjectName, MeshTerrain]]]:
    """The upper sides of objects within bounds in the plane, of those that have any."""
    tops = []
    for name in names:
        surface = ground_surface.undisturbed_surface(settings.resolve(name), wanted.unit_scale_m, frame=wanted.frame)
        yield
        with suppress(InputError):  # nobody walks there
            tops.append((name, (yield from ground_surface.terrain_of.slices(surface, bounds))))
    return tops


def _still_meshes(wanted: BakeSettings, raised: Sequence[RaisedRest]) -> list[ObjectName]:
    """The meshes that a scene shows where soles rest, and that do not move."""
    scene = settings.scene_named(wanted.scene)
    places = np.array([rest.place for rest in raised]) / wanted.unit_scale_m
    margin = max(rest.near for rest in raised) / wanted.unit_scale_m
    grounds = [settings.resolve(name) for name in wanted.soft_grounds]
    known = {settings.resolve(name) for name in wanted.hard_grounds} | set(staleness.bodies_of(scene.objects, wanted))
    known |= {*grounds, *map(display_mesh_of, grounds)}
    still = dict[ObjectName, None]()
    for obj in scene.objects:
        if obj.type != "MESH" or obj in known or obj.hide_render or obj.display_type in ("WIRE", "BOUNDS"):
            continue
        if not obj.visible_get(view_layer=scene.view_layers[0]):
            continue
        world = matrix_in(wanted.frame, obj) if wanted.frame else np.array(obj.matrix_world)
        box = np.array(obj.bound_box) @ world[:3, :3].T + world[:3, 3]
        inside = (places > box.min(axis=0) - margin) & (places < box.max(axis=0) + margin)
        below = trail_detail.ground_of(obj)  # of the prints of a ground that is in the list no more
        if inside.all(axis=1).any() and not ground_checks.hard_fault(below, next(iter(grounds), None)):
            still[settings.name_of(below)] = None
    return [*still]


def _finding(name: str, rests: Sequence[RaisedRest]) -> Finding:
    """Finding about an object that carries soles and is not in the settings."""
    who, first = listed(dict.fromkeys(rest.character for rest in rests)), min(rest.frame for rest in rests)
    count = f"{len(rests)} steps of {who} stand" if len(rests) > 1 else f"1 step of {who} stands"
    return Finding(
        "hard_ground",
        "warning",
        f"{count} on '{name}', from frame {first:.0f} on, without a print, but '{name}' is not in Hard Ground.",
        f"Press Add '{name}', so that the bake notices when it is moved, or Add '{name}' as Ground for prints in it; "
        "hide it if nothing stands on it.",
    )
