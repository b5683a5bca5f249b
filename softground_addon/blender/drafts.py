"""Data-blocks that are made for the user's file: if making them fails, none stays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

_KINDS = ("objects", "meshes", "hair_curves", "collections", "node_groups", "materials", "images")


@contextmanager
def none_left_if_it_fails() -> Iterator[None]:
    """Remove all data-blocks that are made within if it ends in an error; a job must not yield within."""
    probe = bpy.data.meshes.new("SoftGround")  # identifiers grow with each new data-block
    first = probe.session_uid
    bpy.data.meshes.remove(probe)
    try:
        yield
    except BaseException:
        made = [block for kind in _KINDS for block in getattr(bpy.data, kind) if block.session_uid > first]
        bpy.data.batch_remove(made)
        raise
