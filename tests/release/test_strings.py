"""Catalogues of the interface's languages hold what the interface shows, no less and no more."""

import ast
import re
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from release import strings
from softground_addon.blender import translation
from softground_addon.blender.state import state
from tests.release.test_platform_rules import TREES

languages = pytest.mark.parametrize("language", strings.LANGUAGES)
NAMES = re.compile(
    r"\{\w*\}|SoftGround|Motion Capture|OpenSim|OpenTimelineIO|JSON Lines|Alembic|Reaper|DaVinci|Resolve|Young"
    r"|Esc|Shift|docs/|float"
)
"""Parts of texts that other scripts keep, beside abbreviations and files."""
WORD = re.compile(r"(?<![\w.])[A-Z]?[a-z]{4,}(?![\w.])")
SCRIPTS = {"ja_JP": "[\u3040-\u30ff\u4e00-\u9fff]", "zh_HANS": "[\u4e00-\u9fff]", "de_DE": "."}


@languages
def test_a_catalogue_holds_what_the_interface_shows(addon, language):
    assert strings.faults(language) == {"missing": [], "superfluous": [], "other names": []}


@pytest.mark.slow
def test_the_interface_shows_names_tooltips_labels_presets_and_templates(addon):
    shown = strings.shown()
    for text in (
        "Bake Footprints",  # a button
        "Press the footprints of all characters into the ground, over the whole frame range. Esc cancels",
        "Close-Up",  # an item of an enum
        "Fresh Snow (field)",  # a preset
        "Snow Depth at the End (cm)",  # a text beside a field
        "{count} steps, {depth}",
        "The mesh of '{name}' has been edited",
        "Add a character first",
        "Previous",
        "Windy Dunes",
    ):
        assert text in shown


@languages
def test_a_catalogue_is_sorted_with_a_text_on_each_line(language):
    texts = translation.catalogue(language)
    assert list(texts) == sorted(texts)
    lines = (translation.FOLDER / f"{language}.json").read_text(encoding="utf-8").splitlines()
    assert len(lines) == len(texts) + 2


@languages
def test_texts_are_in_their_language(language):
    for text, translated in translation.catalogue(language).items():
        if WORD.search(NAMES.sub("", text)):
            assert re.search(SCRIPTS[language], translated), text
        assert translated.strip() == translated != ""
        assert translated.endswith(".") or language != "de_DE" or not text.endswith("."), text


@pytest.mark.parametrize("language", ["ja_JP", "zh_HANS"])
def test_no_english_is_left_in_other_scripts(language):
    for text, translated in translation.catalogue(language).items():
        assert not WORD.findall(NAMES.sub("", translated)), text


def test_no_text_that_is_composed_goes_past_the_translation():
    shown = {"text", "heading", "title"}
    for path, tree in TREES.items():
        if "/blender/" not in Path(path).as_posix():
            continue
        for node in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            parts = [keyword.value for keyword in node.keywords if keyword.arg in shown]
            parts += node.args[1:] if name == "report" else node.args if name == "poll_message_set" else []
            for part in parts:
                assert not (isinstance(part, ast.JoinedStr) and WORD.search(_letters(part))), ast.unparse(node)
                is_text = isinstance(part, ast.Constant) and isinstance(part.value, str)
                assert name != "poll_message_set" or not is_text, ast.unparse(node)


def _letters(text):
    return " ".join(part.value for part in text.values if isinstance(part, ast.Constant))


def test_no_catalogue_is_read_in_english(addon):
    translation.watch()
    assert state.catalogues == {}


def test_a_text_has_its_values(addon):
    assert translation.translated("{count} steps, {depth}", count=3, depth="2 cm {x}") == "3 steps, 2 cm {x}"
    assert translation.translated("as it is {x}") == "as it is {x}"
