"""Settings of the user: `scene.softground`, saved with the .blend. Lengths are metres whatever the scene's units."""

from __future__ import annotations

from .character import SoftGroundCharacter, SoftGroundHold, SoftGroundJoint, SoftGroundPart, SoftGroundSole
from .material import SoftGroundMaterial, SoftGroundPainted
from .preferences import SoftGroundPreferences
from .response import SoftGroundGrounding, SoftGroundTilt
from .scene import SoftGroundFurtherGround, SoftGroundHardGround, SoftGroundPrinted, SoftGroundSettings

CLASSES = (
    SoftGroundJoint,
    SoftGroundPart,
    SoftGroundSole,
    SoftGroundHold,
    SoftGroundCharacter,
    SoftGroundMaterial,
    SoftGroundPainted,
    SoftGroundTilt,
    SoftGroundGrounding,
    SoftGroundHardGround,
    SoftGroundFurtherGround,
    SoftGroundPrinted,
    SoftGroundSettings,
    SoftGroundPreferences,
)
