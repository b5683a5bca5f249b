"""How each surface sounds under a foot: what is excited, in which bands, and for how long.

References
----------
Cook 2002, "Modeling Bill's Gait: analysis and parametric synthesis of walking sounds", AES 22nd conference.
Fontana and Bresin 2003, "Physics-based sound synthesis and control: crushing, walking and running by crumpling sounds",
14th Colloquium on Musical Informatics: Poisson processes of micro-impacts, whose energies follow a power law.
Cook 1997, "Physically informed sonic modeling (PhISM): synthesis of percussive sounds", Computer Music Journal 21,
doi:10.2307/3681012: how often particles collide. What his *crunch* of snow does is 7 in 1024 samples: 150 each second
at 22 kHz, 300 at 44 kHz.
Turchet, Serafin, Dimitrov and Nordahl 2010, "Physically based sound synthesis and control of footsteps sounds",
13th Conference on Digital Audio Effects.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Voice:
    """A surface's sound.

    Attributes
    ----------
    crackle, noise, thump, pop : float
        Loudness of its parts: micro-impacts, grains that slide, the heel on packed ground, the foot that leaves mud.
    crackle_band : (float, float)
        Between which the resonances of micro-impacts lie [Hz].
    crackle_decay : (float, float)
        Between which their decay times lie [s].
    density : float
        Micro-impacts for each litre that is compacted.
    gamma : float
        Energies of micro-impacts follow E^-gamma.
    noise_band : (float, float)
        Of what slides [Hz].
    thump_pitch : (float, float)
        Between which the thump of a heel lies [Hz].
    """

    crackle: float
    noise: float
    thump: float
    pop: float
    crackle_band: tuple[float, float]
    crackle_decay: tuple[float, float]
    density: float
    gamma: float
    noise_band: tuple[float, float]
    thump_pitch: tuple[float, float]


VOICES = {
    "snow": Voice(1.0, 0.25, 0.3, 0.0, (1000.0, 4000.0), (0.0015, 0.004), 220.0, 1.5, (1500.0, 6000.0), (80.0, 150.0)),
    "sand": Voice(0.0, 1.0, 0.25, 0.0, (2000.0, 6000.0), (0.0005, 0.001), 0.0, 1.5, (1200.0, 7000.0), (60.0, 110.0)),
    "wet_sand": Voice(
        0.25, 0.7, 0.5, 0.15, (800.0, 3000.0), (0.001, 0.003), 200.0, 1.6, (600.0, 3500.0), (70.0, 120.0)
    ),
    "mud": Voice(0.3, 0.6, 0.5, 0.8, (250.0, 900.0), (0.004, 0.012), 60.0, 1.8, (150.0, 1200.0), (60.0, 100.0)),
    "soil": Voice(0.9, 0.35, 0.45, 0.0, (500.0, 3000.0), (0.002, 0.007), 500.0, 1.3, (400.0, 2500.0), (70.0, 140.0)),
}
"""By surface; see `core.ground.presets.SURFACES`."""
