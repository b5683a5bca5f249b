"""Blender's types as mypy has them: release/blender_types.py says what the add-on registers."""

from __future__ import annotations

import ast
from pathlib import Path

import bpy

PLUGIN = Path(__file__).parents[3] / "release" / "blender_types.py"


def test_mypy_is_told_of_the_attributes_that_are_registered(scene):
    tables = {
        node.targets[0].id: node.value for node in ast.parse(PLUGIN.read_text()).body if isinstance(node, ast.Assign)
    }
    blocks = (scene, bpy.context.window_manager, bpy.data.materials.new("Sand"))
    kinds = {block.bl_rna.identifier: block for block in blocks}
    for owner, attributes in ast.literal_eval(tables["REGISTERED"]).items():
        for name, kind in attributes.items():
            value = type(getattr(kinds[owner.rpartition(".")[2]], name))
            assert f"{value.__module__}.{value.__qualname__}" == kind
