"""Every panel below Advanced, open, in a sidebar of Blender's own width: one picture of each, and one of them all."""

from __future__ import annotations

import subprocess
from pathlib import Path

import bpy

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk
from tests.gui.stories.edit_steps import show_alone, steps
from tests.gui.stories.interrupted_bake import scene, session, with_viewport

COLUMNS = (
    ("soles", "joints"),
    ("prints", "material", "layers"),
    ("painted", "mesh", "overlay"),
    ("response", "foot_locks", "output"),
    ("weather", "steps"),
)
"""The panels as the docs show them, from left to right."""

TABS = 24
"""Width of the sidebar's tabs [px]."""

PLAIN = "#303030"
"""What a sidebar shows where there is no panel."""


def tell(hand: Hand, facts: dict) -> Steps:
    open_walk(60)
    bpy.context.preferences.system.use_region_overlap = False  # panels are cut out of a plain background
    yield from hand.open_sidebar()
    with_viewport(hand, bpy.ops.softground.add_character)
    scene().softground.relief = "CLOSE_UP"
    with_viewport(hand, bpy.ops.softground.bake)
    with_viewport(hand, bpy.ops.softground.add_weather, preset="NONE")
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    with_viewport(hand, bpy.ops.softground.choose_step, step=steps()[1].name)
    with_viewport(hand, bpy.ops.softground.add_foot_lock)
    facts["width"] = hand.region().width
    columns = []
    for number, names in enumerate(COLUMNS):
        parts = []
        for name in names:
            panel = getattr(bpy.types, f"SOFTGROUND_PT_{name}")
            show_alone(panel, tab=panel.bl_label)
            yield from hand.open_sidebar(panel.bl_label)
            yield from hand.move(*hand.middle())
            yield from hand.picture(name, of="UI", in_docs=False)
            parts.append(hand.pictures / f"{name}.png")
            cut_out(parts[-1])
        columns.append(hand.pictures / f"column_{number}.png")
        convert(*parts, "-append", columns[-1])
    (hand.pictures / "docs").mkdir(exist_ok=True)
    convert(
        "-background",
        PLAIN,
        *columns,
        "+append",
        "+dither",
        "-colors",
        "64",
        hand.pictures / "docs" / "panel_advanced.png",
    )
    facts["panels"] = [name for names in COLUMNS for name in names]


def cut_out(picture: Path) -> None:
    """Leave of a picture of the sidebar the panel alone, without the tabs beside it and what is empty below."""
    convert(
        picture,
        "-gravity",
        "East",
        "-chop",
        f"{TABS}x0",
        "-gravity",
        "South",
        "-chop",
        "0x2",
        "-trim",
        "+repage",
        picture,
    )


def convert(*arguments: str | Path) -> None:
    subprocess.run(["convert", *map(str, arguments)], check=True)
