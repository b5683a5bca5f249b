"""`python -m softground_addon bake shot.blend [options]`, with the bpy module instead of a Blender program."""

import sys

from .blender import cli

if __name__ == "__main__":
    sys.exit(cli.run_standalone(sys.argv[1:]))
