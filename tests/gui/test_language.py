"""The interface in German, Japanese and Chinese, chosen while Blender runs."""

import json

import pytest

from tests.gui import conftest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]

LANGUAGES = ("de_DE", "ja_JP", "zh_HANS")
CATALOGUES = conftest.REPOSITORY / "softground_addon" / "languages"


@pytest.fixture
def facts(tell):
    return tell("language")


def translation_in(language):
    return json.loads((CATALOGUES / f"{language}.json").read_text(encoding="utf-8"))


def test_in_english_no_catalogue_is_read(facts):
    assert facts["at first"]["read"] == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_language_that_is_chosen_shows_at_once(facts, language):
    english = facts["at first"]["texts"]
    assert facts[language]["texts"] == {kind: translation_in(language)[text] for kind, text in english.items()}
    assert facts[language]["otherwise in our context"] == []


def test_catalogues_are_read_when_they_are_wanted(facts):
    assert [facts[language]["read"] for language in LANGUAGES] == [
        ["de_DE"],
        ["de_DE", "ja_JP"],
        ["de_DE", "ja_JP", "zh_HANS"],
    ]


BLENDERS_OWN = 40
"""Most texts that Blender has itself in a language, where its word counts."""


@pytest.mark.parametrize("language", LANGUAGES)
def test_blender_s_own_words_are_few_where_they_are_others(facts, language):
    assert len(facts[language]["otherwise in Blender's"]) < BLENDERS_OWN


@pytest.mark.parametrize("when", ["en_US", "without a catalogue"])
def test_other_languages_show_english(facts, when):
    assert facts[when]["texts"] == facts["at first"]["texts"]


def test_a_language_is_followed_after_another_file_was_opened(facts):
    assert facts["after another file"]["texts"]["button"] == translation_in("de_DE")["Bake Footprints"]


def test_nothing_is_left_once_the_add_on_is_off(facts):
    assert facts["switched off"] == facts["at first"]["texts"]


IN_GERMAN = """
import bpy
bpy.context.preferences.view.language = "de_DE"
bpy.ops.preferences.addon_disable(module="bl_ext.user_default.softground")
bpy.ops.preferences.addon_enable(module="bl_ext.user_default.softground")
bpy.ops.softground.report_bug()
try:
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.softground.bake()
except RuntimeError as error:
    print(error)
"""


def test_reports_and_reasons_are_in_the_language_that_blender_starts_with(suite):
    conftest.installed(suite)
    printed = conftest.blender(suite, "run", "-b", "--python-expr", IN_GERMAN)
    german = translation_in("de_DE")
    for text in (
        "Copied the details: paste them into your report, below what you did and what happened",
        "Add a character first: select its armature and press Add Character",
    ):
        assert german[text] in printed


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]
