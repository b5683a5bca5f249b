"""What the user sets: `scene.softground`, saved with the .blend. Lengths are metres whatever the scene's units."""

from __future__ import annotations

from .character import DEFAULT_MASS as DEFAULT_MASS
from .character import SoftGroundCharacter, SoftGroundJoint, SoftGroundSole
from .material import SoftGroundMaterial, SoftGroundPainted
from .response import SoftGroundGrounding, SoftGroundTilt
from .scene import DEFAULT_CELL_SIZE as DEFAULT_CELL_SIZE
from .scene import SoftGroundSettings

CLASSES = (
    SoftGroundJoint,
    SoftGroundSole,
    SoftGroundCharacter,
    SoftGroundMaterial,
    SoftGroundPainted,
    SoftGroundTilt,
    SoftGroundGrounding,
    SoftGroundSettings,
)
