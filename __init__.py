"""SoftGround: footprints with weight. The add-on itself is in `softground_addon`."""

from .softground_addon import register, unregister  # noqa: F401
