"""SoftGround: ground that gives way under animated characters.

`core` is the physics (numpy only), `blender` is everything that touches bpy. Nothing here imports bpy before
`register()`, so that `softground_addon.core` works without Blender.

Enabling the add-on runs few of its modules. While it registers, `from . import module` imports one that runs when
something of it is used first, so what Blender registers imports what it works with as modules; `from .module import
name` runs it at once.
"""

import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any


class _NotYetRun(ModuleType):
    """A module that runs once something of it is used, but for `__dict__` and its like: Blender looks for them in all
    modules as it quits."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        before = dict(vars(self))
        self.__class__ = ModuleType  # type: ignore[assignment]
        try:
            self.__loader__.exec_module(self)  # type: ignore[union-attr]
        except BaseException:  # Python would forget the module; this is known to others, and runs anew for the next
            vars(self).clear()
            vars(self).update(before)
            self.__class__ = _NotYetRun
            raise
        return getattr(self, name)


class _AtFirstUse:
    """Finder and loader of the add-on's own modules as they will be."""

    def __init__(self, loader: Any) -> None:
        self._loader = loader

    @classmethod
    def find_spec(cls, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> Any:
        """Specification of a module of the add-on, which is no package, as Python finds it; None of any other."""
        if not name.startswith(f"{__package__}."):
            return None
        finders = [finder for finder in sys.meta_path if finder is not cls and hasattr(finder, "find_spec")]
        spec: Any = next(filter(None, (finder.find_spec(name, path, target) for finder in finders)), None)
        if spec is None or spec.submodule_search_locations:
            return None
        spec.loader = cls(spec.loader)
        return spec

    @staticmethod
    def create_module(_spec: Any) -> None:
        """Have the import make it."""

    def exec_module(self, module: Any) -> None:
        """Leave it for later."""
        module.__loader__ = module.__spec__.loader = self._loader
        module.__class__ = _NotYetRun


def register() -> None:
    """Register the add-on's classes, properties and command with Blender."""
    sys.meta_path.insert(0, _AtFirstUse)
    try:
        from .blender.registration import register as register_everything

        register_everything()
    finally:
        sys.meta_path.remove(_AtFirstUse)


def unregister() -> None:
    """Undo `register()`, in reverse order."""
    from .blender.registration import unregister as unregister_everything

    unregister_everything()
