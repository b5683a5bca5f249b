"""A bake, and then another language, and another; another file; at last the add-on is switched off."""

from __future__ import annotations

import bpy

from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk
from tests.gui.stories.interrupted_bake import ADD_ON, session, with_viewport

TEXTS = {
    "button": ("Operator", "Bake Footprints"),
    "name": ("*", "Cell Size (cm)"),
    "tooltip": ("*", "How the bone prints"),
    "template": ("*", "{count} steps, {depth}"),
    "preset": ("Operator", "Fresh Snow (field)"),
}
"""Context and text of one of each kind; Blender has none of them itself."""


def tell(hand: Hand, facts: dict) -> Steps:
    hand.show_wires()
    yield from hand.open_sidebar()
    open_walk(60)
    with_viewport(hand, bpy.ops.softground.add_character)
    with_viewport(hand, bpy.ops.softground.bake)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    facts["at first"] = seen()
    for language in ("de_DE", "ja_JP", "zh_HANS", "en_US"):
        yield from choose(hand, language)
        facts[language] = seen()
        yield from hand.picture(language, in_docs=False)
    bpy.ops.wm.read_homefile()
    yield 1.0
    yield from choose(hand, "fr_FR")
    facts["without a catalogue"] = seen()
    yield from choose(hand, "de_DE")
    facts["after another file"] = seen()
    bpy.ops.preferences.addon_disable(module=ADD_ON)
    yield 0.5
    facts["switched off"] = looked_up()


def choose(hand: Hand, language: str) -> Steps:
    bpy.context.preferences.view.language = language
    yield from hand.move(*hand.middle())
    yield 1.0


def seen() -> dict:
    """What Blender shows of the texts, the catalogues that are read, and texts of the catalogue that show otherwise."""
    translation, translate = module("translation"), bpy.app.translations.pgettext_iface
    texts = translation.catalogue(bpy.app.translations.locale)
    return {
        "read": sorted(module("state").state.catalogues),
        "texts": looked_up(),
        "otherwise in our context": [
            text for text, ours in texts.items() if translate(text, translation.CONTEXT) != ours
        ],
        "otherwise in Blender's": [text for text, ours in texts.items() if translate(text) != ours],
    }


def looked_up() -> dict[str, str]:
    return {kind: bpy.app.translations.pgettext_iface(text, context) for kind, (context, text) in TEXTS.items()}
