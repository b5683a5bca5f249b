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


def own(language):
    return json.loads((CATALOGUES / f"{language}.json").read_text(encoding="utf-8"))


def test_in_english_no_catalogue_is_read(facts):
    assert facts["at first"]["read"] == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_language_that_is_chosen_shows_at_once(facts, language):
    english = facts["at first"]["texts"]
    assert facts[language]["texts"] == {kind: own(language)[text] for kind, text in english.items()}
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
    assert facts["after another file"]["texts"]["button"] == own("de_DE")["Bake Footprints"]


def test_nothing_is_left_once_the_add_on_is_off(facts):
    assert facts["switched off"] == facts["at first"]["texts"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]
