"""Settings of a scene: `scene.softground`, saved with the .blend."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    IntVectorProperty,
    PointerProperty,
)

from ...core.ground import field_tests
from ..state import state
from ..translation import CONTEXT
from .character import SoftGroundCharacter
from .fields import in_unit, is_mesh
from .material import DEFAULT, SoftGroundMaterial, SoftGroundPainted, by_feel
from .response import SoftGroundGrounding, SoftGroundTilt

DEFAULT_CELL_SIZE = 0.01
"""Fine enough for the edge of a human print [m]."""


_CELL_SIZE = (
    "Size of the cells in which the ground is simulated. Half the size takes four times the memory; "
    "print depth does not depend on it"
)
_TREAD = (
    "Depth of the shoe tread that the ground's render material shows in the prints. 0 for bare feet, paws and props"
)


def _of_the_users_own(options: Any, _context: bpy.types.Context) -> None:
    options.cells_along_sole = 0.0


def _worked_out(name: str) -> dict[str, Any]:
    """Get and set a field that nothing stores, by the hooks `show_...` and `type_...` of its name."""

    def shown(options: Any) -> float:
        hook = state.hooks.get(f"show_{name}")
        return float(hook(options)) if hook else 0.0

    def set_to(options: Any, value: float) -> None:
        if hook := state.hooks.get(f"type_{name}"):
            hook(options, value)

    return {"get": shown, "set": set_to, "options": {"SKIP_SAVE"}}


class SoftGroundHardGround(bpy.types.PropertyGroup):
    """An object that soles stand on without a print."""

    object: PointerProperty(
        name="Object",
        description="Mesh that stands still and bears feet without giving way: a crate, stairs, a floor, a rock",
        type=bpy.types.Object,
        poll=is_mesh,
    )
    wet: EnumProperty(
        name="Wet With",
        description="What soles that step onto it take up, and leave on the hard ground after it",
        items=(
            ("NONE", "Dry", "It is dry"),
            ("WATER", "Water", "A puddle, wet stone: prints of water, which dry without a trace"),
            ("PAINT", "Paint", "Paint or blood, in the colour of the material of the marks"),
        ),
    )


def _under() -> Any:
    return EnumProperty(
        name="Under-Layer",
        description="When prints show what lies below the layer: earth under snow, wet sand under dry",
        items=[
            ("AUTO", "Where Thin", "Where the layer is up to 8 cm deep"),
            ("ALWAYS", "Always", "Wherever feet press through most of the layer, however deep it is"),
            ("NEVER", "Never", "Prints look like the layer all the way down"),
        ],
        default="AUTO",
    )


class SoftGroundFurtherGround(bpy.types.PropertyGroup):
    """A soft ground beside the first, and what is set for it."""

    object: PointerProperty(
        name="Object", description="Mesh that gives way under the characters", type=bpy.types.Object, poll=is_mesh
    )
    material: PointerProperty(name="Material", type=SoftGroundMaterial)
    painted: PointerProperty(name="Masks", type=SoftGroundPainted)
    under: _under()


class SoftGroundPrinted(bpy.types.PropertyGroup):
    """A ground that a bake of the scene has left prints on; see `baked_ground.unlisted`."""

    object: PointerProperty(name="Object", type=bpy.types.Object)


class SoftGroundSettings(bpy.types.PropertyGroup):
    """Everything that a bake reads."""

    ground: PointerProperty(
        name="Ground", description="Mesh that gives way under the characters", type=bpy.types.Object, poll=is_mesh
    )
    grounds: CollectionProperty(name="Further Grounds", type=SoftGroundFurtherGround)
    active_ground: IntProperty(name="Active Ground", options={"HIDDEN"})
    printed: CollectionProperty(name="Grounds with Prints", type=SoftGroundPrinted, options={"HIDDEN"})
    hard_grounds: CollectionProperty(name="Hard Ground", type=SoftGroundHardGround)
    active_hard_ground: IntProperty(name="Active Hard Ground", options={"HIDDEN"})
    characters: CollectionProperty(name="Characters", type=SoftGroundCharacter)
    active_character: IntProperty(name="Active Character", options={"HIDDEN"})
    material: PointerProperty(name="Material", type=SoftGroundMaterial)
    cell_size: FloatProperty(
        name="Cell Size (m)",
        description=_CELL_SIZE,
        default=DEFAULT_CELL_SIZE,
        min=1e-4,
        max=1.0,
        soft_min=0.002,
        soft_max=0.05,
        precision=4,
        update=_of_the_users_own,
    )
    length_scale: FloatProperty(
        name="Length Scale",
        description="Lengths of the preset, as they are for the soles, over those for a person's",
        default=1.0,
        min=1e-4,
        max=1.0,
        options={"HIDDEN"},
    )
    cells_along_sole: FloatProperty(
        name="Cells Along Sole",
        description="Cells along the shortest sole, which set the cell size; 0 if you set the size yourself",
        default=DEFAULT.cells_along_sole,
        min=0.0,
        options={"HIDDEN"},
    )
    cell_size_cm: in_unit(
        "cell_size", 0.01, "Cell Size (cm)", _CELL_SIZE, min=0.01, max=100.0, soft_min=0.2, soft_max=5.0, precision=2
    )
    longest_bake: FloatProperty(
        name="Time Limit (min)",
        description="A bake estimated to take longer than this is refused before it starts. Raise it to bake overnight",
        default=60.0,
        min=1.0,
        max=10_000.0,
        precision=0,
    )
    shape_keys: BoolProperty(
        name="Keep Shape Keys",
        description="Keep the raw and the smoothed heights as shape keys, to blend or sculpt. Left "
        "out above 250,000 vertices, where they slow down playback",
        default=True,
    )
    dense_shape_keys: BoolProperty(
        name="On Dense Grounds",
        description="Keep shape keys on grounds of more than 250,000 vertices as well",
        default=False,
    )
    ground_margin: FloatProperty(
        name="Margin (m)",
        description="How far a ground made by SoftGround extends beyond the walk, with an edge that "
        "fades out. It also fills the camera's view; at 0 it ends close around the steps",
        default=3.0,
        min=0.0,
        soft_max=20.0,
        precision=1,
    )
    under: _under()
    detail: EnumProperty(
        name="Detail",
        translation_context=CONTEXT,
        description="When to hide the ground and press a copy of it that is fine along the trail",
        items=[
            ("AUTO", "Automatic", "Use the copy if the ground is too coarse to show the prints"),
            ("ALWAYS", "Always", "Use the copy even if the ground itself could show the prints"),
            ("NEVER", "Never", "Press the ground's own vertices"),
        ],
        default="AUTO",
    )
    output: EnumProperty(
        name="Bake",
        description="What to bake",
        items=[
            ("BOTH", "Prints and Response", "Footprints in the ground, and the characters' response if it is on"),
            ("PRINTS", "Prints Only", "Footprints in the ground; the characters keep their animation"),
            ("RESPONSE", "Response Only", "The characters' Grounding and Tilt; the ground stays as it is"),
        ],
        default="BOTH",
    )
    depth_cm: FloatProperty(
        name="Depth (cm)",
        description="Depth of the typical step: half of the main steps are deeper, half shallower. "
        "Type another depth, and the stiffness of the ground follows",
        min=0.0,
        soft_max=30.0,
        precision=1,
        **_worked_out("depth_cm"),
    )
    snow_cm: FloatProperty(
        name="Final Snow (cm)",
        description="Depth of the new snow on untouched ground at the scene's last frame. Sets Snowfall",
        min=0.0,
        soft_max=50.0,
        precision=1,
        **_worked_out("snow_cm"),
    )
    weather_hours: FloatProperty(
        name="Shot Lasts (h)",
        description="Hours of weather from the first frame of the bake to the scene's last. Sets Time Scale; as much "
        "snow lies at the end as before",
        min=0.0,
        soft_max=48.0,
        precision=1,
        **_worked_out("weather_hours"),
    )
    hand_hardness: by_feel(
        "Hand Hardness",
        "What you can just push into the snow with your hand: 1 a fist, 2 four fingers, 3 one finger, 4 a pencil, 5 a "
        "knife. Sets how stiff and how deep the snow is, as boots sank in 19,811 snow pits",
        field_tests.hardness_of,
        field_tests.hardened,
        min=field_tests.FIST,
        max=field_tests.KNIFE,
        step=33,
        precision=2,
    )
    moisture: by_feel(
        "Moisture",
        "How wet the sand is: 0 dry, 0.3 damp, 0.6 wet and firm, 1 soaked. Dry and soaked sand are soft, what is "
        "between is firm. Sets the stiffness",
        field_tests.moisture_of,
        field_tests.moistened,
        min=0.0,
        max=1.0,
        step=10,
        precision=2,
    )
    soil_moisture: by_feel(
        "Moisture",
        "How wet the soil is: 0 dry and firm, 0.25 moist, 0.5 stiff mud, 0.75 soft mud, 1 liquid. Sets the stiffness",
        field_tests.wetness_of,
        field_tests.wetted,
        min=0.0,
        max=1.0,
        step=10,
        precision=2,
    )
    painted: PointerProperty(name="Masks", type=SoftGroundPainted)
    pressure: EnumProperty(
        name="Pressure",
        description="How the force on a foot spreads over its contact area",
        items=[
            ("UNIFORM", "Flat", "The same pressure wherever the foot touches"),
            (
                "CENTRE_OF_PRESSURE",
                "Heel-to-Toe",
                "Pressure follows the force from the heel to the toes: prints have deep heels and toes",
            ),
        ],
        default=DEFAULT.pressure,
    )
    tread: FloatProperty(
        name="Tread (m)",
        description=_TREAD,
        default=DEFAULT.tread,
        min=0.0,
        max=0.1,
        soft_max=0.005,
        precision=4,
    )
    tread_mm: in_unit("tread", 1e-3, "Tread (mm)", _TREAD, min=0.0, soft_max=5.0, precision=1)
    tread_pattern: EnumProperty(
        name="Tread Pattern",
        description="Pattern of the soles, pressed in where the relief is fine enough to show it, "
        "usually with Close-Up",
        items=[
            ("HIKING", "Hiking", "Blocks around the edge, chevrons within, a plain waist"),
            ("TRAINER", "Trainer", "Waves across the sole, cut along its middle"),
            ("BARE", "Bare Foot", "No shoe: pads of heel, ball and toes, with an arch"),
            ("IMAGE", "Image", "An image of the sole: white presses, black is a groove"),
            ("SHOES", "From Shoes", "The grooves that the meshes of the characters' own soles have"),
        ],
        default="HIKING",
    )
    tread_image: PointerProperty(
        name="Tread Image",
        description="Right sole as seen in its print from above, toes at the top (or at the right of a wide image). "
        "It reaches from edge to edge of the sole, and is mirrored for left feet",
        type=bpy.types.Image,
    )
    relief: EnumProperty(
        name="Relief",
        translation_context=CONTEXT,
        description="Broken edges, crumbs, cracks and tread on the displayed prints. Forces, depths "
        "and the response are not affected",
        items=[
            ("OFF", "Off", "Smooth prints, as they are simulated"),
            ("FINE", "Fine", "As fine as the cells: for trails and full figures"),
            (
                "CLOSE_UP",
                "Close-Up",
                "Vertices 2.5 mm apart along the trail where the camera comes near (everywhere "
                "without a camera), and shoe tread in the mesh",
            ),
        ],
        default="FINE",
    )
    relief_vertices: IntProperty(
        name="Max Vertices",
        description="Most vertices that Close-Up may use along the trail; it gets coarser to stay within them",
        default=2_000_000,
        min=10_000,
        soft_max=10_000_000,
    )
    relief_strength: FloatProperty(
        name="Relief Amount",
        description="How rough the prints are: 0 is smooth, 1 as designed for the ground",
        default=1.0,
        min=0.0,
        max=2.0,
        precision=2,
    )
    tilt: PointerProperty(name="Tilt", type=SoftGroundTilt)
    grounding: PointerProperty(name="Grounding", type=SoftGroundGrounding)
    frame_start: IntProperty(name="Start", description="First frame of the bake", default=1)
    frame_end: IntProperty(name="End", description="Last frame of the bake", default=250)
    animated_frames: IntVectorProperty(
        name="Animated Frames", description="Start and End as set by Add Character", size=2, options={"HIDDEN"}
    )
    own_time: IntVectorProperty(
        name="Own Time Stretching", description="Time stretching before Slow Down", size=2, options={"HIDDEN"}
    )
    slowed_time: IntVectorProperty(
        name="Slowed Time Stretching",
        description="Time stretching set by Slow Down; (0, 0) before",
        size=2,
        options={"HIDDEN"},
    )
    sink_feet: BoolProperty(
        name="Sink Feet",
        description="Lower the feet into their prints, with hips and knees, as a layer of keys above "
        "the animation. If a rig cannot take the layer, the bake says so and goes on "
        "without it",
        default=True,
    )
    carve: BoolProperty(
        name="Carve",
        description="Let legs and whatever else is in the ground carve it, where feet that are sunk go deeper than the "
        "ankle. The bake of such a shot takes three to five times as long",
        default=True,
    )
    has_layers: BoolProperty(
        name="Response Layers", description="A bake has put layers on armatures", options={"HIDDEN"}
    )
    debris: BoolProperty(
        name="Throw Debris",
        description="Let steps kick up snow, sand, mud and soil, according to their speed and force: "
        "a plume for a run in powder, almost nothing for a walk on firm sand. What flies away "
        "is missing from the rims",
        default=DEFAULT.debris,
    )
    marks: BoolProperty(
        name="Leave Marks",
        description="Let soles carry mud, wet sand and snow onto hard ground and leave marks there: fainter with each "
        "step, drying as they lie. Without hard ground in the shot, nothing changes",
        default=True,
    )
    carried_amount: FloatProperty(
        name="Carried",
        description="How much sticks to soles, over what the ground's kind has: 2 is twice as much",
        default=1.0, min=0.0, soft_max=3.0, max=10.0,
    )  # fmt: skip
    carried_reach: FloatProperty(
        name="Reach",
        description="How far soles carry it, over what its kind has: at 2, marks fade in about twice as many steps",
        default=1.0, min=0.1, soft_max=5.0, max=20.0,
    )  # fmt: skip
    steps_feel_weather: BoolProperty(
        name="Steps Feel Weather",
        description="Bake on the weathered ground: steps press fresh snow, and what the weather has left of earlier "
        "prints. The bake then depends on the weather's sliders. If off, weather only covers what is baked",
        default=False,
    )
    keep_forces: BoolProperty(
        name="Forces in Report",
        description="Write the force under each sole at each frame into the report",
        default=False,
    )
