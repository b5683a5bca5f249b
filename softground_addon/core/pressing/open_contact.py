"""A contact that goes on: the imprints to come, and the sums and the record of what was pressed."""

from __future__ import annotations

import numpy as np

from ..ground.heightfield import Surface
from ..ground.material import GroundMaterial
from ..ground.sparse_grid import SparseGrid
from ..record.contact_steps import ContactSteps
from ..record.footprints import Footprint, FootprintRecorder
from .contact_layout import ContactLayout
from .ground_cells import GroundCells, Imprints, Timing


class OpenContact:
    """One contact as the solver presses it.

    Parameters
    ----------
    earlier : OpenContact, optional
        The contact that this one goes on from without leaving the ground, where a long track is cut into several.
    pressed_by : ContactSteps, optional
        What its footprint keeps of it.
    laid_out : dict, optional
        The imprints that the layout gave on this ground when it was pressed before, by their steps; what is
        missing is added.

    Attributes
    ----------
    recorder : FootprintRecorder or None
        None until something is pressed.
    compression : SparseGrid or None
        What it compressed itself [m], kept where the ground hardens.
    material : GroundMaterial or None
        That bore it last.
    met : Imprints or None
        Those of which it was last seen what weather had left there.
    surface : Surface or None
        The undisturbed ground around it, where it slides.
    met_since : float
        Scene frame before it began, whose open ground it meets.
    compressed, raised, unplaced : float
        Volumes that it compressed and raised, and that found no place to rise [m³].
    """

    def __init__(
        self,
        layout: ContactLayout,
        earlier: OpenContact | None = None,
        pressed_by: ContactSteps | None = None,
        laid_out: dict[tuple[int, int], Imprints] | None = None,
    ) -> None:
        self.layout, self.earlier, self.pressed_by = layout, earlier, pressed_by
        self.recorder: FootprintRecorder | None = None
        self.compression: SparseGrid | None = None
        self.material: GroundMaterial | None = None
        self.met: Imprints | None = None
        self.surface: Surface | None = None
        self.met_since = 0.0
        self.compressed = self.raised = self.unplaced = 0.0
        self._load = self._area = self._sinkage = 0.0
        self._moment = np.zeros(3)
        self._borne: dict[str, float] = {}
        self._imprints: Imprints | None = None
        self._laid_out = laid_out

    def imprints(self, start: int, end: int, cells: GroundCells, timing: Timing) -> Imprints:
        """The imprints of steps that follow those pressed last, among others."""
        imprints = self._imprints
        if imprints is None or imprints.end < end:
            if imprints is not None:
                self._sinkage = imprints.reached
            imprints = self._laid_out.get((start, end)) if self._laid_out is not None else None
            if imprints is None:
                imprints = self.layout.lay_out(start, end, cells, timing, self._sinkage)
            if self._laid_out is not None:
                self._laid_out[start, end] = imprints
            self._imprints = imprints
        return imprints

    @property
    def area(self) -> float:
        """Largest area of contact so far [m²]."""
        return self._area

    @property
    def made_of(self) -> str:
        """Surface that bore most of it so far, where the ground has regions; else empty."""
        return max(self._borne, key=lambda surface: self._borne[surface], default="")

    def add_loads(self, imprints: Imprints, first: int, last: int) -> None:
        """Add the loads of some of the imprints, which were pressed."""
        force = imprints.loads.force[first:last]
        load = float(force.sum())
        self._load += load
        self._borne[imprints.made_of] = self._borne.get(imprints.made_of, 0.0) + load
        self._moment += force @ imprints.loads.middle[first:last]
        self._area = max(self._area, float(imprints.loads.area[first:last].max(initial=0.0, where=force > 0)))

    def footprint(self) -> Footprint:
        """The record of what was pressed so far."""
        if self.recorder is None:
            raise ValueError("a contact that pressed nothing leaves no footprint")
        layout = self.layout
        frames, hardest = layout.steps.frames, int(layout.force.argmax())
        return self.recorder.footprint(
            character=layout.character,
            sole=layout.sole.name,
            start_frame=float(frames[0]),
            end_frame=float(frames[-1]),
            position=self._moment / self._load,
            heading=layout.heading(hardest),
            area_m2=self._area,
            peak_force_n=float(layout.force[hardest]),
            compressed_m3=self.compressed,
            rim_m3=self.raised,
            unplaced_rim_m3=self.unplaced,
            load_frames=frames,
            load_n=layout.force,
            pressed_by=self.pressed_by,
            surface=self.made_of,
        )
