"""The steps of a shot on hard floors, from which follows what marks weigh as steps on the soft ground are edited."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..ground import surfaces
from ..ground.surfaces import CarriedFilm
from ..numerics.arrays import Array
from ..record.record import EditableStep
from .film import CarriedMass, Meeting, carry


@dataclass(frozen=True)
class SoleOnFloors:
    """The way of a sole over hard floors, whatever it carries.

    Attributes
    ----------
    of : (str, str)
        Character and sole.
    areas : (4,) float array
        Of its zones [m²].
    last_frame : float
        Of the shot.
    dirty : float
        Film as the shot starts, over the thickest.
    meetings : sequence of Meeting
        With hard floors, in the order of time.
    marks : sequence of int
        Number of the mark that each of these leaves; -1 of none.
    """

    of: tuple[str, str]
    areas: Array
    last_frame: float
    dirty: float
    meetings: tuple[Meeting, ...]
    marks: tuple[int, ...]


@dataclass(frozen=True)
class FloorSteps:
    """Steps of all soles on hard floors: what they leave follows from these and the steps on soft ground.

    Attributes
    ----------
    kind, ground : str
        What they carry, and what the ground is made of where a step does not say.
    soles : sequence of SoleOnFloors
    scaled : (float, float)
        As of `CarriedFilm.scaled`.
    """

    kind: str
    ground: str
    soles: tuple[SoleOnFloors, ...]
    scaled: tuple[float, float] = (1.0, 1.0)

    @property
    def carried(self) -> CarriedFilm:
        """The film that sticks."""
        usual = surfaces.sticking(self.kind).carried
        assert usual is not None
        return usual.scaled(*self.scaled)

    def films(self, steps: Sequence[EditableStep], shed: Mapping[int, float]) -> tuple[dict[int, Array], CarriedMass]:
        """The film (4,) of which each mark takes its share [kg/m²], and all that is carried.

        Parameters
        ----------
        steps : sequence of EditableStep
            On the soft ground, as the artist leaves them.
        shed : mapping of int to float
            Volume that each sheds in the air, by its number [m³].
        """
        carried = self.carried
        films: dict[int, Array] = {}
        booked = CarriedMass()
        for sole in self.soles:
            soft = [(meeting, -1) for meeting in self.soft_meetings(sole, steps, shed)]
            all_ = sorted([*soft, *zip(sole.meetings, sole.marks, strict=True)], key=lambda each: each[0].frame)
            giving, of_sole = carry([meeting for meeting, _ in all_], carried, sole.areas, sole.dirty)
            films |= {number: film for (_, number), film in zip(all_, giving, strict=True) if number >= 0}
            booked += of_sole
        return films, booked

    def soft_meetings(
        self, sole: SoleOnFloors, steps: Sequence[EditableStep], shed: Mapping[int, float]
    ) -> Iterator[Meeting]:
        """A sole as it leaves soft ground of the kind, which it does not with a last step that goes on to the end."""
        density = surfaces.sticking(self.kind).density
        for step in steps:
            if step.footprint is None or step.is_copy or (step.footprint.character, step.footprint.sole) != sole.of:
                continue
            if (step.footprint.surface or self.ground) == self.kind and step.footprint.end_frame < sole.last_frame:
                yield Meeting(step.footprint.end_frame, shed=shed.get(step.index, 0.0) * density)

    def with_films(self, table: Sequence[Mapping[str, Any]], steps: Sequence[EditableStep]) -> list[dict[str, Any]]:
        """Events with what soles bring to hard floors, as `events.COLUMNS` have it."""
        carried = self.carried
        films, _ = self.films(steps, {})
        rows = [{"carried": "", "film": 0.0, **row} for row in table]
        for sole in self.soles:
            frames = np.array([meeting.frame for meeting in sole.meetings])
            thickest = [
                films[number].max() / carried.most if number >= 0 else float(meeting.shares is None)
                for number, meeting in zip(sole.marks, sole.meetings, strict=True)
            ]
            for row in rows:
                at = int(np.searchsorted(frames, row["frame"] + 1.0)) - 1  # it begins within a step of the solver
                is_here = row["surface"] == surfaces.HARD and (row["character"], row["contact"]) == sole.of
                if is_here and at >= 0 and thickest[at]:
                    row.update(carried=carried.kind, film=round(float(thickest[at]), 4))
        return rows
