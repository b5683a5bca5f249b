"""OpenSim's files: forces on the feet as storage (.mot, .sto), and the external loads that name them (.xml).

OpenSim's axes are y up; what is north of a character here is -z there.

References
----------
OpenSim documentation, "Motion (.mot) Files", "Storage (.sto) Files" and "External Loads" (Seth et al. 2018, "OpenSim",
10.1371/journal.pcbi.1006223).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import escape

import numpy as np

from ..errors import InputError
from ..numerics.arrays import Array

_BODIES = {"L": "calcn_l", "R": "calcn_r"}
"""Bodies of OpenSim's models that a left and a right foot press on."""


@dataclass(frozen=True)
class FootForce:
    """The force of the ground on one sole, Z up.

    Attributes
    ----------
    name : str
        Of the sole.
    side : str
        "L", "R" or "".
    force : (N, 3) float array
        [N]
    point : (N, 3) float array
        Where it acts [m].
    moment : (N,) float array
        Free moment about the upward axis through that point [N·m].
    """

    name: str
    side: str
    force: Array
    point: Array
    moment: Array

    @property
    def identifier(self) -> str:
        """Prefix of its columns: letters, digits and underscores.

        Examples
        --------
        >>> FootForce("foot.L", "L", np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1)).identifier
        'ground_foot_L'
        """
        return "ground_" + "".join(letter if letter.isalnum() else "_" for letter in self.name)


def storage(name: str, time: Array, feet: Sequence[FootForce]) -> str:
    """A storage file: time, and force, point and free moment of each sole.

    Parameters
    ----------
    name : str
        Of the table, in its first line.
    time : (N,) float array
        [s]
    """
    labels, columns = ["time"], [time[:, None]]
    for foot in feet:
        point = np.where(np.isfinite(foot.point), foot.point, 0.0)
        upward = foot.moment[:, None] * (0.0, 0.0, 1.0)
        for kind, values in (("v", foot.force), ("p", point), ("m", upward)):
            labels += [f"{foot.identifier}_{kind}{axis}" for axis in "xyz"]
            columns.append(_y_up(values))
    table = np.concatenate(columns, axis=1)
    head = [name, "version=1", f"nRows={len(table)}", f"nColumns={len(labels)}", "inDegrees=yes", "endheader"]
    rows = ["\t".join(f"{value:.6f}" for value in row) for row in table.tolist()]
    return "\n".join([*head, "\t".join(labels), *rows, ""])


def loads_beside(table: Path) -> Path | None:
    """Name of the external loads beside a table of forces; None beside a .sto, which has none.

    Raises
    ------
    InputError
        If a file has that name and is no external loads of that table.
    """
    if table.suffix.lower() != ".mot":
        return None
    loads = table.with_suffix(".xml")
    if loads.exists() and f"<datafile>{escape(table.name)}<" not in loads.read_text("utf-8", errors="replace"):
        raise InputError(
            f"'{loads.name}' is there already and is no external loads of '{table.name}', which are written beside it: "
            "choose another name, or move that file.",
            "file_exists",
            path=loads,
        )
    return loads


def external_loads(name: str, storage_file: str, feet: Sequence[FootForce]) -> str:
    """The external loads that apply a storage file to the feet of a model; soles of no side to bodies of their name."""
    document = ElementTree.Element("OpenSimDocument", Version="40000")
    loads = ElementTree.SubElement(document, "ExternalLoads", name=name)
    objects = ElementTree.SubElement(loads, "objects")
    for foot in feet:
        force = ElementTree.SubElement(objects, "ExternalForce", name=foot.identifier)
        for tag, text in (
            ("applied_to_body", _BODIES.get(foot.side, foot.name)),
            ("force_expressed_in_body", "ground"),
            ("point_expressed_in_body", "ground"),
            ("force_identifier", f"{foot.identifier}_v"),
            ("point_identifier", f"{foot.identifier}_p"),
            ("torque_identifier", f"{foot.identifier}_m"),
        ):
            ElementTree.SubElement(force, tag).text = text
    ElementTree.SubElement(loads, "groups")
    ElementTree.SubElement(loads, "datafile").text = storage_file
    ElementTree.indent(document, "\t")
    return '<?xml version="1.0" encoding="UTF-8" ?>\n' + ElementTree.tostring(document, encoding="unicode") + "\n"


def _y_up(vectors: Array) -> Array:
    """Vectors (N, 3) in OpenSim's axes."""
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)
