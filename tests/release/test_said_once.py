"""What is said in one place of the product: names of surfaces, of attributes and properties, Blender's version."""

import ast
from collections import Counter

from softground_addon.core.ground.surfaces import SURFACES
from tests.release.test_platform_rules import TREES

CODE = {path: list(ast.walk(tree)) for path, tree in TREES.items()}


def test_only_their_records_know_the_names_of_surfaces():
    users = {
        path
        for path, nodes in CODE.items()
        for node in nodes
        if isinstance(node, ast.Constant) and node.value in SURFACES
    }
    assert users == {"softground_addon/core/ground/surfaces.py"}


def test_only_compat_reads_blenders_version():
    readers = {
        path
        for path, nodes in CODE.items()
        for node in nodes
        if isinstance(node, ast.Attribute) and node.attr.startswith("version") and ast.unparse(node.value) == "bpy.app"
    }
    assert readers == {"softground_addon/blender/compat.py"}


def test_an_attribute_or_property_of_blenders_data_is_named_once():
    """Within a package that is: points of debris and vertices of the ground each have a start."""
    said = Counter(
        (path.rpartition("/")[0], node.value)
        for path, nodes in CODE.items()
        for node in nodes
        if isinstance(node, ast.Constant) and str(node.value).startswith("softground_") and " " not in node.value
    )
    assert said
    assert {name: times for name, times in said.items() if times > 1} == {}


def test_few_functions_take_a_scene_and_none_takes_one_beside_a_snapshot_which_knows_it():
    signatures = {
        f"{path}:{node.lineno} {node.name}": {
            argument.arg: ast.unparse(argument.annotation or ast.Constant("")) for argument in taken
        }
        for path, nodes in CODE.items()
        for node in nodes
        if isinstance(node, ast.FunctionDef)
        for taken in [(*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
    }
    taking = {
        name: [*kinds.values()]
        for name, kinds in signatures.items()
        if "scene" in kinds or "bpy.types.Scene" in kinds.values()
    }
    assert 50 < len(taking) <= 100
    assert [name for name, kinds in taking.items() if "BakeSettings" in kinds] == []
