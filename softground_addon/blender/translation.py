"""Blender's translation of texts that are put together; plain labels and tooltips are translated by Blender itself.

The names are those that Blender's own tools look for when they collect messages.
"""

from __future__ import annotations

from bpy.app.translations import pgettext_iface, pgettext_rpt


def iface_(message: str) -> str:
    """A text of the interface in the user's language."""
    return str(pgettext_iface(message))


def rpt_(message: str) -> str:
    """A report in the user's language."""
    return str(pgettext_rpt(message))
