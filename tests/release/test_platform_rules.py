"""What the extensions platform asks of code and manifest (docs/publishing.md), over every module that ships."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ABOUT = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
TREES = {
    path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
    for path in (ROOT / "__init__.py", *sorted((ROOT / "softground_addon").rglob("*.py")))
}

THREADS = {"threading", "_thread", "concurrent", "multiprocessing", "asyncio", "queue"}
NETWORK = {"socket", "socketserver", "ssl", "urllib", "http", "ftplib", "smtplib", "xmlrpc", "requests", "webbrowser"}
LOADERS = {"importlib", "runpy", "imp", "zipimport", "pkgutil", "site", "pip", "ctypes", "cffi", "pickle", "marshal"}
EXECUTION = {"exec", "eval", "compile", "__import__"}

WRITERS = {
    "softground_addon/core/files/files.py": "beside the file that it replaces",
    "softground_addon/batch/runner.py": "logs and locks in the state folder that the user names; a temporary folder",
    "softground_addon/blender/command_line/cli.py": "the null device, once nobody reads",
    "softground_addon/core/record/record.py": "memory",
    "softground_addon/core/events/wave_file.py": "memory",
}
"""Modules that write otherwise than to the name that `files.replacing` gives, and where to."""


def imports(tree):
    """Names of the modules that are imported, those of this extension aside."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module


def calls(tree):
    """Each call, with the last part of the name of what is called."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield node, node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def writes(tree):
    """True if files are written to otherwise than under the name that `replacing` gives."""
    given = {
        item.optional_vars.id
        for node in ast.walk(tree)
        if isinstance(node, ast.With)
        for item in node.items
        if isinstance(item.context_expr, ast.Call)
        and ast.unparse(item.context_expr.func).split(".")[-1] == "replacing"
        and isinstance(item.optional_vars, ast.Name)
    }
    for call, name in calls(tree):
        receiver = getattr(getattr(call.func, "value", None), "id", "")
        words = [ast.unparse(word) for word in (*call.args, *(keyword.value for keyword in call.keywords))]
        opens = name == "open" and any(re.fullmatch("'[rbt]*[wax+][rbt+]*'", word) for word in words)
        if (opens or name in ("write_bytes", "touch")) and receiver not in given:
            yield ast.unparse(call)


@pytest.mark.parametrize("barred", [THREADS, NETWORK, LOADERS], ids=["threads", "network", "loaders"])
def test_no_module_is_imported_for(barred):
    """Blender does not support threads in extensions ("Python Threads are Not Supported" in its reference)."""
    faults = [(path, name) for path, tree in TREES.items() for name in imports(tree) if name.split(".")[0] in barred]
    assert faults == []


def test_nothing_beyond_blender_and_pythons_library_is_imported():
    known = sys.stdlib_module_names | {"bpy", "bpy_extras", "bmesh", "mathutils", "gpu", "gpu_extras", "blf", "numpy"}
    faults = {(path, name) for path, tree in TREES.items() for name in imports(tree) if name.split(".")[0] not in known}
    assert faults == set()


def test_no_text_is_executed():
    faults = [
        (path, ast.unparse(call))
        for path, tree in TREES.items()
        for call, name in calls(tree)
        if name in EXECUTION and isinstance(call.func, ast.Name)
    ]
    assert faults == []


def test_nothing_leaves_its_own_module_or_the_folders_that_users_name():
    barred = {"sys.path", "sys.modules", "os.system", "os.chdir", "Path.home", "os.path.expanduser"}
    faults = {
        (path, name)
        for path, tree in TREES.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and (name := ast.unparse(node)) in barred
    }
    assert faults == set()


def test_only_the_batch_starts_processes():
    """They are Blender itself (`program.worker_command`)."""
    starting = {path for path, tree in TREES.items() if "subprocess" in imports(tree)}
    assert starting == {"softground_addon/batch/runner.py"}


def test_nothing_is_left_of_older_kinds_of_add_ons():
    """`bl_info`, and `__name__` for the name of the package."""
    faults = {
        (path, node.id)
        for path, tree in TREES.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and node.id in ("bl_info", "__name__")
    }
    assert faults == {("softground_addon/__main__.py", "__name__")}


def test_who_knows_the_extensions_own_folder_writes_nothing():
    knowing = {
        path: tree
        for path, tree in TREES.items()
        if any(isinstance(node, ast.Name) and node.id == "__file__" for node in ast.walk(tree))
    }
    assert knowing
    faults = [
        (path, name) for path, tree in knowing.items() for _, name in calls(tree) if name in ("replacing", "mkdir")
    ]
    assert faults + [(path, call) for path, tree in knowing.items() for call in writes(tree)] == []


def test_files_are_written_whole_and_nowhere_else():
    assert {path for path, tree in TREES.items() if any(writes(tree))} == set(WRITERS)


def test_no_path_is_cut_at_slashes():
    """Windows has others; `pathlib` knows them."""
    cutting = {"split", "rsplit", "partition", "rpartition"}
    faults = [
        (path, ast.unparse(call))
        for path, tree in TREES.items()
        for call, name in calls(tree)
        if name in cutting and {ast.unparse(word) for word in call.args} & {"'/'", r"'\\'", "os.sep"}
    ]
    assert faults == []


def test_text_has_the_same_line_ends_on_every_system():
    """`Path.write_text` writes others on Windows."""
    written = {ast.unparse(call.func) for tree in TREES.values() for call, name in calls(tree) if name == "write_text"}
    assert written <= {"files.write_text", "write_text"}


TAGS = {
    *("3D View", "Add Curve", "Add Mesh", "Animation", "Bake", "Camera", "Compositing", "Development", "Game Engine"),
    *("Geometry Nodes", "Grease Pencil", "Import-Export", "Lighting", "Material", "Mesh", "Modeling", "Node", "Object"),
    *("Paint", "Physics", "Pipeline", "Render", "Rigging", "Scene", "Sculpt", "Sequencer", "System", "Text Editor"),
    *("Tracking", "User Interface", "UV"),
}
"""Of add-ons, in Blender's manual (Extensions, Tags)."""


def test_the_manifest_says_what_the_platform_wants_to_know():
    names = {node.attr for tree in TREES.values() for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    assert set(ABOUT["permissions"]) == {"files"} | (names & {"clipboard"})
    assert set(ABOUT["tags"]) <= TAGS
    for line in (ABOUT["tagline"], *ABOUT["permissions"].values()):
        assert len(line) <= 64
        assert line[-1].isalnum()
    assert ABOUT["license"] == ["SPDX:GPL-3.0-or-later"]
    assert all(re.fullmatch(r"\d{4}(-\d{4})? \S.*", line) for line in ABOUT["copyright"])
    assert "blender" not in (ABOUT["id"] + ABOUT["name"]).lower()
