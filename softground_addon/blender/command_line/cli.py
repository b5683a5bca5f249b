"""The command line: `softground bake`, `clean`, `export` and `batch`, in `blender --command` and in the bpy module."""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TextIO

import bpy

from ...batch import command, manifest, receipts
from ...core.errors import BakeError, InputError, SoftGroundError
from ...core.files import files, report
from ...core.ground import presets
from ...core.record import edits as step_edits
from ...core.record.archive import LARGEST_TEXT
from .. import further_grounds, ground_presets, jobs
from ..baking import bake_job, clean_feet, make_keys, root_motion
from ..characters import selection
from ..output import export_formats
from ..preset_files import user_folder
from ..properties import setting_paths
from ..remedies import said
from ..response import response_job
from . import cli_arguments, program
from .saving import check_places, files_read, save_copy, save_target

EXIT_DONE, EXIT_BAD_INPUT, EXIT_FAILED_CHECK, EXIT_INTERRUPTED = 0, 2, 3, 130

_INTERRUPTS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


def run_in_blender(arguments: Sequence[str]) -> int:
    """Entry of `blender -b shot.blend --command softground ...`: acts on the open file."""
    return _run(arguments, standalone=False)


def run_standalone(arguments: Sequence[str]) -> int:
    """Entry of `python -m softground_addon ...`, where the add-on is registered: opens the file and acts on it."""
    return _run(arguments, standalone=True)


def _run(arguments: Sequence[str], *, standalone: bool) -> int:
    with contextlib.redirect_stdout(_Unbroken(sys.stdout)) if sys.stdout else contextlib.nullcontext():
        return _exit_code(arguments, standalone=standalone)


