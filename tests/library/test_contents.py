"""What the library is made of imports nothing of the core but what the wheel holds, and NumPy."""

from __future__ import annotations

import ast
import sys

import pytest

from tests.library.contents import MODULES, ROOT

CORE = ROOT / "softground_addon" / "core"
PLOTS = {("plots.py", "matplotlib")}
"""Who may import what else, where it is there."""


def imported(path):
    """Modules that one imports: paths of the project's own, names of others."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.split(".")[0]
        elif isinstance(node, ast.ImportFrom):
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            for alias in node.names:
                inner = (base / alias.name).with_suffix(".py")
                module = inner if inner.exists() else base.with_suffix(".py")
                yield (module if module.exists() else base / "__init__.py").resolve()


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_it_imports_what_the_wheel_holds_and_numpy(path):
    for module in imported(path):
        if isinstance(module, str):
            assert module in sys.stdlib_module_names | {"numpy"} or (path.name, module) in PLOTS
        else:
            assert module in MODULES


def test_settings_are_not_among_them_so_that_the_test_can_fail():
    assert CORE / "settings.py" not in MODULES
    assert CORE / "settings.py" in set(imported(CORE / "composers" / "pressed_shot.py"))
