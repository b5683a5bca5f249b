"""What tests of several folders need."""

import gc

import pytest
from hypothesis import HealthCheck, settings

# What decides about an example is what is asserted of it, not how long a busy machine takes for it.
settings.register_profile(
    "any machine",
    settings.get_profile(settings.get_current_profile_name()),  # with CI=true: the same examples each time
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("any machine")


def pytest_addoption(parser):
    parser.addoption("--share", help="a part of the tests: 1/2 is the first, third, fifth ..., 2/2 the others")


def pytest_collection_modifyitems(config, items):
    if config.option.share:
        part, parts = map(int, config.option.share.split("/"))
        config.hook.pytest_deselected(items=[item for at, item in enumerate(items) if at % parts != part - 1])
        items[:] = items[part - 1 :: parts]


def pytest_ignore_collect(collection_path, config):
    """Files without tests that run alone are left out where only those are asked for: to import all takes longer."""
    alone = config.option.markexpr.endswith("and alone")
    return True if alone and collection_path.is_file() and b"mark.alone" not in collection_path.read_bytes() else None


@pytest.fixture(scope="session")
def addon():
    """SoftGround switched on until the last test: registered once, since Blender knows no second of the same."""
    bpy = pytest.importorskip("bpy", reason="this needs Blender: pip install bpy==4.5.15")
    import softground_addon

    softground_addon.register()
    yield
    bpy.ops.wm.read_factory_settings(use_empty=True)
    softground_addon.unregister()


@pytest.fixture(autouse=True)
def _heap_of_the_tests(request):
    """What measures time does not look through the thousands of collected tests in each pass of the garbage collector.

    A full pass over them takes 0.1 s, and comes at a step of whatever is measured.
    """
    if request.node.get_closest_marker("alone") is None:
        yield
        return
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()
