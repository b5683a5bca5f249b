from tests.gui.shot import open_walk
import bpy
def tell(hand, facts):
    open_walk()
    yield from hand.open_sidebar()
    yield from hand.picture("panel_first")
    yield from hand.press_button("softground.add_character")
    facts["characters"] = len(bpy.context.scene.softground.characters)
    yield from hand.picture("panel_added")
    yield from hand.press_button("softground.bake")
    yield 0.3
    yield from hand.picture("baking")
    yield from hand.wait_for(lambda: bpy.context.scene.softground.ground is not None, 60)
    yield from hand.picture("baked")
