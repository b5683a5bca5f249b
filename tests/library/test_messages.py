"""No message of what the library is made of names a button, a property or a menu of the extension's panel."""

from __future__ import annotations

import ast
import re

from tests.library.contents import MODULES, ROOT

FEWEST_WORDS = 3
"""A message has at least so many; shorter texts are keys and formats."""


def trees(paths):
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in paths}


def messages():
    """Texts of the library that are no docstrings, with the module of each."""
    for path, tree in trees(MODULES).items():
        documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            is_text = isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documentation
            if is_text and len(node.value.split()) >= FEWEST_WORDS:
                yield path.relative_to(ROOT).as_posix(), node.value


def labels():
    """What buttons, properties and panels are called, in two words or more: single words are the field's own."""
    for tree in trees((ROOT / "softground_addon/blender").rglob("*.py")).values():
        for node in ast.walk(tree):
            values = []
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "bl_label":
                values.append(node.value)
            if isinstance(node, ast.Call):
                values += [keyword.value for keyword in node.keywords if keyword.arg in ("name", "text")]
            for value in values:
                if isinstance(value, ast.Constant) and isinstance(value.value, str):
                    label = re.sub(r" \([^)]*\)$", "", value.value)
                    if re.match(r"[A-Z]\w+ [A-Z(]\w*", label):
                        yield label


def names(text, known):
    """True if a message names something of the panel, or how to get there."""
    way_there = re.search(r"\w > [A-Z]|--set\b|\bN-panel\b|\bEdit Mode\b", text)
    return bool(way_there) or any(label in text for label in known)


def test_messages_of_the_library_name_no_part_of_the_panel():
    known = set(labels())
    assert {"Add Character", "Time Limit", "Cell Size", "Bake Footprints"} <= known
    assert [(path, text) for path, text in messages() if names(text, known)] == []


def test_messages_of_the_blender_side_do_so_that_the_test_can_fail():
    known = set(labels())
    assert names("There is no character to bake: add one with 'Add Character'.", known)
    assert names("60 minutes are allowed (Time Limit in Advanced > Mesh and Look)", known)
    assert names("or apply it (Object > Apply > Scale), also on its parents.", set())
