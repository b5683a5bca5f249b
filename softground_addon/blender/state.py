"""Memory of the add-on from one call to the next, all of it: never saved with a file and no part of undo."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary


@dataclass
class State:
    """State of what runs, and cached results. Scenes, objects and images are known by session uid.

    Attributes
    ----------
    is_baking, progress, status, is_previewing, also_chosen
        What the panel shows of a bake; see `session`. Writing a property has Blender draw the whole window anew, scene
        and all, which takes longer than many a step of a bake; this does not.
    pressing : session.Pressing or None
        Prints of the bake that goes on in a window.
    picking, under, edits, box
        What the viewport outlines beside the chosen step, while steps are picked and dragged.
    live_ended : str
        Reason why live mode has ended by itself.
    jobs : list of ModalJob
        Those that run in a window.
    hooks : dict
        Functions of the floors above that settings call: `follow_look` of a scene whose look is another;
        `show_...` and `type_...` of fields that nothing stores, such as the depth.
    analyses : dict
        Shot of each scene, as it was read.
    parted : tuple or None
        Settings that were taken apart last, and their parts: panels and overlay ask for the same at each drawing.
    depths : dict
        Predicted depths, by identity of an analysis' contacts; emptied with it.
    shown_depths : dict
        Depth that was shown last for each scene [m].
    aims : dict
        Depth that was typed in each scene.
    predicting : list of jobs
        Depths that are being worked out.
    refining : list of jobs
        Depths that are being worked out from all contacts.
    seen : dict
        Settings and prediction that the panel or overlay that asked first found in each scene; the others are drawn in
        the same turn, in which nothing changes any more.
    compared : dict
        Settings that each scene's bake was compared with last.
    outlines : mapping
        Footfalls of an analysis, as the overlay draws them.
    shown_bake : dict
        Bake that was shown last, by its mesh and what tells its record from others.
    seen_prints : set
        Scenes whose first bake was shown in the view.
    presets : dict
        Preset files that were read, each with the time at which it was written [ns]: a panel asks at each drawing.
    preset_choices : list
        Presets as the menu of a material slot lists them.
    pictures : ImagePreviewCollection or None
        Of presets, by their paths; None until the first is asked for.
    existing : dict
        Number of users of each object when it was last looked for in the collections, and True if it was in one. Going
        through the collections takes too long to be done in `draw`; who leaves one has a user less.
    results : dict
        Results by kind and name, after a hash of all that they follow from and before their size; see `reuse`.
    tread_maps : dict
        Maps as text by image and file; empty of those that cannot be read.
    catalogues : dict
        Translations by context and English text, of each language that Blender's interface has had.
    """

    is_baking: bool = False
    progress: float = 0.0
    status: str = ""
    is_previewing: bool = False
    pressing: Any = None
    also_chosen: tuple[str, ...] = ()
    picking: bool = False
    under: str = ""
    edits: Mapping[str, Any] = field(default_factory=dict)
    box: Sequence[tuple[int, int]] = ()
    live: Any = None
    live_ended: str = ""
    jobs: list[Any] = field(default_factory=list)
    hooks: dict[str, Callable[..., Any]] = field(default_factory=dict)
    analyses: dict[int, Any] = field(default_factory=dict)
    parted: Any = None
    depths: dict[Any, float] = field(default_factory=dict)
    shown_depths: dict[int, float] = field(default_factory=dict)
    aims: dict[int, Any] = field(default_factory=dict)
    predicting: list[Any] = field(default_factory=list)
    refining: list[Any] = field(default_factory=list)
    seen: dict[int, Any] = field(default_factory=dict)
    compared: dict[int, Any] = field(default_factory=dict)
    outlines: WeakKeyDictionary[Any, Any] = field(default_factory=WeakKeyDictionary)
    shown_bake: dict[tuple[int, bytes], Any] = field(default_factory=dict)
    seen_prints: set[int] = field(default_factory=set)
    presets: dict[Path, Any] = field(default_factory=dict)
    preset_choices: list[tuple[str, str, str]] = field(default_factory=list)
    pictures: Any = None
    existing: dict[int, tuple[int, bool]] = field(default_factory=dict)
    results: dict[tuple[str, str], tuple[str, Any, int]] = field(default_factory=dict)
    tread_maps: dict[tuple[int, str], str] = field(default_factory=dict)
    catalogues: dict[str, dict[tuple[str, str], str]] = field(default_factory=dict)


state = State()


def forget() -> None:
    """Begin anew, as the add-on is switched off."""
    vars(state).update(vars(State()))
