"""The bake taken out of Blender: the file browsers of the exports, as an artist meets them."""

from __future__ import annotations

from pathlib import Path

import bpy

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk
from tests.gui.stories.interrupted_bake import with_viewport

FORMATS = ("ALEMBIC", "USD", "PC2", "EXR", "OBJ")
"""As they are listed, from above; Debian builds Blender without the first two."""

FIRST, ROW = 50, 20
"""Middle of the first of them below the top of the region, and from one to the next [px]."""


def tell(hand: Hand, facts: dict) -> Steps:
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"  # in the one window that a hand reaches
    open_walk(48)
    with_viewport(hand, bpy.ops.softground.add_character)
    with_viewport(hand, bpy.ops.softground.bake)
    facts["unsaved"] = yield from browse(hand, "softground.export")
    yield from leave(hand)
    facts["unsaved forces"] = yield from browse(hand, "softground.export_forces")
    yield from leave(hand)

    shot = str(hand.pictures / "My Shot.blend")
    with_viewport(hand, bpy.ops.wm.save_as_mainfile, filepath=shot)
    yield 0.5
    facts["shot"] = shot
    facts["proposed"] = yield from browse(hand, "softground.export")
    facts["chosen"] = {}
    for row, kind in enumerate(FORMATS):
        place = hand.region("TOOL_PROPS", "FILE_BROWSER")
        yield from hand.click(place.x + place.width * 0.7, place.y + place.height - FIRST - row * ROW)
        yield 0.5
        browser = hand.area("FILE_BROWSER").spaces.active
        facts["chosen"][kind] = (browser.active_operator.properties.format, browser.params.filename)
        yield from hand.picture(f"export_{kind.lower()}", in_docs=False)
    yield from accept(hand)
    facts["obj"] = written(hand)
    facts["forces"] = yield from browse(hand, "softground.export_forces")
    yield from hand.picture("export_forces", in_docs=False)
    yield from accept(hand)
    facts["written"] = written(hand)


def browse(hand: Hand, operator: str) -> Steps:
    """Open the file browser of an export; the folder and the name that it proposes."""
    group, name = operator.split(".")
    with_viewport(hand, getattr(getattr(bpy.ops, group), name), "INVOKE_DEFAULT")
    yield 1.0
    params = hand.area("FILE_BROWSER").spaces.active.params
    return params.directory.decode(), params.filename


def leave(hand: Hand) -> Steps:
    yield from over_files(hand)
    yield from hand.key("ESC")
    yield 1.0


def accept(hand: Hand) -> Steps:
    yield from over_files(hand)
    yield from hand.key("RET")
    yield 1.5


def over_files(hand: Hand) -> Steps:
    files = hand.region("WINDOW", "FILE_BROWSER")
    yield from hand.move(files.x + files.width // 2, files.y + files.height // 2)


def written(hand: Hand) -> list[str]:
    return sorted(path.name for path in Path(hand.pictures).glob("My Shot*"))
