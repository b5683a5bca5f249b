"""Check of a cycle whose feet slide at different speeds, as no travel lets all of them rest."""

from __future__ import annotations

import numpy as np

from ..findings import Finding
from ..loads.contacts import Contacts, slowest_belt
from ..motion.motion import CharacterMotion
from ..numerics.intervals import runs

ALIKE = 2 / 3
"""Feet on one belt slide no slower than this part of the fastest; rolling ones and eased keys come to .7."""
DRAGS = 0.1
"""A sole that slides no faster, as a part of the fastest, goes with the body: a tail, or a foot that drags."""
WALKS = 0.5
"""Share of the time that soles touch from which a body walks: contacts of runs are too short to tell their speed."""
SEEN = 0.25
"""Share of the time that a sole must touch."""


def uneven_slides(motion: CharacterMotion, contacts: Contacts) -> Finding | None:
    """Finding about a cycle whose feet slide at different speeds, so that no travel lets all of them rest.

    The body may travel: the speeds are compared as seen from it.
    """
    share = contacts.touching.mean(axis=0)
    feet = np.flatnonzero(share > SEEN)
    if motion.centre is not None or len(feet) < 2 or len(motion.frames) < 2 or share[feet].mean() < WALKS:
        return None
    slides = []
    paths = [motion.soles[n].landmark_positions()[..., :2].mean(axis=1) for n in feet]
    for n, path in zip(feet, paths, strict=True):
        first, end = runs(contacts.touching[:, n])
        slides.append((path[end - 1] - path[first]).sum(axis=0) / (max((end - 1 - first).sum(), 1) * motion.time_step))
    hips = motion.hips[[0, -1], :2]
    of_body = np.array(slides) - (hips[1] - hips[0]) / (motion.time_step * (len(motion.frames) - 1))
    fastest = int(np.linalg.norm(of_body, axis=1).argmax())
    most = float(np.linalg.norm(of_body[fastest]))
    part = of_body @ of_body[fastest] / max(most, 1e-9) ** 2
    part[part < DRAGS] = 1.0
    slowest = int(part.argmin())
    velocities = [np.gradient(path, motion.time_step, axis=0) for path in paths]
    if part[slowest] > ALIKE or most * (1.0 - part[slowest]) < slowest_belt(velocities, motion):
        return None
    speeds = {motion.soles[feet[n]].sole.name: round(float(np.linalg.norm(slides[n])), 3) for n in (fastest, slowest)}
    fast, slow = (f"'{name}' slides at {speed:.2g} m/s" for name, speed in speeds.items())
    return Finding(
        "uneven_slides",
        "warning",
        f"No speed lets all feet of '{motion.name}' rest: while planted, {fast}, and {slow}.",
        "Use an animation whose feet slide alike, or plant them by keys.",
        {"character": motion.name, "speeds": speeds},
    )
