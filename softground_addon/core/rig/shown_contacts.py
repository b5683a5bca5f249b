"""Contacts of a body that its skin shows: which bones carry them, and whether they print by all sides."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..numerics.rigid import unit
from ..numerics.slices import Slices, sliced
from ..skin.contacts import SkinContacts, find_contacts
from .bones import RigBones
from .mapping import SoleSource
from .recording import Recording
from .rig_skin import FollowedSkin, RigSkin, followed_skin
from .skin_stances import UNDERSIDE

TURNED = 50.0
"""A contact whose bone leans farther than this from how it mostly bears prints by other sides too [°]."""

TURNED_SHARE = 0.2
"""Share of the bearing time for which it does."""


@sliced
def shown_by_skin(bones: RigBones, skin: RigSkin, recording: Recording) -> Slices[tuple[SoleSource, ...]]:
    """The contacts that the skin shows.

    Parameters
    ----------
    recording : Recording
        Of all `skin.bones`.
    """
    followed = yield from followed_skin.slices(skin, bones, recording, recording.units.frame_rate, linked=True)
    if followed is None:
        return ()
    contacts = yield from find_contacts.slices(followed.motion)
    bearing = np.flatnonzero(contacts.bears.any(axis=0))
    sources = (_source(number, contacts, followed, recording) for number in bearing)
    return tuple(source for source in sources if source)


def _source(number: int, contacts: SkinContacts, followed: FollowedSkin, recording: Recording) -> SoleSource | None:
    """One contact, carried by the bone with most of the skin that bears; None where no bone carries it."""
    parts = np.flatnonzero((contacts.group == number) & np.array([*map(bool, followed.bones)]))
    if not len(parts):
        return None
    bears = contacts.bears[:, number]
    height = followed.motion.positions[bears][..., 2] - contacts.floor[bears, number, None]
    low = (np.abs(height) < UNDERSIDE * followed.motion.height).sum(axis=0)
    weight = np.bincount(followed.motion.part, low, len(followed.bones))
    bones = [followed.bones[part] for part in parts]
    main = followed.bones[int(parts[weight[parts].argmax()])]
    return SoleSource(main, "", main, limb=_turns(recording, main, bears), parts=tuple(bones))


def _turns(recording: Recording, bone: str, bears: NDArray[np.bool_]) -> bool:
    """True if a bone bears in attitudes that differ much."""
    axes = unit(np.swapaxes(recording.bone(bone)[bears, :3, :3], -1, -2)[..., 2])
    usual = unit(np.median(axes, axis=0))
    return bool((axes @ usual < np.cos(np.radians(TURNED))).mean() > TURNED_SHARE)
