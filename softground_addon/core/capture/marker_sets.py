"""Place of each marker on the body, by the names that laboratories give them.

The words are those of Plug-in Gait and CGM2 (Vicon), the OpenSim models of Delp and of Rajagopal, OpenCap, the
anatomical names of Qualisys and the ISB, and the joint centres of markerless capture (Theia, Pose2Sim, OpenPose).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

SIDED: Mapping[str, tuple[str, ...]] = {
    "asis": ("asi", "asis", "ias"),
    "psis": ("psi", "psis", "ips"),
    "hip": ("hjc", "hip", "hipjc", "hipjoint", "hipcenter"),
    "knee": ("kjc", "kneejc", "kneejoint", "kneecenter"),
    "knee outer": ("kne", "kneelat", "latknee", "kneelateral", "fle", "lfc", "lfe", "klat", "knel", "lek"),
    "knee inner": ("knm", "kneemed", "medknee", "kneemedial", "fme", "mfc", "mfe", "mknee", "mkne", "kmed", "mek"),
    "ankle": ("ajc", "anklejc", "anklejoint", "anklecenter"),
    "ankle outer": ("ank", "anklelat", "latankle", "anklelateral", "fal", "lmal", "lm", "amlat", "lma"),
    "ankle inner": ("med", "anm", "anklemed", "medankle", "anklemedial", "tam", "mmal", "mm", "mankle", "mank", "mma"),
    "heel": ("hee", "heel", "fcc", "cal", "calc", "calcaneus"),
    "toe": ("toetip", "bigtoe", "hallux", "hlx", "hal", "toeend"),
    "ball": (
        "mt1", "fm1", "met1", "1meta", "d1m", "mth1", "mt2", "fm2", "met2", "2meta", "mth2", "mt5", "fm5", "met5",
        "5meta", "d5m", "mth5", "toemed", "toelat", "smalltoe", "5mth", "1mth", "2mth", "ball",
    ),
    "shoulder": ("sjc", "shoulderjc", "shoulderjoint", "shouldercenter"),
    "acromion": ("acr", "acromion", "acromium", "sho", "sae", "acro"),
    "elbow": ("ejc", "elbowjc", "elbowjoint", "elbowcenter"),
    "elbow outer": ("elb", "lel", "hle", "lelbow", "elblat", "elbl", "elbowlat"),
    "elbow inner": ("mel", "hme", "melbow", "elbmed", "elbm", "elbowmed", "elbmed"),
    "wrist": ("wjc", "wristjc", "wristjoint", "wristcenter"),
    "wrist outer": ("wra", "wristlat", "lwrist", "rsp", "faradius", "rad", "wristrad"),
    "wrist inner": ("wrb", "wristmed", "mwrist", "usp", "faulna", "uln", "wristuln"),
    "head side": ("fhd", "bhd", "ear", "eye", "hdf", "hdb"),
}  # fmt: skip
"""Words of a marker's name without its side."""

MIDDLE: Mapping[str, tuple[str, ...]] = {
    "sacrum": ("sacr", "vsacral", "sacrum", "sac"),
    "hips": ("midhip", "pelvis", "hips", "root"),
    "c7": ("c7", "cv7"),
    "sternum": ("clav", "sjn", "sternum", "ster", "strn", "ij", "sxs"),
    "neck": ("neck",),
    "head": ("head", "tophead", "headtop", "nose", "vertex", "headfront", "headback"),
}
"""Words of markers in the middle of the body."""

_EITHER = {
    "knee": ("knee", "knee outer"),
    "ankle": ("ankle", "ankle outer"),
    "shoulder": ("shoulder", "acromion"),
    "elbow": ("elbow", "elbow outer"),
    "wrist": ("wrist", "wrist outer"),
}
"""Words that are a joint's centre in one convention and a marker on its outer side in another."""

_SIDE = re.compile(r"^(?:(right|left)|([rl]))[ ._-]*(.+)$|^(.+?)[ ._-]+(right|left|[rl])$")


def places_of(labels: Sequence[str]) -> dict[str, list[int]]:
    """Indices of the markers on each place, such as `knee outer.l`; those on no place that is known are left out.

    Examples
    --------
    >>> places_of(["Subject:LKNE", "R.Knee.Lat", "r_mknee_study", "C7"])
    {'knee outer.l': [0], 'knee outer.r': [1], 'knee inner.r': [2], 'c7': [3]}
    >>> places_of(["RKnee", "LBigToe", "head_top"])
    {'knee.r': [0], 'toe.l': [1], 'head': [2]}
    """
    on_skin = _marks_skin(labels)
    places: dict[str, list[int]] = {}
    for index, label in enumerate(labels):
        place = _place(label, on_skin=on_skin)
        if place:
            places.setdefault(place, []).append(index)
    return places


def _marks_skin(labels: Sequence[str]) -> bool:
    """True if markers are glued to the skin: then a plain "knee" is on its outer side and no joint centre."""
    return any((_place(label, on_skin=False) or "").startswith(("asis", "psis", "knee inner")) for label in labels)


def _place(label: str, *, on_skin: bool) -> str:
    """The place that a label names, empty for none."""
    name = re.sub(r"_study$", "", label.rsplit(":", 1)[-1].strip().lower())
    plain = re.sub(r"[^a-z0-9]", "", name)
    for place, words in MIDDLE.items():
        if plain in words:
            return place
    match = _SIDE.match(name)
    if match is None:
        return ""
    side = (match[1] or match[2] or match[5])[0]
    word = re.sub(r"[^a-z0-9]", "", match[3] or match[4])
    if word in _EITHER:
        return f"{_EITHER[word][on_skin]}.{side}"
    if word in ("toe", "toes", "foot"):
        return f"toe or ball.{side}" if word != "foot" else ""
    return next((f"{place}.{side}" for place, words in SIDED.items() if word in words), "")
