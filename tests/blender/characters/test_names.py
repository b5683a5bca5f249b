"""Names that modules take from each other: the type checker knows too little of bpy to look at them in `blender`."""

import ast
import importlib
import pkgutil
from pathlib import Path
from types import ModuleType

import pytest

from softground_addon import blender

MODULES = sorted(module.name for module in pkgutil.walk_packages(blender.__path__, f"{blender.__name__}."))


@pytest.mark.parametrize("name", MODULES)
@pytest.mark.usefixtures("addon")
def test_what_is_taken_from_another_module_is_there(name):
    module = importlib.import_module(name)
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    taken = {
        (node.value.id, node.attr)
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
    }
    ours = {key: value for key, value in vars(module).items() if isinstance(value, ModuleType)}
    missing = [f"{owner}.{attr}" for owner, attr in taken if owner in ours and not hasattr(ours[owner], attr)]
    assert missing == []
