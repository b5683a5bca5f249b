"""Plugin of mypy, which `make types` runs: what the stubs of Blender cannot say, or get wrong.

An annotation `height: FloatProperty(...)` declares a property, which reads as a number. Blender's own types have the
attributes that the add-on registers. Some of what the stubs call optional is always there, and a look-up in a
collection mostly finds an item.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import cast

from mypy.fastparse import parse_type_string
from mypy.maptype import map_instance_to_supertype
from mypy.nodes import MDEF, AssignmentStmt, MypyFile, SymbolTableNode, Var
from mypy.plugin import AttributeContext, ClassDefContext, MethodContext, Plugin
from mypy.semanal import SemanticAnalyzer
from mypy.typeops import make_simplified_union
from mypy.types import AnyType, Instance, RawExpressionType, Type, TypeOfAny, get_proper_type
from mypy.types_utils import remove_optional

READ_AS = {
    "BoolProperty": "bool",
    "IntProperty": "int",
    "FloatProperty": "float",
    "StringProperty": "str",
    "PointerProperty": "{}",
    "CollectionProperty": "bpy.types.bpy_prop_collection_idprop[{}]",
}
"""Types that properties read as, by the function of bpy.props; {} is its option `type`. Others read as Any."""

DATA_BLOCKS = "bpy.types."
"""Pointers to these, which a user chooses, are read as Any: polls and checks have seen to it that they are not None."""

REGISTERED = {
    "bpy.types.Scene": {"softground": "softground_addon.blender.properties.scene.SoftGroundSettings"},
    "bpy.types.WindowManager": {"softground": "softground_addon.blender.session.SoftGroundSession"},
    "bpy.types.Material": {"softground_preset": "builtins.str"},
}
"""Attributes that `registration` adds to Blender's types."""

COLLECTION = "bpy.types.bpy_prop_collection"

ALWAYS_THERE = {
    *(f"bpy.types.Context.{name}" for name in ("collection", "preferences", "scene", "view_layer", "window_manager")),
    "bpy.types.ID.original",
    "bpy.types.Menu.layout",
    "bpy.types.Panel.layout",
}
"""What the stubs call optional, as each pointer, and Blender always has."""


@cache
def _properties(path: str) -> dict[int, str]:
    """Types of what is read of the properties that a module declares, by line; empty where it is read as Any."""
    types = {}
    for node in ast.walk(ast.parse(Path(path).read_bytes())):
        if isinstance(node, ast.AnnAssign) and isinstance(node.annotation, ast.Call):
            declared = next((ast.unparse(each.value) for each in node.annotation.keywords if each.arg == "type"), "")
            read = READ_AS.get(ast.unparse(node.annotation.func).rpartition(".")[2], "")
            types[node.lineno] = "" if declared.startswith(DATA_BLOCKS) else read.format(declared)
    return types


def _declare_properties(context: ClassDefContext) -> None:
    analyzer = cast(SemanticAnalyzer, context.api)
    for statement in context.cls.defs.body:
        if not (isinstance(statement, AssignmentStmt) and isinstance(statement.type, RawExpressionType)):
            continue
        read = _properties(analyzer.cur_mod_node.path).get(statement.line)
        if read is not None:
            kind: Type = AnyType(TypeOfAny.explicit)
            if read:
                kind = parse_type_string(read, "builtins.str", statement.line, statement.column)
            statement.type = statement.unanalyzed_type = kind


def _add_registered(context: ClassDefContext) -> None:
    for name, kind in REGISTERED[context.cls.fullname].items():
        known = context.api.named_type_or_none(kind)
        if known is None and not context.api.final_iteration:
            context.api.defer()
        variable = Var(name, known or AnyType(TypeOfAny.from_error))
        variable.info = context.cls.info
        variable._fullname = f"{context.cls.fullname}.{name}"
        context.cls.info.names[name] = SymbolTableNode(MDEF, variable, plugin_generated=True)


def _item_or_default(context: MethodContext) -> Type:
    """Type of `collection.get(...)`, of which the stubs forget that it is mostly an item."""
    of = get_proper_type(context.type)
    bases = of.type.mro if isinstance(of, Instance) else ()
    items = [map_instance_to_supertype(of, base).args[0] for base in bases if base.fullname == COLLECTION]
    return make_simplified_union([*items, context.default_return_type])


class Blender(Plugin):
    """What mypy asks of this plugin, class by class."""

    def get_customize_class_mro_hook(self, fullname: str) -> Callable[[ClassDefContext], None] | None:
        if fullname in REGISTERED:
            return _add_registered
        return _declare_properties if fullname.startswith("softground_addon.blender.") else None

    def get_attribute_hook(self, fullname: str) -> Callable[[AttributeContext], Type] | None:
        return (lambda context: remove_optional(context.default_attr_type)) if fullname in ALWAYS_THERE else None

    def get_method_hook(self, fullname: str) -> Callable[[MethodContext], Type] | None:
        return _item_or_default if fullname.startswith("bpy.types.") and fullname.endswith(".get") else None

    def get_additional_deps(self, file: MypyFile) -> list[tuple[int, str, int]]:
        if file.fullname != "bpy.types":
            return []
        modules = {kind.rpartition(".")[0] for names in REGISTERED.values() for kind in names.values()}
        return [(10, module, -1) for module in modules]


def plugin(_version: str) -> type[Plugin]:
    """The plugin, as mypy asks for it."""
    return Blender
