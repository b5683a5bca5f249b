"""The command `softground`: forces, press and validate."""

from __future__ import annotations

import argparse
import io
import json
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ._core.errors import BakeError, InputError, SoftGroundError
from ._core.files import files, opensim
from ._core.ground import presets as presets_of_core
from ._core.ground.material import GroundMaterial
from .body import GRAVITY, Body
from .forces import Loads, SoleLoads, estimate_loads
from .plates import plates_on_feet
from .plots import plot_loads
from .prints import Ground, Prints, press, snow
from .readers import read_amass, read_bvh, read_c3d, read_trc
from .scoring import plates_saw_everything
from .tables import to_csv, to_opensim
from .validation import read_trials, table, validate

EXIT_DONE, EXIT_BAD_INPUT, EXIT_FAILED_CHECK, EXIT_INTERRUPTED = 0, 2, 3, 130

READERS: dict[str, Callable[..., Body]] = {
    ".c3d": read_c3d,
    ".trc": read_trc,
    ".npz": read_amass,
    ".bvh": read_bvh,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; returns the exit code: 0 done, 2 bad input, 3 a check failed, 130 interrupted."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a terminal may know few letters
    try:
        options = _parser().parse_args(arguments)
        options.run(options)
    except SystemExit as leaving:  # argparse has printed its message
        return leaving.code if isinstance(leaving.code, int) else EXIT_BAD_INPUT
    except BrokenPipeError:  # as before `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except SoftGroundError as error:
        print(f"softground: {error}", file=sys.stderr)
        return EXIT_FAILED_CHECK if isinstance(error, BakeError) else EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("softground: interrupted; no file was left half-written.", file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_DONE


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="softground", description="Ground reaction forces and footprints from motion."
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    forces = commands.add_parser("forces", help="forces on the feet", description="Forces on the soles of a body.")
    forces.set_defaults(run=_forces)
    forces.add_argument("--csv", type=Path, metavar="FILE.csv", help="write all frames as a table")
    forces.add_argument("--opensim", type=Path, metavar="FILE.mot", help="write them as OpenSim reads them")
    forces.add_argument(
        "--plot",
        nargs="?",
        type=Path,
        const=Path(),
        metavar="FILE.png",
        help="draw them; a new NAME_forces.png beside it by default",
    )
    pressing = commands.add_parser("press", help="prints in a ground", description="Prints of a body in soft ground.")
    pressing.set_defaults(run=_press)
    pressing.add_argument(
        "--ground", required=True, help="snow:HARDNESS (fist to knife, or 1 to 5), the name of a preset, or FILE.json"
    )
    pressing.add_argument("--heights", type=Path, metavar="FILE.npy", help="write x, y and height of all cells [m]")
    pressing.add_argument("--time", type=float, default=np.inf, metavar="S", help="when heights are looked at [s]")
    pressing.add_argument("--cell-size", type=float, metavar="M", help="side of a cell [m]")
    pressing.add_argument("--csv", type=Path, metavar="FILE.csv", help="write a table of the prints")
    for command in (forces, pressing):
        command.add_argument("file", type=Path, help="motion: .c3d, .trc, .bvh, or AMASS .npz")
        command.add_argument("--mass", type=float, metavar="KG", help="of the body; else as the file or its size says")
        command.add_argument("--level", type=float, default=0.0, metavar="M", help="height of the level ground [m]")
    validating = commands.add_parser("validate", help="forces against force plates", description=validate.__doc__)
    validating.set_defaults(run=_validate)
    validating.add_argument("directory", type=Path, help="folder of C3D files, of TRC and MOT, or of CSV and JSON")
    validating.add_argument("--report", type=Path, metavar="FILE.json", help="write the table as JSON")
    for command in (forces, pressing, validating):
        command.add_argument(
            "--static", type=Path, metavar="FILE", help="static trial (.c3d, .trc) with further markers"
        )
    return parser


def _forces(options: argparse.Namespace) -> None:
    picture = options.plot
    if picture is not None and not picture.name:
        picture = options.file.with_name(f"{options.file.stem}_forces.png")
        _check_new(picture, f"replace it by --plot {picture}")
    if options.opensim:
        opensim.loads_beside(options.opensim)
    loads = _loads(options)
    measured = plates_on_feet(loads.body).force if loads.body.plates else None
    print(f"{'sole':<8} {'from s':>8} {'to s':>8} {'peak N':>8} {'±':>6} {'impulse Ns':>11}")
    for sole in loads.soles:
        for start, end in sole.contacts:
            print(_contact(loads, sole, start, end))
    if measured is not None:
        error = np.stack([sole.force for sole in loads.soles], axis=1) - measured
        touching = loads.steps.contacts.touching[loads.steps.motion.on_frames]
        seen = plates_saw_everything(measured[..., 2], touching, weight=loads.body.mass * GRAVITY, rate=loads.body.rate)
        if seen.any():
            rms = np.sqrt((error[seen, :, 2] ** 2).mean()) / (loads.body.mass * GRAVITY)
            print(f"against the plates, where they show all that bears: {rms:.3f} body weights for each foot")
    if options.csv:
        print(to_csv(loads, options.csv))
    for path in to_opensim(loads, options.opensim) if options.opensim else ():
        print(path)
    if picture is not None:
        plot_loads(loads, picture, measured)
        print(picture)


def _check_new(path: Path, remedy: str) -> None:
    """Raise InputError if a file exists that would be written without having been named."""
    if path.exists():
        raise InputError(f"'{path}' is there already: {remedy}", "file_exists", path=path)


def _contact(loads: Loads, sole: SoleLoads, start: float, end: float) -> str:
    during = (loads.times >= start) & (loads.times <= end)
    vertical = np.where(during, sole.force[:, 2], 0.0)
    peak = int(vertical.argmax())
    impulse = vertical.sum() / loads.body.rate
    deviation = f"{sole.deviation[peak]:.0f}" if np.isfinite(sole.deviation[peak]) else ""
    return f"{sole.name:<8} {start:>8.3f} {end:>8.3f} {vertical[peak]:>8.0f} {deviation:>6} {impulse:>11.1f}"


def _press(options: argparse.Namespace) -> None:
    material = _material(options.ground)
    loads = _loads(options)
    prints = press(loads, Ground(material, options.level), cell_size=options.cell_size, progress=_progress())
    print(f"{'sole':<8} {'from s':>8} {'to s':>8} {'x m':>8} {'y m':>8} {'depth cm':>9} {'area cm²':>9} {'peak N':>8}")
    for each in prints.prints:
        print(
            f"{each.sole:<8} {each.start:>8.3f} {each.end:>8.3f} {each.position[0]:>8.3f} {each.position[1]:>8.3f} "
            f"{each.depth * 100:>9.2f} {each.area * 1e4:>9.0f} {each.peak_force:>8.0f}"
        )
    compressed, raised = prints.volumes
    print(f"compressed {compressed * 1e3:.2f} l, raised {raised * 1e3:.2f} l, cells of {prints.cell_size * 1e3:.1f} mm")
    if options.csv:
        print(to_csv(prints, options.csv))
    if options.heights:
        print(_write_heights(prints, options.time, options.heights))


def _write_heights(prints: Prints, time: float, path: Path) -> Path:
    """Write the cells around all prints as an array (R, C, 3) of x, y and height [m]."""
    x, y, heights = prints.grid(time)
    with files.replacing(path) as partial, partial.open("wb") as written:
        np.save(written, np.stack([*np.meshgrid(x, y), heights], axis=-1))
    return path


def _validate(options: argparse.Namespace) -> None:
    trials, show = read_trials(options.directory, options.static), _progress()
    found = []
    for number, trial in enumerate(trials, start=1):
        scored = [*validate(trial)]
        if not scored:
            print(f"{trial.name}: the plates show none of it whole, nothing to score", file=sys.stderr)
        found += scored
        show(number / len(trials))
    print(table(found))
    if options.report:
        files.write_text(options.report, json.dumps(found, indent=1) + "\n")


def _loads(options: argparse.Namespace) -> Loads:
    """The loads of the body in the file; prints who it is."""
    suffix = options.file.suffix.lower()
    if suffix not in READERS:
        raise InputError(f"'{options.file}' is not read here: give a file of {', '.join(READERS)}", "wrong_format")
    if options.static and suffix not in (".c3d", ".trc"):
        raise InputError(f"--static is for files of markers (.c3d, .trc), not {options.file.name}", "wrong_format")
    static = {"static": options.static} if options.static else {}
    body = READERS[suffix](options.file, mass=options.mass, **static)
    source = "" if body.mass_from == "given" else f" (by {body.mass_from})"
    print(f"{body.name}: {body.mass:g} kg{source}, {len(body.times)} frames at {body.rate:g} Hz")
    loads = estimate_loads(body, options.level)
    if not any(len(sole.contacts) for sole in loads.soles):
        lowest = min(float(sole.lowest().min()) for sole in body.motion.soles)
        raise InputError(
            f"no sole of {body.name} touches the ground at {options.level:g} m; the lowest comes to {lowest:.3g} m: "
            "give the height of the ground as --level, or longer motion",
            "no_contact",
        )
    return loads


def _material(ground: str) -> GroundMaterial:
    """The material of a ground by its name on the command line."""
    kind, _, hardness = ground.partition(":")
    if kind == "snow" and hardness:
        try:
            return snow(float(hardness))
        except ValueError:
            return snow(hardness)
    if ground.endswith(".json"):
        return presets_of_core.load(Path(ground)).material
    return presets_of_core.find(ground).material


def _progress() -> Callable[[float], None]:
    """Shows the part that is done on a terminal."""
    if not sys.stderr.isatty():
        return lambda _part: None

    def show(part: float) -> None:
        print(f"\r{part:4.0%}", end="" if part < 1.0 else "\r    \r", file=sys.stderr, flush=True)

    return show
