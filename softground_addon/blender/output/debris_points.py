"""Debris as plain points, each where it is at the frame, for files of other programs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from .. import compat
from ..debris import debris_nodes as nodes
from ..debris import debris_object
from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import new_group


@contextmanager
def selected(ground: bpy.types.Object, *, clouds: bool) -> Iterator[None]:
    """Debris of a ground's bake as a selected object of points of the open scene, which is removed afterwards.

    Parameters
    ----------
    clouds : bool
        True if the format takes point clouds, which have a `radius`. Else they are the vertices of a mesh.
    """
    debris = debris_object.of(ground)
    if debris is None:
        yield
        return
    clouds = clouds and compat.WRITES_CLOUDS
    points: Any = (bpy.data.pointclouds if clouds else bpy.data.meshes).new(f"{ground.name} Debris")
    obj, group = bpy.data.objects.new(points.name, points), _group(debris, clouds)
    try:
        modifier: Any = obj.modifiers.new(group.name, "NODES")
        modifier.node_group = group
        bpy.context.scene.collection.objects.link(obj)
        obj.select_set(True)
        yield
    finally:
        bpy.data.objects.remove(obj)
        (bpy.data.pointclouds if clouds else bpy.data.meshes).remove(points)
        bpy.data.node_groups.remove(group)


def _group(debris: bpy.types.Object, clouds: bool) -> Any:
    """Nodes that give the points of an object and of its instances."""
    graph = NodeGraph(new_group("SoftGround Debris Points", nodes.MARK))
    source = graph.node("GeometryNodeObjectInfo", {"Object": debris}, transform_space="RELATIVE")
    parts = graph.node("GeometryNodeSeparateComponents", {"Geometry": source.outputs["Geometry"]})
    of_pieces = {"Instances": parts.outputs["Instances"], "Radius": graph.attribute(nodes.RADIUS)}
    pieces = graph.node("GeometryNodeInstancesToPoints", of_pieces)
    joined = graph.node("GeometryNodeJoinGeometry")
    graph.link(parts.outputs["Point Cloud"], joined.inputs["Geometry"])
    graph.link(pieces.outputs["Points"], joined.inputs["Geometry"])
    geometry = graph.forgotten(joined.outputs["Geometry"], nodes.FLIGHT, nodes.RANK)
    if not clouds:
        geometry = graph.node("GeometryNodePointsToVertices", {"Points": geometry}).outputs["Mesh"]
    graph.finish(geometry)
    return graph.tree
