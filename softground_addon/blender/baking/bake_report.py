"""What is said of a bake: its inputs, tables for the report, and what no longer fits it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.findings import Finding
from ...core.loads.estimate import CharacterLoads
from ...core.record.edits import without_sole, without_step
from ...core.record.footprints import Footprint
from ...core.record.record import BakeRecord
from ...core.record.typical_depth import typical_of
from .. import settings
from ..ground import ground_mesh, still_ground, weather
from ..jobs import STAGES
from ..reading import staleness
from ..response import response_job

Array = NDArray[np.float64]

FLOATING = "floating_mm"
"""Entry of a bake's summary: how far feet float above their prints [mm]."""

TYPICAL = "typical_depth_m"
"""Entry of a bake's summary: how deep its typical step is [m]."""
LAST_FRAME = "last_frame"
"""Entry of a bake's summary: the frame at which its last contact ends."""


def ground_findings(ground: bpy.types.Object | None, frame: int) -> list[Finding]:
    """What the user should know of a ground that changes its shape over time, taken at a frame."""
    modifier = still_ground.changes_with_time(ground) if ground else ""
    if not (ground and modifier):
        return []
    return [
        Finding(
            "changing_ground",
            "warning",
            f"Ground '{ground.name}' changes its shape over time by its modifier '{modifier}': it was taken as it is "
            f"at frame {frame}, where the bake starts.",
            "Apply the modifier at the frame you want, or switch it off.",
        )
    ]


def edit_findings(left: BakeRecord) -> list[Finding]:
    """Which of the artist's edits have lost their step."""
    steps = [
        Finding(
            "edit_without_step",
            "warning",
            f"Step '{name}', which you edited, no longer exists: its foot does not touch the ground at that frame.",
            "The edit is kept for when the step comes back; Reset All Steps drops it.",
        )
        for name in without_step(left.footprints, left.edits)
    ]
    soles = [
        Finding(
            "edit_without_sole",
            "warning",
            f"Step '{name}' was pressed with its own sole, as no foot in this bake and no mesh in this scene has the sole "
            f"'{left.edits[name].sole}' of its edit.",
            "The edit is kept for when that foot or mesh is there; choose another sole, or reset the step.",
