"""Takes the part of Blender's command line that farms use, and does it with the bpy module."""

import argparse
import subprocess
import sys

import bpy

arguments = sys.argv[1:]
if "--command" in arguments:
    at = arguments.index("--command")
    shot = [argument for argument in arguments[:at] if not argument.startswith("-")]
    name, command, *options = arguments[at + 1 :]
    assert name == "softground"
    sys.exit(
        subprocess.run([sys.executable, "-m", "softground_addon", command, *shot, *options], check=False).returncode
    )

parser = argparse.ArgumentParser()
parser.add_argument("-b", "--background", action="store_true", required=True)
parser.add_argument("-y", action="store_true")
parser.add_argument("blend")
parser.add_argument("--render-output", required=True)
parser.add_argument("--render-format")
parser.add_argument("--frame-start", type=int)
parser.add_argument("--frame-end", type=int)
parser.add_argument("--render-anim", action="store_true")
parser.add_argument("--render-frame")
given = parser.parse_args(arguments)
bpy.ops.wm.open_mainfile(filepath=given.blend)
scene = bpy.context.scene
scene.render.filepath = given.render_output
if given.render_format:
    scene.render.image_settings.file_format = given.render_format
if given.render_frame:
    given.frame_start, _, given.frame_end = map(int, given.render_frame.replace("..", " 0 ").split())
scene.frame_start, scene.frame_end = given.frame_start, given.frame_end
bpy.ops.render.render(animation=True)
