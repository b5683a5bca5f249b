"""The manual and bug reports: every button finds its page, every page is there, and a report says what it should."""

import webbrowser
from fnmatch import fnmatchcase
from html.parser import HTMLParser
from pathlib import Path

import bpy
import pytest

from release import manual
from softground_addon.blender import registration
from softground_addon.blender.panels import help as doors
from tests.blender import shots

ROOT = Path(__file__).parents[3]


class Page(HTMLParser):
    """Where a page can be entered, and what it leads to."""

    def __init__(self, text):
        super().__init__()
        self.sections, self.targets = {""}, set()
        self.feed(text)

    def handle_starttag(self, _tag, attrs):
        for name, value in attrs:
            if name == "id":
                self.sections.add(value)
            elif name in ("href", "src"):
                self.targets.add(value)


@pytest.fixture(scope="module")
def files():
    return {name.removeprefix("manual/"): content for name, content in manual.files(ROOT).items()}


@pytest.fixture(scope="module")
def pages(files):
    return {name: Page(content.decode()) for name, content in files.items() if name.endswith(".html")}


def names_of_everything():
    """Operators and properties of ours, as Blender asks for their page in the manual."""
    for cls in registration.CLASSES:
        if issubclass(cls, bpy.types.Operator):
            yield f"bpy.ops.{cls.bl_idname}"
        elif issubclass(cls, bpy.types.PropertyGroup):
            yield from (f"bpy.types.{cls.__name__}.{name}".lower() for name in cls.__annotations__)


@pytest.mark.slow
def test_every_link_on_every_page_leads_somewhere(files, pages):
    for name, page in pages.items():
        assert len(page.targets) > 5
        for target in (target for target in page.targets if "://" not in target):
            file, _, section = target.partition("#")
            assert (file or name) in files, f"{name}: {target}"
            assert not section or section in pages[file or name].sections, f"{name}: {target}"


def test_every_picture_of_the_manual_is_on_a_page(files, pages):
    shown = set.union(*(page.targets for page in pages.values()))
    assert {name for name in files if name not in pages} <= shown


def test_every_button_and_field_has_its_page(addon, pages):
    names = set(names_of_everything())
    assert len(names) > 150
    page_of = {name: next(page for pattern, page in doors.PAGES if fnmatchcase(name, pattern)) for name in names}
    for file, _, section in (page.partition("#") for page in page_of.values()):
        assert section in pages[file].sections
    assert page_of["bpy.ops.softground.clean_feet"] == "response.html#clean-feet"
    assert page_of["bpy.ops.softground.mute_step"] == "steps.html"
    assert {page for _, page in doors.PAGES} == set(page_of.values())  # none is hidden by those above it


@pytest.fixture
def opened(monkeypatch):
    """The addresses that the web browser was given."""

    class Browser(webbrowser.BaseBrowser):
        def open(self, url, _new=0, _autoraise=True):
            addresses.append(url)
            return True

    addresses = []
    monkeypatch.setattr(webbrowser, "_browsers", {})
    monkeypatch.setattr(webbrowser, "_tryorder", [])
    webbrowser.register("noting", None, Browser(), preferred=True)
    return addresses


def test_the_manual_opens_in_the_browser_where_the_package_is(scene, opened, monkeypatch, tmp_path):
    assert not bpy.ops.softground.open_manual.poll()  # in the sources
    monkeypatch.setattr(doors, "MANUAL", tmp_path / "sp ace")
    doors.MANUAL.mkdir()
    assert bpy.ops.softground.open_manual() == {"FINISHED"}
    assert bpy.ops.wm.doc_view_manual(doc_id="softground.live") == {"FINISHED"}
    folder = (tmp_path / "sp ace").as_uri()
    assert opened == [f"{folder}/index.html", f"{folder}/panel.html#live"]


def test_a_report_says_what_was_baked_with_what_and_not_where(scene, opened, tmp_path):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "secret.blend"))
    text = doors.bug_report(scene)
    for word in (
        "SoftGround 0.",
        f"Blender {bpy.app.version_string}",
        '"preset": "Snow"',
        '"typical_depth_m"',
        "stiffness",
    ):
        assert word in text
    assert str(tmp_path) not in text
    assert bpy.ops.softground.report_bug() == {"FINISHED"}
    assert opened == []  # no website is known


def test_the_website_opens_once_the_manifest_names_one(scene, opened, monkeypatch):
    monkeypatch.setattr(doors.program, "about", lambda: {"version": "1.0.0", "website": "https://example.org/bugs"})
    assert bpy.ops.softground.report_bug() == {"FINISHED"}
    assert opened == ["https://example.org/bugs"]


def test_a_shot_that_cannot_be_baked_can_be_reported(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.characters[0].mass = 0.0
    assert "SoftGround" in doors.bug_report(scene)
