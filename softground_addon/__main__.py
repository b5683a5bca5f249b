"""`python -m softground_addon bake shot.blend [options]`, with the bpy module instead of a Blender program."""

import sys

import bpy

from . import register, unregister
from .blender.command_line import cli


def main() -> int:
    """Register the add-on, do what the arguments say, and clean up: the exit code."""
    register()
    try:
        return cli.run_standalone(sys.argv[1:])
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        unregister()


if __name__ == "__main__":
    sys.exit(main())
