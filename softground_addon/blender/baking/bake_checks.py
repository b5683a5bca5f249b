"""Checks of a bake before anything is written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.checks.self_check import no_motion
from ...core.errors import InputError
from ...core.findings import Finding
from ...core.motion.motion import CharacterMotion
from ...core.numerics.arrays import Array, Indices
from ...core.numerics.cell_keys import AROUND, ROW, Keys, among, cells_of, keys_at, keys_of
from ...core.numerics.slices import Slices, sliced
from ...core.settings import BakeSettings
from .. import settings
from ..ground import ground_surface
from ..rigs.frame_ranges import holds_a_pose

COARSEST_SPACING = 0.25
"""Largest spacing of ground vertices under the prints, in lengths of the sole: coarser meshes cannot show a foot."""

DETAIL_FROM = 4
"""Spacing of ground vertices under the prints from which the ground is refined along the trail, in cells."""

FEW = 5
"""A square of 3·`DETAIL_FROM` cells that holds fewer vertices is not fine: where they are `DETAIL_FROM` cells apart, it
holds 9."""

MOST_MISSED = 0.02
"""Share of the prints' area that may lie far from any vertex before the ground is refined along the trail."""


def check_motion(wanted: BakeSettings, motions: Sequence[CharacterMotion]) -> None:
    """Raise InputError if nobody moves, and keys hold nobody in a pose."""
    still = [finding for motion in motions if (finding := no_motion(motion))]
    rigs = [settings.resolve(character.armature) for character in wanted.characters if character.armature]
    if len(still) == len(motions) and not any(map(holds_a_pose, rigs)):
        raise InputError(" ".join(finding.text for finding in still))


@dataclass(frozen=True)
class Coverage:
    """Density of the ground's vertices under the prints.

    Attributes
    ----------
    spacing : float
        Distance between them on average [m], infinite where there are none.
    missed : float
        Share of the prints' area that has few of them around.
    is_fine_somewhere : bool
        True if the ground is fine enough anywhere, such as under other prints.
    """

    spacing: float
    missed: float
    is_fine_somewhere: bool

    def is_coarse(self, cell_size: float) -> bool:
        """True if prints are not well shown."""
        return self.spacing > DETAIL_FROM * cell_size or self.missed > MOST_MISSED


@sliced
def coverage(vertices: Array, index: Indices | slice, printed: Keys, cell_size: float) -> Slices[Coverage]:
    """Density of vertices (V, 3), of which those in `index` are moved, where the ground is, or will be, printed.

    `printed` are the `cell_keys` of those cells, ascending, `cell_size` is in [m].
    """
    if not len(vertices):  # of a ground that is made by modifiers alone
        return Coverage(np.inf, 1.0, is_fine_somewhere=False)
    cells = cells_of(printed)
    first = keys_at(vertices[index, :2] - cell_size / 2, cell_size)  # of the four whose centres are around a vertex
    vertices_in_cells = among(printed, first[:, None] + (0, 1, ROW, ROW + 1)).any(axis=1).sum()
    spacing = float(np.sqrt(len(cells) * cell_size**2 / max(1e-9, float(vertices_in_cells))))
    counted = []
    for part in ground_surface.parts_of(vertices):
        yield
        counted.append(np.unique(keys_at(part[:, :2], DETAIL_FROM * cell_size), return_counts=True))
    yield
    some_blocks, some_crowds = map(np.concatenate, zip(*counted, strict=True))
    blocks, which = np.unique(some_blocks, return_inverse=True)
    crowd = np.bincount(which, some_crowds)
    under, share = np.unique(keys_of(cells // DETAIL_FROM), return_counts=True)
    around = under[:, None] + AROUND
    place = np.minimum(np.searchsorted(blocks, around), len(blocks) - 1)
    near = np.where(blocks[place] == around, crowd[place], 0).sum(axis=1)
    missed = float(share[near < FEW].sum()) / max(1, len(cells))
    return Coverage(spacing, missed, bool(crowd.max() >= FEW))


def wants_detail(ground: bpy.types.Object, cover: Coverage, detail: str, cell_size: float, sole_length: float) -> bool:
    """True if the ground is to be refined along the trail; InputError if it must be and may not.

    `sole_length` is that of the shortest sole [m].
    """
    if detail == "ALWAYS" or (detail == "AUTO" and cover.is_coarse(cell_size)):
        return True
    if cover.spacing > COARSEST_SPACING * sole_length:
        raise InputError(
            f"Ground '{ground.name}' is too coarse: its vertices are more than "
            f"{COARSEST_SPACING * sole_length * 100:.0f} cm apart under soles of {sole_length * 100:.0f} cm. "
            "Set Detail to Automatic in Properties > Physics > Mesh and Look, or Subdivide the ground."
        )
    return False


def coverage_findings(ground: bpy.types.Object, cover: Coverage, detail: str, cell_size: float) -> list[Finding]:
    """Findings about prints beyond the fine part of a ground."""
    if not (cover.is_fine_somewhere and cover.is_coarse(cell_size)):
        return []
    if detail == "NEVER":
        return [
            Finding(
                "coarse_ground",
                "warning",
                f"Prints lie where ground '{ground.name}' is too coarse to show them",
                "set Detail to Automatic in Properties > Physics > Mesh and Look, or create the ground again.",
            )
        ]
    return [
        Finding(
            "finer_copy",
            "note",
            f"Prints lie where ground '{ground.name}' is coarse: a finer copy, '{ground.name} Trail', takes them.",
            f"To have them on '{ground.name}' itself, clear the bake and create the ground again.",
        )
    ]