class _Unbroken(io.TextIOBase):
    """An output that survives a closed pipe, as before `| head`, a full disk, or a letter that it cannot encode.

    On Windows a pipe takes the letters of one code page only, unless Python is set otherwise.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        encoding = getattr(self._stream, "encoding", None) or "utf-8"
        try:
            self._stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        except OSError:
            self._hush()
        return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError:
            self._hush()

    def _hush(self) -> None:
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), self._stream.fileno())


def _exit_code(arguments: Sequence[str], *, standalone: bool) -> int:
    previous = {number: signal.signal(number, _interrupt) for number in _INTERRUPTS}
    try:
        for argument in arguments:
            if not _is_text(argument):
                raise InputError(f"{argument!r} is not UTF-8 text: rename the file, or give another name.")
        options = cli_arguments.parse(arguments, standalone=standalone)
        if options.command == "batch":
            return _batch_code(command.bake_batch(options, program.made_by(), program.worker_command))
        if options.command == "export":
            _export(options)
        elif options.command == "clean":
            _clean(options)
        else:
            _bake(options)
    except SystemExit as leaving:  # argparse has printed its message
        return leaving.code if isinstance(leaving.code, int) else EXIT_BAD_INPUT
    except BakeError as error:
        print(f"softground: {said(error)}", file=sys.stderr)
        return EXIT_FAILED_CHECK
    except SoftGroundError as error:
        print(f"softground: {said(error)}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        previous.clear()  # the process is about to end: a second signal must not spoil that
        print("softground: interrupted; no file was left half-written.", file=sys.stderr)
        return EXIT_INTERRUPTED
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler or signal.SIG_DFL)  # none: Blender's own, which Python cannot name
    return EXIT_DONE


def _is_text(argument: str) -> bool:
    try:
        argument.encode()
    except UnicodeEncodeError:
        return False
    return True


def _interrupt(_number: int, _frame: object) -> None:
    for number in _INTERRUPTS:
        signal.signal(number, signal.SIG_IGN)  # once is enough: the cleaning up follows
    raise KeyboardInterrupt


def _batch_code(outcomes: Sequence[command.Outcome]) -> int:
    """The exit code of a batch: that of its worst shot."""
    statuses = {outcome.status for outcome in outcomes}
    if "interrupted" in statuses:
        print("softground: interrupted; run the same command again to continue.", file=sys.stderr)
        return EXIT_INTERRUPTED
    if statuses & {"crashed", "failed"}:
        return EXIT_FAILED_CHECK
    return EXIT_BAD_INPUT if "refused" in statuses else EXIT_DONE


def _bake(options: argparse.Namespace) -> None:
    if not (options.save or options.in_place or options.report or options.dry_run):
        raise InputError("Nothing would be kept: give --save FILE.blend, --in-place, --report FILE.json or --dry-run.")
    _open(options.blend)
    read = receipts.checksums(files_read(options)) if options.receipt else {}
    scene = _scene(options.scene)
    target = save_target(options)
    check_places(options, target)
    edits = _edits(options.edits) if options.edits else None
    selection.set_up_automatically(scene)
    if options.preset:
        ground_presets.apply_preset(scene.softground, _preset(options.preset))
    _choose_grounds(scene, options.grounds)
    if options.frames:
        scene.softground.frame_start, scene.softground.frame_end = options.frames
    if options.cell_size is not None:
        setting_paths.assign(scene.softground, "cell_size", str(options.cell_size))
    for path, value in options.overrides:
        setting_paths.assign(scene.softground, path, value)
    if options.response and not scene.softground.grounding.use:
        scene.softground.sink_feet = True
    show = _ending_with(options.parent, _PROGRESS.get(options.progress))
    result = jobs.run(bake_job.bake(scene, write=not options.dry_run, edits=edits), show)
    if options.response == "keys" and not options.dry_run and response_job.has_layers(scene.softground):
        for made in jobs.run(make_keys.make_keys(scene)):
            if made.warning:
                print(f"softground: {made.warning}", file=sys.stderr)
    _write_results(options, target, result.report, read)
    if options.progress == "json":
        said = {"stage": "done", "fraction": 1.0, "overall": 1.0, "totals": result.report["totals"]}
        print(json.dumps(said), flush=True)
    if options.progress in ("plain", "openjd"):
        print(report.summary(result.report), flush=True)


def _clean(options: argparse.Namespace) -> None:
    if not (options.save or options.in_place or options.report):
        raise InputError("Nothing would be kept: give --save FILE.blend, --in-place or --report FILE.json.")
    _open(options.blend)
    scene = _scene(options.scene)
    target = save_target(options)
    check_places(options, target)
    selection.set_up_automatically(scene)
    if options.frames:
        scene.softground.frame_start, scene.softground.frame_end = options.frames
    travels = jobs.run(root_motion.root_motion(scene)) if options.root_motion else ()
    cleaned = jobs.run(clean_feet.clean_feet(scene))
    content = cleaned.as_dict() | {"root_motion": {travel.character: travel.as_dict() for travel in travels}}
    with contextlib.ExitStack() as results:
        if target:
            save_copy(results.enter_context(files.replacing(target)))
        if options.report:
            path = results.enter_context(files.replacing(Path(os.path.realpath(options.report))))
            path.write_bytes(report.dump(content).encode())
    for line in (*(travel.summary for travel in travels), cleaned.summary):
        print(line, flush=True)
    for warning in (*(travel.caveat for travel in travels if travel.caveat), *cleaned.warnings):
        print(f"softground: {warning}", file=sys.stderr)


def _export(options: argparse.Namespace) -> None:
    _open(options.blend)
    scene = _scene(options.scene)
    kind = options.format.upper().replace("-", "_")
    asked = options.output.absolute() if options.output else export_formats.default_path(scene.softground.ground, kind)
    path = export_formats.check_suffix(asked, kind)
    start, end = options.frames or (scene.softground.frame_start, scene.softground.frame_end)
    if not 1 <= options.resolution <= export_formats.LARGEST_IMAGE:
        raise InputError(f"--resolution takes a number from 1 to {export_formats.LARGEST_IMAGE}.")
    how = {name: getattr(options, name) for name in ("resolution", "uv_map", "outdated", "samples", "stereo")}
    for written in export_formats.export(scene, export_formats.Options(kind, path, start, end, **how)):
        print(written, flush=True)


def _ending_with(parent: int, show: Callable[[jobs.Progress], None] | None) -> Callable[[jobs.Progress], None]:
    """Show progress while the parent process of that id lives, and end with it; 0 is none. Only shows on Windows."""

    def shown(progress: jobs.Progress) -> None:
        if parent and os.name == "posix" and os.getppid() != parent:
            _interrupt(0, None)
        if show:
            show(progress)

    return shown


def _write_results(
    options: argparse.Namespace, target: Path | None, content: dict[str, Any], read: dict[str, str]
) -> None:
    """Write all results whole under other names, and then give them their names: the receipt, which is proof, last."""
    with contextlib.ExitStack() as results:  # at its end the files get their names
        receipt = results.enter_context(files.replacing(options.receipt)) if options.receipt else None
        wrote: dict[Path, Path] = {}
        if target and not options.dry_run:
            wrote[target] = results.enter_context(files.replacing(target))
            save_copy(wrote[target])
        if options.report:
            path = Path(os.path.realpath(options.report))
            wrote[path] = results.enter_context(files.replacing(path))
            wrote[path].write_bytes(report.dump(content).encode())
        if receipt:
            content_of_receipt = receipts.dump(
                made_by=program.made_by(),
                options=_batch_shot(options, target).options,
                read=read,
                wrote={str(path): receipts.checksum(partial) for path, partial in wrote.items()},
                totals=content["totals"],
            )
            receipt.write_bytes(content_of_receipt.encode())


def _open(path: Path | None) -> None:
    """Open a shot; without one, that which Blender has opened is meant."""
    if path is None:
        return
    if not path.is_file():
        raise InputError(f"There is no file '{path}'.")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    except (RuntimeError, UnicodeEncodeError) as error:
        raise InputError(f"'{path}' could not be opened as a .blend file: {str(error).strip()}") from None


def _scene(name: str | None) -> bpy.types.Scene:
    if not name:
        return bpy.context.scene
    scene = bpy.data.scenes.get(name)
    if scene is None:
        known = ", ".join(f"'{scene.name}'" for scene in bpy.data.scenes)
        raise InputError(f"There is no scene '{name}' in the shot. There are: {known}.")
    return scene


def _edits(path: Path) -> dict[str, step_edits.StepEdit]:
    """The edits of steps in a file.

    Raises
    ------
    InputError
        If it cannot be read, or makes no sense.
    """
    try:
        content = json.loads(files.read_regular(path, LARGEST_TEXT))
    except OSError as error:
        raise InputError(f"The edits '{path}' cannot be read: {error.strerror}.") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"The edits '{path}' are not valid JSON: {error}.") from None
    return step_edits.from_json(content, f"The edits '{path}'")


def _choose_grounds(scene: bpy.types.Scene, texts: Sequence[str]) -> None:
    """Bake on the named meshes of a scene, `NAME` or `NAME=PRESET` each, in place of its own grounds."""
    options, meshes = scene.softground, {obj.name: obj for obj in scene.objects if obj.type == "MESH"}
    if texts:
        options.grounds.clear()
    for number, text in enumerate(texts):
        name, preset = (text, "") if text in meshes else text.rpartition("=")[::2]
        if name not in meshes:
            raise InputError(f"--ground {text}: scene '{scene.name}' has no mesh '{name or text}'.")
        if number == 0:
            options.ground, material = meshes[name], options.material
        else:
            material = further_grounds.add(options, meshes[name]).material
        if preset:
            ground_presets.make_of(options, material, _preset(preset))


def _preset(name_or_path: str) -> presets.Preset:
    path, folders = Path(name_or_path), (presets.FOLDER, user_folder())
    return presets.load(path) if path.suffix.lower() == ".json" else presets.find(name_or_path, folders)


def _batch_shot(options: argparse.Namespace, target: Path | None) -> manifest.BatchShot:
    """This bake as an entry of a manifest."""
    return manifest.BatchShot(
        name="",
        file=Path(bpy.data.filepath),
        scene=options.scene or "",
        preset=options.preset or "",
        frames=options.frames,
        cell_size=options.cell_size,
        settings=tuple(options.overrides),
        edits=Path(os.path.realpath(options.edits)) if options.edits else None,
        grounds=tuple(options.grounds),
        response=options.response or "",
        save=None if options.in_place else target,
        in_place=options.in_place,
        report=Path(os.path.realpath(options.report)) if options.report else None,
    )


class _Plain:
    """A line for each stage and each tenth of it."""

    def __init__(self) -> None:
        self.shown = ""

    def __call__(self, progress: jobs.Progress) -> None:
        line = f"{progress.stage} {int(progress.fraction * 10) * 10} %"
        if line != self.shown:
            self.shown = line
            print(line, flush=True)


def _json(progress: jobs.Progress) -> None:
    fraction, overall = round(progress.fraction, 4), round(progress.overall, 4)
    print(json.dumps({"stage": progress.stage, "fraction": fraction, "overall": overall}), flush=True)


def _openjd(progress: jobs.Progress) -> None:
    print(f"openjd_progress: {progress.overall * 100:.1f}\nopenjd_status: {progress.stage}", flush=True)


_PROGRESS: dict[str, Callable[[jobs.Progress], None]] = {"plain": _Plain(), "json": _json, "openjd": _openjd}
