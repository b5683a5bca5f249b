"""Surfaces of grounds: one record for each, with all of its properties.

A new look is a record here, a function of `blender.materials.surface_shaders` and a preset with its picture.

References
----------
Clifton, Rüedi and Lehning 2006, "Snow saltation threshold measurements in a drifting-snow wind tunnel", Journal of
Glaciology 52, doi:10.3189/172756506781828430: loose snow drifts from 0.27-0.69 m/s on, with its density.
Bagnold 1941, "The physics of blown sand and desert dunes": sand of 0.25 mm moves from
0.1·sqrt((rho_s - rho_a)/rho_a·g·d) on.
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

from dataclasses import dataclass, replace

from ..errors import damaged

HOUR = 3600.0

Range = tuple[float, float]
Triple = tuple[float, float, float]

DEFAULT = "soil"
"""Surface of a preset that names none."""


@dataclass(frozen=True)
class ThrownMatter:
    """Matter in the air.

    Attributes
    ----------
    repose : float
        Angle of repose: what pushes along the ground harder than that throws it [deg].
    film : float
        Thickness of what a sole sheds after it has left, over its area [m]: what stays on it is no debris. A sole keeps
        what its yield stress holds against the swing: of mud 200 Pa/(1700 kg/m³·30 m/s²), 4 mm; of wet sand, with a
        capillary cohesion of about 1 kPa, more than it carries. What hangs on loosely comes off: 5 to 15 g of a boot,
        by eye.
    lumps, sizes, settling : int, (float, float), (float, float)
        In how many lumps it comes off, which break as they do, 0 where it trickles; smallest and largest diameter [m]
        (see `crumbs`), and the speeds at which these fall at last [m/s].
    most, fine : int, float
        Pieces of a step in one phase at most: what is more is drawn as larger ones; and the share of the volume in as
        many single grains, as a mist between the pieces.
    """

    repose: float
    film: float
    lumps: int
    sizes: Range
    settling: Range
    most: int = 4000
    fine: float = 0.0


@dataclass(frozen=True)
class Fragments:
    """The shapes of crumbs: broken crust, grains, clumps, drops, clods.

    Attributes
    ----------
    largest : float
        Diameter of the largest [m].
    roughness, cuts : float, int
        How far their surface is from a sphere, over their radius; number of flat sides, along which they broke.
    stretch : tuple of (float, float, float)
        Along three axes, of each shape.
    angular : bool
        True if they break along faces, as clods, which smooth shading makes pebbles of.
    translucency : float
        Share of light that they let through: they glow against the sun. Sand that lies turns dark by more of it.
    """

    largest: float
    roughness: float
    cuts: int = 0
    stretch: tuple[Triple, ...] = ((1.0, 1.0, 0.85),) * 6
    angular: bool = False
    translucency: float = 0.0


@dataclass(frozen=True)
class Voice:
    """The sound under a foot: what is excited, in which bands, and for how long.

    Attributes
    ----------
    crackle, noise, thump, pop : float
        Loudness of its parts: micro-impacts, grains that slide, the heel on packed ground, the foot that leaves mud.
    crackle_band, noise_band, thump_pitch : (float, float)
        Between which the resonances of micro-impacts, the noise of what slides and the thump of a heel lie [Hz].
    crackle_decay : (float, float)
        Between which the decay times of micro-impacts lie [s].
    density, gamma : float
        Micro-impacts for each litre that is compacted; their energies follow E^-gamma.
    """

    crackle: float
    noise: float
    thump: float
    pop: float
    crackle_band: Range
    crackle_decay: Range
    density: float
    gamma: float
    noise_band: Range
    thump_pitch: Range


@dataclass(frozen=True)
class Soaking:
    """Rates at which ground takes up water: at first and in the end [m/s], and the decay between them [1/s].

    As Horton's f = final + (first - final)·exp(-decay·t). Water from below fills a print over a time `seep` [s].
    """

    first: float
    final: float
    decay: float
    seep: float


@dataclass(frozen=True)
class CarriedFilm:
    """Film that stays on a sole and comes off on hard floors.

    Attributes
    ----------
    kind : str
        One of `CARRIED_KINDS`.
    most, taken : float
        Mass per area of the sole at most, and that a clean one takes up in one step [kg/m²].
    deposited : float
        Share of it that a sole deposits on a floor under high pressure.
    water : float
        Share of the mass that dries.
    """

    kind: str
    most: float
    taken: float
    deposited: float
    water: float

    def scaled(self, amount: float, reach: float) -> CarriedFilm:
        """The film that is so many times as thick, and of which each step deposits 1/reach."""
        deposited = min(self.deposited / reach, 1.0)
        return replace(self, most=self.most * amount, taken=self.taken * amount, deposited=deposited)


CARRIED_KINDS = ("mud", "sand", "snow", "water", "paint")
"""What soles carry, in the order of the numbers by which marks name it."""
GRINDING, SQUELCHING = ("sand",), ("mud",)
"""Kinds that grind under soles on hard floors, and that squelch as these leave; soles with others squeak."""


@dataclass(frozen=True)
class Liquid:
    """Liquid on hard floors; its fields are those of `SurfaceRecord`."""

    name: str
    density: float
    colour: Triple
    carried: CarriedFilm
    melts: bool = False

    @property
    def label(self) -> str:
        """Name that the user sees."""
        return self.name.title()


@dataclass(frozen=True)
class SurfaceRecord:
    """Properties of a surface.

    Attributes
    ----------
    name : str
        As presets and records name it.
    density : float
        Of the loose matter [kg/m³]; sand is quartz of 2,650 with 40 % of pores.
    colour : (float, float, float)
        Of its pieces, and of the ground in Solid shading.
    tones : tuple of (float, float, float)
        Of wet ground, and of what soles carry of it: where it is dark and where it is light, and trodden.
    under : (float, float, float)
        Colour of what lies below it: earth, wet sand, grey sand without air, gravel, clay.
    shades, swell : (float, float), float
        Brightness of the darkest and the lightest parts of open ground, and the height of its swells [m].
    shader, relief : str
        Names of its function in `blender.materials.surface_shaders` and of its table of amounts in presets/relief.
    midi_note : int
        Of the left foot; the right one's is the next, and the next that of all else.
    wall_packing : float
        Part of the volume that a leg carves out of deep ground that is packed into the wall: of snow 1 - rho/rho_max
        with 550 kg/m³ of snow packed by hand, of others by eye.
    wall_cohesion : float
        Cohesion by which such a wall stands [Pa]: of snow for walls of 0.9 m; of wet
        sand by capillarity; dry sand has none (by eye, and by the yield stress of mud).
    wall_crumbling : float
        Depth to which the edge of such a wall breaks off, at most places at most [m] (by eye); 0 where it flows.
    soaking : Soaking or None
        How it takes up rain: sand, loam and clay, dry; wet sand has had its first rain. None of snow, which takes up
        what falls.
    drifts_from : float or None
        Friction velocity of the wind from which it moves [m/s]; None if it stays.
    melts, wet, pales : bool
        True of snow; of what is wet to begin with; of wet sand, which turns pale around a loaded foot.
    control : str or None
        Field of the panel that sets the stiffness by what people know: 'hand_hardness' of snow, 'moisture' of sand,
        'soil_moisture' of soil and mud.
    carried : CarriedFilm or None
        What soles carry away; None of what is dry, which does not stick.
    """

    name: str
    density: float
    thrown: ThrownMatter
    fragments: Fragments
    voice: Voice
    colour: Triple
    under: Triple
    shades: Range
    swell: float
    shader: str
    relief: str
    midi_note: int
    wall_packing: float = 0.0
    wall_cohesion: float = 0.0
    wall_crumbling: float = 0.0
    soaking: Soaking | None = None
    drifts_from: float | None = None
    melts: bool = False
    wet: bool = False
    pales: bool = False
    control: str | None = None
    carried: CarriedFilm | None = None
    tones: tuple[Triple, ...] = ()

    @property
    def label(self) -> str:
        """Name that the user sees."""
        return self.name.replace("_", " ").title()


SURFACES = {record.name: record for record in (
    SurfaceRecord(
        "snow",
        density=150.0,
        thrown=ThrownMatter(34.0, 1.0e-3, 0, (0.5e-3, 8.0e-3), (0.5, 3.0), 16_000, 0.1),
        fragments=Fragments(
            0.024, 0.14, 5,
            ((1, 1, 0.65), (1, 0.8, 0.6), (1, 0.9, 0.75), (1, 1, 0.5), (1, 0.75, 0.7), (1, 0.9, 0.6)),
            translucency=0.5,
        ),
        voice=Voice(1.0, 0.25, 0.3, 0.0, (1000, 4000), (0.0015, 0.004), 220.0, 1.5, (1500, 6000), (80, 150)),
        colour=(0.87, 0.90, 0.94), under=(0.12, 0.07, 0.04), shades=(0.92, 1.0), swell=0.50,
        shader="snow", relief="snow", midi_note=36,
        wall_packing=0.73, wall_cohesion=180.0, wall_crumbling=0.10,
        drifts_from=0.27, melts=True, control="hand_hardness",
        carried=CarriedFilm("snow", most=0.3, taken=0.2, deposited=0.5, water=1.0),
    ),
    SurfaceRecord(
        "sand",
        density=1600.0,
        thrown=ThrownMatter(34.0, 0.1e-3, 0, (0.3e-3, 2.0e-3), (2.0, 6.0), 16_000, 0.01),
        fragments=Fragments(0.002, 0.15, 2, translucency=0.15),
        voice=Voice(0.0, 1.0, 0.25, 0.0, (2000, 6000), (0.0005, 0.001), 0.0, 1.5, (1200, 7000), (60, 110)),
        colour=(0.66, 0.48, 0.29), under=(0.24, 0.16, 0.09), shades=(0.84, 1.10), swell=0.20,
        shader="dry_sand", relief="sand", midi_note=40,
        wall_packing=0.05, wall_cohesion=0.0,
        soaking=Soaking(127e-3 / HOUR, 10e-3 / HOUR, 4.0 / HOUR, 2.0), drifts_from=0.23, control="moisture",
    ),
    SurfaceRecord(
        "wet_sand",
        density=1800.0,
        thrown=ThrownMatter(45.0, 0.4e-3, 8, (2.0e-3, 12.0e-3), (5.0, 9.0)),
        fragments=Fragments(0.012, 0.2, 2),
        voice=Voice(0.25, 0.7, 0.5, 0.15, (800, 3000), (0.001, 0.003), 200.0, 1.6, (600, 3500), (70, 120)),
        colour=(0.24, 0.16, 0.09), under=(0.09, 0.085, 0.08), shades=(0.74, 1.18), swell=0.14,
        tones=((0.16, 0.095, 0.045), (0.30, 0.20, 0.115), (0.12, 0.072, 0.036)),
        shader="wet_sand", relief="wet_sand", midi_note=44,
        wall_packing=0.05, wall_cohesion=1000.0, wall_crumbling=0.03,
        soaking=Soaking(30e-3 / HOUR, 8e-3 / HOUR, 4.0 / HOUR, 5.0), wet=True, pales=True, control="moisture",
        carried=CarriedFilm("sand", most=0.8, taken=0.5, deposited=0.35, water=0.2),
    ),
    SurfaceRecord(
        "mud",
        density=1700.0,
        thrown=ThrownMatter(15.0, 0.3e-3, 6, (2.0e-3, 20.0e-3), (5.0, 9.0)),
        fragments=Fragments(  # comes down as flat clods, drops and strings
            0.020, 0.1, 0,
            ((1, 0.9, 0.35), (1, 0.7, 0.45), (1, 0.85, 0.25), (1, 0.8, 0.6), (1, 0.45, 0.3), (1, 0.25, 0.2)),
        ),
        voice=Voice(0.3, 0.6, 0.5, 0.8, (250, 900), (0.004, 0.012), 60.0, 1.8, (150, 1200), (60, 100)),
        colour=(0.108, 0.064, 0.035), under=(0.22, 0.20, 0.18), shades=(0.70, 1.25), swell=0.16,
        tones=((0.128, 0.076, 0.041), (0.205, 0.130, 0.076), (0.080, 0.045, 0.023)),
        shader="mud", relief="mud", midi_note=48,
        wall_packing=0.0, wall_cohesion=2000.0,
        soaking=Soaking(25e-3 / HOUR, 1e-3 / HOUR, 4.0 / HOUR, 30.0), wet=True, control="soil_moisture",
        carried=CarriedFilm("mud", most=3.5, taken=2.5, deposited=0.2, water=0.35),
    ),
    SurfaceRecord(
        "soil",
        density=1300.0,
        thrown=ThrownMatter(38.0, 0.3e-3, 0, (2.0e-3, 30.0e-3), (3.0, 12.0)),
        fragments=Fragments(0.030, 0.2, 6, angular=True),
        voice=Voice(0.9, 0.35, 0.45, 0.0, (500, 3000), (0.002, 0.007), 500.0, 1.3, (400, 2500), (70, 140)),
        colour=(0.12, 0.07, 0.04), under=(0.28, 0.16, 0.07), shades=(0.70, 1.25), swell=0.16,
        shader="soil", relief="soil", midi_note=52,
        wall_packing=0.15, wall_cohesion=1000.0, wall_crumbling=0.05,
        soaking=Soaking(76e-3 / HOUR, 5e-3 / HOUR, 4.0 / HOUR, 30.0), control="soil_moisture",
    ),
)}  # fmt: skip
"""Surfaces by name, in the order in which the user sees them."""

HARD = "hard"
"""In place of a surface: a floor that bears and takes no print, such as rock, stone tiles, a deck."""
HARD_VOICE = Voice(1.0, 0.15, 0.5, 0.0, (350, 2600), (0.002, 0.009), 0.0, 1.5, (1500, 6000), (90, 160))
"""Sound of a shoe on it: most of the power of such steps lies below 2.5 kHz and within 30 ms of the strike (by ear)."""
HARD_NOTE = 56
"""As `SurfaceRecord.midi_note`."""


LIQUIDS = {
    liquid.name: liquid
    for liquid in (
        Liquid("water", 1000.0, (0.1, 0.1, 0.1), CarriedFilm("water", most=0.1, taken=0.1, deposited=0.35, water=1.0)),
        Liquid(
            "paint", 1200.0, (0.25, 0.006, 0.004), CarriedFilm("paint", most=0.25, taken=0.2, deposited=0.35, water=0.5)
        ),
    )
}
"""What hard floors are wet with, by name; the colour of paint is the artist's to change."""


def sticking(name: str) -> SurfaceRecord | Liquid:
    """The surface or liquid of that name; errors as of `find`."""
    return LIQUIDS.get(name) or find(name)


def find(name: object, origin: str = "Ground") -> SurfaceRecord:
    """The surface of that name.

    Raises
    ------
    InputError
        If there is none, naming `origin` and the surfaces that there are.
    """
    if isinstance(name, str) and name in SURFACES:
        return SURFACES[name]
    raise damaged(origin, f"'surface' is {name!r}; it must be one of {', '.join(SURFACES)}.")
