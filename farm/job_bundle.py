"""A manifest as an OpenJD job template (a Deadline Cloud job bundle): one task bakes a shot, renders depend on it.

    python -m farm.job_bundle night.toml night_bundle --frames 1-250
    openjd check night_bundle/template.json
    deadline bundle submit night_bundle

Needs no Blender: it reads the manifest as `softground batch` does.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from softground_addon.batch import manifest
from softground_addon.batch.manifest import BatchShot
from softground_addon.batch.manifest_values import frame_range
from softground_addon.core.errors import InputError, SoftGroundError
from softground_addon.core.files import files

MOST_TASKS = 1024
"""Most values of a task parameter that OpenJD 2023-09 takes."""

GRACE = 60
"""Time that a cancelled bake has to end by itself [s]; it needs as long as a step of its work takes."""


def template(path: Path, shots: Sequence[BatchShot], *, frames: tuple[int, int] | None, chunk: int) -> dict[str, Any]:
    """The job template of a manifest.

    Parameters
    ----------
    path : Path
        The manifest.
    shots : sequence of BatchShot
        Its shots.
    frames : (int, int) or None
        Frames to render of those shots that name none.
    chunk : int
        Frames that a render task renders; 0 for no renders.

    Raises
    ------
    InputError
        If a shot to render has no frames or is not saved, or if there are too many tasks.
    """
    if len(shots) > MOST_TASKS:
        raise InputError(f"{len(shots)} shots are more than the {MOST_TASKS} tasks of a step: split the manifest.")
    parameters: list[dict[str, Any]] = [
        {
            "name": "Manifest",
            "type": "PATH",
            "objectType": "FILE",
            "dataFlow": "IN",
            "description": "Which shots to bake, and how (see docs/batch.md).",
        },
        {
            "name": "Blender",
            "type": "STRING",
            "default": "blender",
            "description": "The Blender program; baking needs the SoftGround extension in it, rendering does not.",
        },
    ]
    bake = _step(
        "Bake",
        {"Shot": ("STRING", [shot.name for shot in shots])},
        "--background --command softground batch {{Param.Manifest}} --shot={{Task.Param.Shot}} --progress=openjd",
    )
    if not chunk:
        return _job(path, parameters, [bake])
    parameters.append(
        {
            "name": "RenderFolder",
            "type": "PATH",
            "objectType": "DIRECTORY",
            "dataFlow": "OUT",
            "description": "Where the pictures go, in a folder for each shot.",
        }
    )
    tasks = [(shot, first, last) for shot in shots for first, last in _chunks(shot, frames, chunk)]
    if len(tasks) > MOST_TASKS:
        raise InputError(f"{len(tasks)} render tasks are more than {MOST_TASKS}: give a larger --chunk.")
    render = _step(
        "Render",
        {
            "Shot": ("STRING", [shot.name for shot, _, _ in tasks]),
            "Baked": ("PATH", [str(_baked(shot)) for shot, _, _ in tasks]),
            "First": ("INT", [first for _, first, _ in tasks]),
            "Last": ("INT", [last for _, _, last in tasks]),
        },
        "--background {{Task.Param.Baked}} --render-output {{Param.RenderFolder}}/{{Task.Param.Shot}}/#### "
        "--frame-start {{Task.Param.First}} --frame-end {{Task.Param.Last}} --render-anim",
    )
    return _job(path, parameters, [bake, render | {"dependencies": [{"dependsOn": "Bake"}]}])


def parameter_values(path: Path) -> dict[str, str]:
    """What the job's parameters are when nothing else is said; a template itself must not hold absolute paths."""
    return {"Manifest": os.path.realpath(path), "RenderFolder": os.path.realpath(path.with_suffix(".render"))}


def asset_references(path: Path, shots: Sequence[BatchShot]) -> dict[str, Any]:
    """The files that Deadline Cloud has to bring to a worker, and the folders that it has to bring back."""
    state = os.path.realpath(path.with_suffix(".batch"))
    presets = {shot.preset for shot in shots if shot.preset.lower().endswith(".json")}
    return {
        "assetReferences": {
            "inputs": {"filenames": sorted({str(shot.file) for shot in shots} | presets), "directories": []},
            "outputs": {"directories": sorted({str(out.parent) for shot in shots for out in shot.outputs} | {state})},
            "referencedPaths": [],
        }
    }


def _job(path: Path, parameters: list[dict[str, Any]], steps: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "name": f"SoftGround {path.stem}"[:64],
        "parameterDefinitions": parameters,
        "steps": steps,
    }


def _step(name: str, parameters: dict[str, tuple[str, list[Any]]], arguments: str) -> dict[str, Any]:
    """A step that runs Blender once for each set of parameter values; the n-th values belong together.

    `arguments` are separated by blanks here; what OpenJD puts in for {{...}} stays one argument, whatever is in it.
    """
    space: dict[str, Any] = {
        "taskParameterDefinitions": [
            {"name": key, "type": kind, "range": values} for key, (kind, values) in parameters.items()
        ]
    }
    if len(parameters) > 1:
        space["combination"] = f"({', '.join(parameters)})"
    cancelation = {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": GRACE}
    run = {"command": "{{Param.Blender}}", "args": arguments.split(), "cancelation": cancelation}
    return {"name": name, "parameterSpace": space, "script": {"actions": {"onRun": run}}}


def _chunks(shot: BatchShot, frames: tuple[int, int] | None, chunk: int) -> list[tuple[int, int]]:
    whole = shot.frames or frames
    if whole is None:
        raise InputError(f"Shot '{shot.name}' names no frames to render: give --frames A-B, or --chunk 0 to bake only.")
    return [(first, min(first + chunk - 1, whole[1])) for first in range(whole[0], whole[1] + 1, chunk)]


def _baked(shot: BatchShot) -> Path:
    baked = shot.file if shot.in_place else shot.save
    if baked is None:
        raise InputError(f"Shot '{shot.name}' is not saved, so it cannot be rendered: give 'save', or --chunk 0.")
    return baked


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the job bundle; the exit code is 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m farm.job_bundle", description=__doc__.partition("\n")[0])
    parser.add_argument("manifest", type=Path, help="which shots to bake, and how: TOML or JSON")
    parser.add_argument("bundle", type=Path, help="folder for the job bundle; created when missing")
    parser.add_argument("--frames", type=frame_range, metavar="A-B", help="frames of shots that name none")
    parser.add_argument("--chunk", type=int, default=10, metavar="N", help="frames of a render task; 0: bake only")
    options = parser.parse_args(arguments)
    try:
        shots = manifest.load(options.manifest)
        job = template(options.manifest, shots, frames=options.frames, chunk=max(0, options.chunk))
        options.bundle.mkdir(parents=True, exist_ok=True)
        known = {parameter["name"] for parameter in job["parameterDefinitions"]}
        values = [{"name": k, "value": v} for k, v in parameter_values(options.manifest).items() if k in known]
        for name, content in (
            ("parameter_values", {"parameterValues": values}),
            ("asset_references", asset_references(options.manifest, shots)),
            ("template", job),
        ):
            files.write_text(options.bundle / f"{name}.json", json.dumps(content, indent=2) + "\n")
    except SoftGroundError as error:
        print(f"job_bundle: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
