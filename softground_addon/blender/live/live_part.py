"""One of the grounds of live mode, with the simulation that it shows."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.composers.playhead import Playhead
from ...core.ground.sparse_grid import Window
from ...core.loads.estimate import CharacterLoads
from ...core.settings import BakeSettings, ObjectName
from .. import settings
from ..ground import baked_ground
from ..reading.shots import Shot, ground_of
from .live_ground import LiveGround


@dataclass
class LivePart:
    """A ground that follows the timeline.

    Attributes
    ----------
    owner : ObjectName
        The ground, which may be shown by a copy along the trail.
    ground : LiveGround
        Shows `playhead`.
    drawn_over : list of Window
        Where something else is shown at the moment.
    """

    owner: ObjectName
    ground: LiveGround
    playhead: Playhead
    drawn_over: list[Window] = field(default_factory=list)

    def number_in(self, wanted: BakeSettings) -> int:
        """Number of the ground among all of some settings, which have it."""
        return [name.uid for name in wanted.soft_grounds].index(self.owner.uid)

    def object(self, listed: Iterable[bpy.types.Object]) -> bpy.types.Object | None:
        """What shows the prints, of the listed grounds; None if it is gone or no longer as live mode made it."""
        ground = next((each for each in listed if each.session_uid == self.owner.uid), None)
        return self.ground.object(ground and baked_ground.display_mesh_of(ground))

    def go_to(self, obj: bpy.types.Object, frame: float, wanted: BakeSettings) -> None:
        """Show the ground on its object at a scene frame."""
        before = self.playhead.frame
        windows = self.playhead.go_to(frame)
        if self.playhead.frame != before:
            self.show(obj, windows, wanted)

    def show(self, obj: bpy.types.Object, windows: Sequence[Window], wanted: BakeSettings) -> None:
        """Show changes in some windows, and wherever something else was shown in the meantime."""
        sigma = wanted.of_each_ground[self.number_in(wanted)].material.blur_sigma
        self.ground.show(obj, self.playhead, [*windows, *self.drawn_over], sigma, wanted.frame_rate)
        self.drawn_over = []

    def show_anew(self, obj: bpy.types.Object, frame: float, wanted: BakeSettings) -> None:
        """Show the ground at a scene frame whatever the mesh shows at the moment."""
        self.ground.take_from(obj)
        self.playhead.go_to(frame)
        self.show(obj, self.playhead.ground.tile_windows(), wanted)

    def pressing_newest(
        self,
        listed: Callable[[], Iterable[bpy.types.Object]],
        asked: BakeSettings,
        shot: Shot,
        loads: Sequence[CharacterLoads],
    ) -> Generator[None]:
        """Show the newest steps as they will be, on a ground that is still listed; nothing where they are most."""
        since, shown = self.playhead.before_newest(), self.playhead.frame
        if since - self.playhead.first_frame < shown - since:
            return
        number = self.number_in(asked)
        made_with, part = asked.of_each_ground[number], shot.of_each_ground[number]
        newest = self.playhead.pressed_anew(since, loads, ground_of(made_with, part))
        while newest.advance(shown):
            yield
        if obj := self.object(listed()):
            changed = [*self.playhead.changed_since(since), *newest.changed_since(since)]
            sigma = made_with.material.blur_sigma
            self.ground.show(obj, newest, [*changed, *self.drawn_over], sigma, asked.frame_rate)
            self.drawn_over = changed
            yield

    def take_over(self, whole: Playhead, obj: bpy.types.Object | None, wanted: BakeSettings) -> None:
        """Go on with a simulation by other settings, and show it."""
        windows = [*self.playhead.ground.tile_windows(), *whole.ground.tile_windows()]
        if whole.ground.cell_size != self.playhead.ground.cell_size:
            self.ground.forget_cells()
        self.playhead = whole
        if obj is not None:
            self.show(obj, windows, wanted)

    def check_writable(self) -> None:
        """Raise InputError if the ground is there and cannot be changed, as in Edit Mode."""
        if ground := self._ground():
            baked_ground.check_writable(ground)

    def discard(self) -> None:
        """Leave the ground as it was before."""
        if ground := self._ground():
            baked_ground.clear(ground)

    def _ground(self) -> bpy.types.Object | None:
        """The ground, or what showed its prints; None if both were deleted."""
        return settings.find(self.owner) or self.ground.object(None)


def touched(loads: Sequence[CharacterLoads]) -> bool:
    """True if soles touch a ground that bears these loads."""
    return any(bool(np.any(character.contacts.touching)) for character in loads)
