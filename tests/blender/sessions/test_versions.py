"""A bake made in one Blender plays in the others, with the add-on and without it; `make versions`."""

import itertools
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

from softground_addon.core.playback.ramps import TOLERANCE
from tests.blender.version_worker import BETWEEN, FRAMES

pytestmark = pytest.mark.versions

ROOT = Path(__file__).parents[3]
VERSIONS = {"4.2": ".venv-4.2.23", "4.5": ".venv", "5.2": ".venv-5.2.3"}
"""Blenders and the environments that hold their modules."""
TOO_NEW = {("5.2", "4.2")}
"""Blender before 4.5 cannot open the files of 5.0 and later, whatever is in them."""


def run_in(version, *arguments):
    python = ROOT / VERSIONS[version] / "bin" / "python"
    if not python.exists():
        pytest.skip(f"Blender {version} is not here: make test BPY=... makes {VERSIONS[version]}")
    command = [str(python), "-m", "tests.blender.version_worker", *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Shots by the version that made them, made when they are first asked for: file and recorded heights."""
    shots = {}

    def shot(version):
        if version not in shots:
            folder = tmp_path_factory.mktemp(f"made_{version}")
            run_in(version, "make", folder / "shot.blend", folder / "recorded.npz")
            shots[version] = (folder / "shot.blend", np.load(folder / "recorded.npz"))
        return shots[version]

    return shot


@pytest.mark.parametrize(("maker", "player"), list(itertools.product(VERSIONS, VERSIONS)))
def test_a_bake_plays_as_recorded_in_every_version_without_the_add_on(made, tmp_path, maker, player):
    if (maker, player) in TOO_NEW:
        pytest.skip("Blender 4.2 opens no files of Blender 5")
    blend, recorded = made(maker)
    frames = [36, BETWEEN, 8, 22]
    run_in(player, "play", blend, tmp_path / "played.npz", 0, 0, *frames)
    played = np.load(tmp_path / "played.npz")
    for frame in map(str, frames):
        assert recorded[frame].min() < -0.005
        assert np.abs(played[frame] - recorded[frame]).max() <= TOLERANCE + 1e-6


@pytest.mark.parametrize(("maker", "player"), list(itertools.product(VERSIONS, VERSIONS)))
def test_edits_of_steps_are_read_and_reset_in_every_version(made, tmp_path, maker, player):
    if (maker, player) in TOO_NEW:
        pytest.skip("Blender 4.2 opens no files of Blender 5")
    edited, written, read = (tmp_path / name for name in ("edited.blend", "written", "read"))
    run_in(maker, "edit", made(maker)[0], edited, written)
    run_in(player, "reset", edited, read)
    edits, before, after = pickle.loads(written.read_bytes())
    assert "StepEdit(mute=True" in edits
    assert before != after
    assert pickle.loads(read.read_bytes()) == (edits, before, after)


@pytest.mark.parametrize("version", VERSIONS)
def test_pixels_are_the_same_without_the_add_on_and_in_any_order(made, tmp_path, version):
    blend, _ = made(version)
    pictures = []
    for with_addon, frames in ((1, FRAMES), (0, (FRAMES[2], FRAMES[0], FRAMES[1]))):
        out = tmp_path / f"with_{with_addon}.npz"
        run_in(version, "play", blend, out, with_addon, 1, *frames)
        pictures.append(np.load(out))
    for frame in FRAMES:
        np.testing.assert_array_equal(pictures[0][f"pixels {frame}"], pictures[1][f"pixels {frame}"])
    first, last = (pictures[0][f"pixels {frame}"] for frame in (FRAMES[0], FRAMES[2]))
    assert np.abs(first - last).max() > 0.05, "nothing happens in the picture"
