"""Remedies in the words of the panel, for findings and errors of the core, by their codes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from ..core.errors import SoftGroundError, joined
from ..core.findings import Finding

REMEDIES = {
    "no_print": "check in Properties > Physics > Contacts that its soles are what touches the ground, and in the "
    "viewport that they face down.",
    "sole_without_print": "check that its sole faces down, and that its bone in Contacts is right.",
    "walks_in_place": "Press Walk Ahead, or use the animation with its root motion.",
    "unit_scale": "Press Scale by {factor:g}, or leave it if the size is intended.",
    "mass_of_size": "Set Mass, or scale the rig if that is not its size.",
    "level_on_slope": "on stairs, select a mesh of them and press Use Selected; on a hill, turn the feet to the slope.",
    "step_without_skin": "check in Properties > Physics > Contacts that its contacts are the parts that touch the "
    "ground.",
    "skin_without_step": "add what rests there with Add Contact in Feet.",
    "foot_twice": "remove one of them in Properties > Physics > Contacts.",
    "edit_without_step": "The edit is kept for when the step comes back; Reset All Steps drops it.",
    "no_legs": "Complete its joints in Properties > Physics > Body Bones.",
    "carving": "Or turn Carve off, or raise Time Limit in Properties > Physics > Mesh and Look.",
    "carving_memory": "Or turn Carve off.",
    "no_contact": "move the ground under the feet, or correct the feet in Properties > Physics > Contacts.",
    "below_ground": "move the ground down to them. If it is a room, turn its faces inward (Edit Mode, Mesh > Normals > "
    "Recalculate Inside).",
    "faces_down": "turn it, or flip its normals (Mesh > Normals > Flip).",
    "no_print_at_all": "Check the masks, and the crust in Properties > Physics > Layers.",
    "settles_too_slowly": "lower Settling Time in Properties > Physics > Realism, or choose a smaller depth.",
    "no_grooves": "{remedy} It follows from the Tread Pattern 'From Shoes'.",
    "too_long": "{remedy} Time Limit in Properties > Physics > Mesh and Look, or --set longest_bake=N, allows more.",
}
"""In braces facts, and as `remedy` what the core says."""


def worded(findings: Iterable[Finding]) -> list[Finding]:
    """Findings with the panel's remedies."""
    return [replace(finding, remedy=_remedy(finding)) for finding in findings]


def said(error: SoftGroundError) -> str:
    """Text of an error with the panel's remedy."""
    return joined(error.message, _remedy(error))


def _remedy(about: Finding | SoftGroundError) -> str:
    return REMEDIES.get(about.code, "{remedy}").format(remedy=about.remedy, **about.facts)
