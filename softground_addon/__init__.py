"""SoftGround: ground that gives way under animated characters.

`core` is the physics (numpy only), `blender` is everything that touches bpy. Nothing here imports bpy before
`register()`, so that `softground_addon.core` works without Blender.
"""


def register() -> None:
    """Register the add-on's classes, properties and command with Blender."""
    from .blender.registration import register as register_everything

    register_everything()


def unregister() -> None:
    """Undo `register()`, in reverse order."""
    from .blender.registration import unregister as unregister_everything

    unregister_everything()
