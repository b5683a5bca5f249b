"""Motion files read without Blender, to compare with what is sampled of them in it."""

from pathlib import Path

import numpy as np

from .shots import MotionFile


class Bvh:
    """A BVH file with forward kinematics of its own, in the file's axes and units."""

    def __init__(self, path: Path):
        hierarchy, motion = path.read_text().split("MOTION")
        self.names, self.parents, self.offsets, self.channels = [], [], [], []
        stack, tokens = [], iter(hierarchy.split())
        for token in tokens:
            if token in ("ROOT", "JOINT", "End"):
                name = next(tokens)
                self.names.append(name if token != "End" else f"{self.names[stack[-1]]} end")
                self.parents.append(stack[-1] if stack else -1)
                self.channels.append([])
            elif token == "{":
                stack.append(len(self.names) - 1)
            elif token == "}":
                stack.pop()
            elif token == "OFFSET":
                self.offsets.append([float(next(tokens)) for _ in range(3)])
            elif token == "CHANNELS":
                self.channels[-1] = [next(tokens) for _ in range(int(next(tokens)))]
        rows = motion.split("Frame Time:")[1].split("\n", 1)[1].split()
        self.values = np.array(rows, dtype=float).reshape(-1, sum(map(len, self.channels)))

    def positions(self):
        """Path of every joint, by name."""
        count = len(self.values)
        rotations, places, paths = [], [], {}
        columns = iter(self.values.T)
        for name, parent, offset, channels in zip(self.names, self.parents, self.offsets, self.channels, strict=True):
            turn = np.tile(np.eye(3), (count, 1, 1))
            shift = np.tile(np.array(offset), (count, 1))
            for channel in channels:
                axis = "XYZ".index(channel[0])
                value = next(columns)
                if channel.endswith("position"):
                    shift[:, axis] = value  # a position channel replaces the offset
                else:
                    turn = turn @ rotation_about(axis, np.radians(value))
            if parent >= 0:
                shift = places[parent] + np.einsum("fij,fj->fi", rotations[parent], shift)
                turn = rotations[parent] @ turn
            rotations.append(turn)
            places.append(shift)
            paths[name] = shift
        return paths


def rotation_about(axis, angle):
    matrix = np.tile(np.eye(3), (len(angle), 1, 1))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[:, i, i] = matrix[:, j, j] = np.cos(angle)
    matrix[:, j, i] = np.sin(angle)
    matrix[:, i, j] = -matrix[:, j, i]
    return matrix


def file_to_world(motion: MotionFile):
    """Columns: where the file's axes go in Blender (forward becomes +Y, up becomes +Z)."""
    axes = {sign + name: (1 if not sign else -1) * np.eye(3)[i] for i, name in enumerate("XYZ") for sign in ("", "-")}
    forward, up = axes[motion.forward], axes[motion.up]
    return np.stack([np.cross(forward, up), forward, up]) * motion.scale
