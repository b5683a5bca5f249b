"""What a redraw asks, without a window: `poll` and `draw` of all panels, `poll` of all operators, and the handlers."""

from time import thread_time
from types import SimpleNamespace

import bpy

from softground_addon.blender import handlers, registration
from softground_addon.blender.operators import prediction
from softground_addon.blender.operators.panel_base import SidebarPanel


class Layout:
    """Takes whatever a panel puts into it, and shows nothing."""

    def __getattr__(self, _name):
        return lambda *_, **__: self


def redraw(context):
    """Ask all that a redraw with everything open, and an edit before it, ask, in one turn of Blender's."""
    bpy.app.timers.register(prediction.look_anew)
    for cls in registration.CLASSES:
        is_shown = not hasattr(cls, "poll") or cls.poll(context)
        if is_shown and issubclass(cls, bpy.types.Panel):
            panel = SimpleNamespace(layout=Layout())
            panel.fields = lambda panel=panel: SidebarPanel.fields(panel)
            cls.draw(panel, context)
    prediction.look(context.scene)[1]  # the overlay's
    handlers.notice_edits(context.scene, context.view_layer.depsgraph)
    handlers.follow_frame(context.scene, context.view_layer.depsgraph)
    bpy.app.timers.unregister(prediction.look_anew)
    prediction.look_anew()


def least_seconds(action, *arguments, count=100):
    """The least processor time of several runs [s]: what the machine does beside them comes and goes."""
    return min(_seconds(action, *arguments) for _ in range(count))


def _seconds(action, *arguments):
    begun = thread_time()
    action(*arguments)
    return thread_time() - begun


PROP = "A Prop"


def fill(scene, count):
    """Put objects that have nothing to do with the add-on into a scene; names are looked up past theirs."""
    for number in range(count):
        scene.collection.objects.link(bpy.data.objects.new(f"{PROP} {number}", None))
    bpy.context.view_layer.update()


def empty():
    """Take away what `fill` has put there."""
    bpy.data.batch_remove([thing for thing in bpy.data.objects if thing.name.startswith(PROP)])
    bpy.context.view_layer.update()


def walk_over_all_objects():
    """What nothing that is asked in a redraw may do."""
    return [thing.name for thing in bpy.data.objects]
