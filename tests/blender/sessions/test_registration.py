"""The add-on comes and goes as a whole."""

import bpy
import pytest

from softground_addon.blender import registration
from softground_addon.blender.panels import menus


@pytest.fixture
def nothing_registered(addon):
    registration.unregister()
    yield
    registration.register()


def is_registered():
    return hasattr(bpy.types.Scene, "softground"), bool(bpy.types.Operator.bl_rna_get_subclass_py("SOFTGROUND_OT_bake"))


def test_registering_and_unregistering_can_be_repeated(nothing_registered):
    for _ in range(3):
        assert is_registered() == (False, False)
        registration.register()
        assert is_registered() == (True, True)
        registration.unregister()


def test_an_error_half_way_leaves_nothing_behind(nothing_registered, monkeypatch):
    def fail():
        raise ZeroDivisionError

    with monkeypatch.context() as broken:
        broken.setattr(menus, "register", fail)
        with pytest.raises(ZeroDivisionError):
            registration.register()
    assert is_registered() == (False, False)
