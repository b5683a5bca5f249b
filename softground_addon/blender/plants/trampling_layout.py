"""Layout of the table by which plants give way: names of its attributes, and its version."""

MARK, VERSION = "softground_give_way", 6
"""Custom property of the group and of the table's vertices: the version of how they fit together."""

TILES, FIRST, SENT_BY = "softground_tiles", "softground_first", "softground_sent_by"
"""Of each tile: its first slot, less what the cell at its corner counts for; of each slot, its first pass; of each
pass, numbered from 1, the first over its cell that trod on it, which sends off what lies there."""
ACTIVE, TIMES, PACE, LEAN, SHARES, SINK = (
    f"softground_{name}" for name in ("active", "times", "pace", "lean", "shares", "sink")
)
"""Vectors of each pass: frames from which it acts and from which the ground stays, two numbers; start, end and number;
speeds and height above; direction, two numbers; reach, what lasts, and 1 behind an earlier one; slope and height that
it leaves."""
WIND = "softground_wind"
"""Wind of the weather [m/s], where there is any; see `wind_nodes`."""
META = "softground_meta"
"""Of the first vertex: tiles in a row, cells along a tile, frame rate; of the second: columns, rows, first
frame; of the third: side of a cell, gravity and radius of a sole's parts, in
Blender units."""
THROWN_FROM = 0.05
"""Radius of the parts of a sole, which throw litter from the speed on from which they throw debris [m]."""
