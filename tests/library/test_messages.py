"""Errors and findings of the core have a code, and name no button, property or menu of the extension's panel."""

from __future__ import annotations

import ast
import pickle
import re

import pytest

from softground_addon.blender.remedies import REMEDIES, said, worded
from softground_addon.core.errors import InputError
from softground_addon.core.findings import Finding
from tests.library.contents import MODULES, ROOT

EVERY = sorted({*MODULES, *(ROOT / "softground_addon/core").rglob("*.py")})
"""Modules of the library, and of the rest of the core."""
RAISED = ("InputError", "BakeError")
FEWEST_WORDS = 3
"""A message has at least so many; shorter texts are keys and formats."""


def trees(paths):
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in paths}


def messages():
    """Texts that are no docstrings, with the module of each."""
    for path, tree in trees(EVERY).items():
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


def made(path, tree, names):
    """Calls that make something of these names in a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in names:
            yield f"{path.relative_to(ROOT).as_posix()}:{node.lineno}", node


def codes(paths):
    """Places at which modules make errors, with the codes that each may have."""
    for path, tree in trees(paths).items():
        for place, call in made(path, tree, RAISED):
            yield place, constants(call.args[1]) if len(call.args) > 1 else []


def constants(node):
    return [each.value for each in ast.walk(node) if isinstance(each, ast.Constant)]


@pytest.mark.slow
def test_every_error_of_the_core_has_a_code():
    every = dict(codes(EVERY))
    assert len(every) > 50
    assert [place for place, kinds in every.items() if "" in (kinds or [""])] == []


@pytest.mark.slow
def test_the_docs_list_the_codes_of_the_library():
    page = (ROOT / "docs/library.md").read_text(encoding="utf-8").split("## Errors")[1].split("\n## ")[0]
    listed = "".join(line for line in page.splitlines() if line.startswith("| "))
    assert sorted(re.findall(r"`([a-z_]+)`", listed)) == sorted({code for _, each in codes(MODULES) for code in each})


@pytest.mark.slow
def test_remedies_of_the_panel_are_for_codes_of_the_core_and_fit_their_facts():
    """Facts that a remedy needs are given wherever its code is."""
    facts = {}
    for path, tree in trees(EVERY).items():
        for _, call in made(path, tree, (*RAISED, "Finding")):
            names = {keyword.arg for keyword in call.keywords}
            names |= {key.value for each in call.args for key in getattr(each, "keys", [])}
            for code in constants(call.args[0 if call.func.id == "Finding" else 1]):
                facts[code] = facts.get(code, names) & names
    for code, remedy in REMEDIES.items():
        assert set(re.findall(r"{(\w+)", remedy)) <= {*facts[code], "remedy"}, code


def test_the_panel_words_what_the_core_says():
    finding = Finding("unit_scale", "warning", "It is 180 m tall.", "Scale it.", {"factor": 0.01})
    assert worded([finding])[0].text == "It is 180 m tall. Press Scale by 0.01, or leave it if the size is intended."
    error = InputError("Cells take 2 hours", "too_long", remedy="bake fewer frames.", time=7200.0)
    assert str(error) == "Cells take 2 hours: bake fewer frames."
    assert said(error).startswith("Cells take 2 hours: bake fewer frames. Time Limit in")
    assert said(InputError("'Cube' {has} no faces.")) == "'Cube' {has} no faces."


@pytest.mark.parametrize("error", [InputError("a", "b", remedy="c", size=2.0), InputError("a")])
def test_an_error_comes_whole_from_another_process(error):
    copied = pickle.loads(pickle.dumps(error))
    assert (str(copied), copied.code, copied.facts) == (str(error), error.code, error.facts)


@pytest.mark.slow
def test_messages_of_the_core_name_no_part_of_the_panel():
    known = set(labels())
    assert {"Add Character", "Time Limit", "Cell Size", "Bake Footprints"} <= known
    assert [(path, text) for path, text in messages() if names(text, known)] == []


@pytest.mark.slow
def test_messages_of_the_blender_side_do_so_that_the_test_can_fail():
    known = set(labels())
    assert names("There is no character to bake: add one with 'Add Character'.", known)
    assert names("60 minutes are allowed (Time Limit in Properties > Physics > Mesh and Look)", known)
    assert names("or apply it (Object > Apply > Scale), also on its parents.", set())
