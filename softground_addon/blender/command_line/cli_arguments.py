"""Arguments of `softground`: the options of `bake`, `clean`, `export` and `batch`."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

from ...batch import command
from ...batch.manifest import RESPONSES
from ...batch.manifest_values import frame_range
from ..output import export_formats


def parse(arguments: Sequence[str], *, standalone: bool) -> argparse.Namespace:
    """The options of a command line.

    Parameters
    ----------
    arguments : sequence of str
        Words after `softground`.
    standalone : bool
        True if they include the shot, as there is no Blender that has opened it.

    Raises
    ------
    SystemExit
        After the help, or the problem and its remedy, was printed.
    """
    return _parser(standalone=standalone).parse_args(_with_frames_joined(arguments))


def _with_frames_joined(arguments: Sequence[str]) -> list[str]:
    """The arguments with negative frames given as `--frames=-20-5`: alone, they would be taken for an option."""
    joined: list[str] = []
    for argument in arguments:
        if joined and joined[-1] == "--frames" and re.fullmatch(r"-\d+--?\d+", argument):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def _parser(*, standalone: bool) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="softground", description="Physically based footprints for animated characters."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    for name, purpose, add in (
        ("bake", "bake the footprints of a shot", _add_bake),
        ("clean", "take sliding and floating out of the feet", _add_clean),
        ("export", "write a baked ground for other programs", _add_export),
    ):
        of_shot = commands.add_parser(name, help=purpose)
        of_shot.set_defaults(blend=None)
        if standalone:
            of_shot.add_argument("blend", type=Path, metavar="SHOT.blend", help="the shot's file")
        of_shot.add_argument("--scene", metavar="NAME", help="its scene, if it is not the one that the file opens with")
        of_shot.add_argument(
            "--frames", type=_frame_range, metavar="A-B", help="first and last frame (default: the shot's own)"
        )
        add(of_shot)
    command.add_arguments(commands.add_parser("batch", help="bake the shots of a manifest side by side; resumable"))
    return parser


def _add_destination(parser: argparse.ArgumentParser) -> None:
    destination = parser.add_mutually_exclusive_group()
    destination.add_argument("--save", type=Path, metavar="FILE.blend", help="save the shot under this name")
    destination.add_argument("--in-place", action="store_true", help="save the shot over the opened file")


def _add_bake(bake: argparse.ArgumentParser) -> None:
    bake.add_argument("--preset", metavar="NAME|FILE.json", help="ground preset")
    bake.add_argument(
        "--ground", dest="grounds", action="append", default=[], metavar="NAME[=PRESET]",
        help="a mesh to bake on, in place of those of the file; may be repeated: each takes the steps on it",
    )  # fmt: skip
    bake.add_argument("--cell-size", type=float, metavar="M", help="size of the ground's cells in metres")
    bake.add_argument(
        "--set", dest="overrides", action="append", default=[], type=_override, metavar="PATH=VALUE",
        help="a setting under scene.softground, e.g. material.youngs_modulus=4e5; may be repeated",
    )  # fmt: skip
    bake.add_argument("--edits", type=Path, metavar="FILE.json", help="changes of single steps, by the report's ids")
    bake.add_argument(
        "--response",
        choices=RESPONSES,
        help="lower the feet into their prints: as a layer, or in the keys of a new action",
    )
    _add_destination(bake)
    bake.add_argument("--report", type=Path, metavar="FILE.json", help="write the report to this file")
    bake.add_argument("--progress", choices=command.PROGRESS_STYLES, default="plain", help="how to show progress")
    bake.add_argument("--dry-run", action="store_true", help="check and compute everything, but do not save the shot")
    bake.add_argument(
        "--receipt", type=Path, metavar="FILE.json", help="write the checksums of what was read and written"
    )
    bake.add_argument("--parent", type=int, default=0, metavar="PID", help="end when this parent process has ended")


def _add_clean(clean: argparse.ArgumentParser) -> None:
    clean.add_argument("--root-motion", action="store_true", help="add root motion first to cycles on the spot")
    _add_destination(clean)
    clean.add_argument(
        "--report", type=Path, metavar="FILE.json", help="write a report of the feet, before and after, to this file"
    )
    clean.set_defaults(preset=None, grounds=[], edits=None, receipt=None)


def _add_export(export: argparse.ArgumentParser) -> None:
    formats = tuple(map(_format, export_formats.FORMATS))
    export.add_argument("--format", required=True, type=_format, choices=formats, help="kind of file")
    export.add_argument(
        "--output", type=Path, metavar="FILE",
        help="output file, with the format's suffix or none; for images, a folder and how their names begin "
        "(default: beside the shot)",
    )  # fmt: skip
    export.add_argument("--resolution", type=int, default=2048, metavar="N", help="width and height of images")
    export.add_argument("--uv-map", default="", metavar="NAME", help="UV map of images, if not the one rendered")
    export.add_argument(
        "--samples", type=Path, metavar="DIR", help="for wav: your own sounds, in a folder of WAV files"
    )
    export.add_argument("--stereo", action="store_true", help="for wav: hear the steps from the camera")
    export.add_argument("--outdated", action="store_true", help="export even if the bake is outdated")


def _format(text: str) -> str:
    """A format as it is written on a command line: `EVENTS_MIDI` as `events-midi`."""
    return text.lower().replace("_", "-")


def _frame_range(text: str) -> tuple[int, int]:
    try:
        return frame_range(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _override(text: str) -> tuple[str, str]:
    path, equals, value = text.partition("=")
    if not equals or not path.strip():
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form PATH=VALUE")
    return path.strip(), value.strip()
