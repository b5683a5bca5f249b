"""The library as users install it: a wheel of what it needs, in an environment with NumPy alone."""

from __future__ import annotations

import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import numpy as np
import pytest

from library import softground
from tests.core.capture.c3d_files import c3d_file
from tests.core.capture.test_joint_centres import centres
from tests.library.test_border import bvh

pytest.importorskip("hatchling")

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
RATE = 100.0


def run(*command, **options):
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=300, check=False, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--no-cache-dir")
    run(*pip, "wheel", "--no-deps", "--no-build-isolation", "--no-index", "-w", folder, ROOT)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The folder of the programs of an environment with the library, and the NumPy of these tests."""
    folder = tmp_path_factory.mktemp("installed") / "venv"
    venv.create(folder)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    pip = (sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--python", programs / "python")
    run(*pip, "install", "--no-deps", "--no-index", wheel)
    site = Path(run(programs / "python", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    for part in Path(np.__file__).parents[1].glob("numpy*"):
        if part.name in ("numpy", "numpy.libs"):
            (site / part.name).symlink_to(part)
    return programs


def test_the_wheel_is_small_typed_and_holds_what_it_needs_once(wheel):
    assert wheel.stat().st_size < 1_000_000
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert len(names) == len(set(names))
    assert {"softground/__init__.py", "softground/py.typed", "softground/presets/snow.json"} <= set(names)
    folders = {name.split("/")[2] for name in names if name.startswith("softground/_core/") and name.count("/") > 2}
    assert not folders & {"playback", "relief", "meshing", "response", "legs", "weather", "debris", "events"}
    assert not [name for name in names if "blender" in name or name.endswith(".png")]


IMPORT = """
import sys, time
import softground
print(time.process_time(), sorted({name.split(".")[0] for name in sys.modules} & {"bpy", "mathutils", "scipy"}))
"""


def test_it_loads_in_little_time_and_without_blender(installed, tmp_path):
    run(installed / "python", "-c", IMPORT, cwd=tmp_path)  # writes the compiled modules
    imports = [run(installed / "python", "-c", IMPORT, cwd=tmp_path).split(" ", 1) for _ in range(3)]
    assert min(float(seconds) for seconds, _ in imports) < 0.6  # NumPy and Python themselves included
    assert {modules.strip() for _, modules in imports} == {"[]"}


def test_its_command_gives_the_numbers_of_the_core_to_the_last_bit(installed, tmp_path):
    """The files of the repository, in this process, against the installed command."""
    markers = centres()
    points = np.stack(list(markers.values()), axis=1) * 1e3
    c3d = tmp_path / "anna.c3d"
    c3d.write_bytes(c3d_file(points, RATE, labels=list(markers), more={"SUBJECTS": {"MASS": np.array([61.5])}}))
    run(installed / "softground", "forces", c3d, "--csv", tmp_path / "forces.csv", cwd=tmp_path)
    loads = softground.estimate_loads(softground.read_c3d(c3d))
    softground.to_csv(loads, tmp_path / "here.csv")
    assert (tmp_path / "forces.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()

    figure, heights = bvh(tmp_path, stands=30), tmp_path / "heights.npy"
    run(installed / "softground", "press", figure, "--ground", "snow:fist", "--heights", heights, cwd=tmp_path)
    loads = softground.estimate_loads(softground.read_bvh(figure))
    prints = softground.press(loads, softground.Ground(softground.snow("fist")))
    assert prints.prints
    assert np.array_equal(np.load(heights)[..., 2], prints.grid()[2])


def test_a_user_s_mistake_is_told_in_a_sentence(installed, tmp_path):
    done = subprocess.run(
        [installed / "softground", "forces", "nobody.c3d"], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 2
    assert done.stderr == "softground: 'nobody.c3d' cannot be read (No such file or directory): choose another file\n"


TYPED = """
import numpy as np
import softground

body: softground.Body = softground.Body.from_joints({"hip_l": np.zeros((2, 3))}, 60.0, mass=70.0)
loads: softground.Loads = softground.estimate_loads(body)
depth: float = softground.press(loads, softground.Ground(softground.snow("fist"))).prints[0].depth
"""


def test_its_types_reach_who_uses_it(installed, tmp_path):
    mypy = pytest.importorskip("mypy")
    assert mypy
    (tmp_path / "right.py").write_text(TYPED)
    (tmp_path / "wrong.py").write_text(TYPED.replace("float = softground", "str = softground"))
    check = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache")]
    check += ["--python-executable", str(installed / "python")]
    run(*check, "right.py", cwd=tmp_path)
    done = subprocess.run([*check, "wrong.py"], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert "Incompatible types in assignment" in done.stdout
