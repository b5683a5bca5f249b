"""True if two versions press the same ground: the records in .blend files of the same names, side by side.

    python -m tests.validation.compare_bakes FOLDER_BEFORE FOLDER_AFTER

Prints, for each file in both folders, the largest difference of compression and rim over all cells. Exit code 1 where
one exceeds the record's quantum.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

from softground_addon.blender.ground import ground_mesh
from softground_addon.core.record import record
from softground_addon.core.record.footprints import QUANTUM, Footprint, recompose


def records(file: Path) -> dict[str, list[Footprint]]:
    """The footprints in a file, by the name of the mesh that carries them."""
    bpy.ops.wm.open_mainfile(filepath=str(file))
    stored = {mesh.name: mesh.get(ground_mesh.RECORD) for mesh in bpy.data.meshes}
    return {
        name: list(record.load(bytes(memoryview(item).cast("B"))).footprints)
        for name, item in stored.items()
        if item is not None
    }


def difference(before: list[Footprint], after: list[Footprint]) -> float:
    """Largest difference of compression or rim between two records, over all cells [m]."""
    first, other = recompose(before), recompose(after)
    keys = first.tiles.keys() | other.tiles.keys()
    return max(
        (float(np.abs(first.tiles.get(key, 0.0) - other.tiles.get(key, 0.0)).max()) for key in keys), default=0.0
    )


def main(before: Path, after: Path) -> int:
    """Compare all files that are in both folders; returns the exit code."""
    worst = 0.0
    for file in sorted(before.glob("*.blend")):
        old, new = records(file), records(after / file.name)
        for name in sorted(old.keys() | new.keys()):
            if name not in old or name not in new:
                print(f"{file.name} {name}: only {'before' if name in old else 'after'}")
                worst = np.inf
                continue
            largest = difference(old[name], new[name])
            steps = f"{len(old[name])} steps" + (f", then {len(new[name])}" if len(old[name]) != len(new[name]) else "")
            print(f"{file.name} {name}: {steps}, largest difference {largest * 1e3:.6g} mm")
            worst = max(worst, largest)
    return int(worst > QUANTUM * (1 + 1e-6))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
