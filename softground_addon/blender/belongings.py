"""Objects that a bake puts beside its ground, known by their properties whatever the user calls them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from .settings import exists

AWAY = "softground_away"
"""Property of what is in no scene while its ground is deleted."""


@dataclass(frozen=True)
class Belonging:
    """A kind of object of which a ground has one.

    Attributes
    ----------
    mark : str
        Property by which the object, its node group and what else is ours are known.
    of_ground, of_object : str
        Properties of the ground, the object, and of the object, its ground.
    """

    mark: str
    of_ground: str
    of_object: str

    def of(self, ground: bpy.types.Object) -> bpy.types.Object | None:
        """The object of a ground's bake; none of a ground that is a duplicate."""
        obj = ground.get(self.of_ground)
        belongs = exists(obj) and obj.get(self.mark) and self.owner_of(obj) == ground
        return obj if belongs else None

    def owner_of(self, obj: bpy.types.Object) -> Any:
        """The ground whose bake made it."""
        return obj.get(self.of_object)

    def remaining(self, ground: bpy.types.Object, *, wanted: bool) -> bpy.types.Object | None:
        """The object that a new bake fills, if it wants one and there is one; others that the ground had are gone."""
        orphans = [obj for obj in bpy.data.objects if self._is_left_for(ground, obj)]
        older = (self.of(ground) or next(iter(orphans), None)) if wanted else None
        for owner in {ground, *map(self.owner_of, orphans)}:
            if owner.get(self.of_ground) != older:
                self.remove(owner)
        return older

    def give(self, ground: bpy.types.Object, obj: bpy.types.Object) -> None:
        """Let a ground have an object, which comes into its collections."""
        if before := self.owner_of(obj):
            before.pop(self.of_ground, None)
        obj[self.mark], obj[self.of_object], ground[self.of_ground] = True, ground, obj
        if not obj.users_collection:
            _link(obj, ground)

    def follow(self, ground: bpy.types.Object, *, is_deleted: bool) -> None:
        """Take it out of the scene while its ground is deleted, and back in after undo."""
        obj = ground.get(self.of_ground)
        if obj is None or self.owner_of(obj) != ground:
            return
        if is_deleted and exists(obj):
            obj[AWAY] = True
            for collection in obj.users_collection:
                collection.objects.unlink(obj)
        elif not is_deleted and AWAY in obj.keys():  # noqa: SIM118  (an ID is no mapping)
            _link(obj, ground)

    def remove(self, ground: bpy.types.Object) -> None:
        """Take a ground's object away; nothing happens where there is none."""
        obj = ground.pop(self.of_ground, None)
        if obj is not None and obj.get(self.mark) and self.owner_of(obj) == ground:
            mesh: Any = obj.data
            bpy.data.objects.remove(obj)
            if mesh is not None and not mesh.users:
                bpy.data.meshes.remove(mesh)

    def _is_left_for(self, ground: bpy.types.Object, obj: bpy.types.Object) -> bool:
        """True for one that is away, or whose own ground was deleted; duplicates of it are the user's."""
        owner = self.owner_of(obj) if obj.get(self.mark) else None
        if owner is None or owner.get(self.of_ground) != obj:
            return False
        return not exists(owner) or (owner == ground and AWAY in obj.keys())  # noqa: SIM118  (an ID is no mapping)


def exchange(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> None:
    """Give an object a new mesh, under the name of its own; its materials, and all else the user did to it, stay."""
    old: Any = obj.data
    for material in old.materials:
        mesh.materials.append(material)
    name = old.name
    old.user_remap(mesh)  # also of linked duplicates
    bpy.data.meshes.remove(old)
    mesh.name = name


def _link(obj: bpy.types.Object, ground: bpy.types.Object) -> None:
    obj.pop(AWAY, None)
    for collection in ground.users_collection:
        collection.objects.link(obj)
