"""Scenes of the gallery start from an empty file, as the sample scenes do."""

from tests.scenes.conftest import scene

__all__ = ["scene"]
