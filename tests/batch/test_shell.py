"""A command line survives the shell that it is pasted into."""

import re
import shlex
import subprocess

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from softground_addon.batch.shell import command_line
from softground_addon.core.errors import InputError

WORDS = st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=12), min_size=1, max_size=4)
PRINTABLE = st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\0\r\n"), max_size=12), max_size=4)
HOSTILE = st.lists(st.text('ab \\"%^&|<>()!=,;', max_size=12), max_size=4)


@given(WORDS)
def test_a_posix_shell_gets_the_same_words(words):
    assert shlex.split(command_line(words, windows=False)) == words


def test_a_real_shell_gets_the_same_words():
    words = ["it's", 'say "hi"', "two\nlines", "$HOME `x` %s", "-rf", "❄", "", "a\\"]
    line = command_line(["printf", "%s\\0", *words], windows=False)
    done = subprocess.run(["sh", "-c", line], capture_output=True, check=True)
    assert done.stdout.decode().split("\0")[:-1] == words


def command_prompt(line):
    """What the interactive Command Prompt passes on: variables put in, then carets and quotation marks read."""
    line = line.replace("%PATH%", "C:/Windows")  # a name that is no variable stays
    passed, inside, letters = "", False, iter(line)
    for letter in letters:
        if letter == "^" and not inside:
            passed += next(letters, "")
            continue
        assert inside or letter not in "&|<>()", f"{line!r} would run something else"
        inside ^= letter == '"'
        passed += letter
    return passed


def arguments_of(line):
    """The words as a program on Windows sees them, by the rules of `CommandLineToArgvW`."""
    words, position = [], 0
    while position < len(line):
        word, inside = "", False
        while position < len(line) and (inside or line[position] != " "):
            slashes, quote = re.compile(r'(\\*)("?)').match(line, position).groups()
            position += len(slashes) + len(quote)
            if quote:
                word += "\\" * (len(slashes) // 2)
                if len(slashes) % 2:
                    word += '"'
                else:
                    inside = not inside
            elif slashes:
                word += slashes
            else:
                word += line[position]
                position += 1
        words.append(word)
        position += 1
    return words


@given(HOSTILE | PRINTABLE)
@example(["%PATH%", 'say "%PATH%" & del *'])
@example(["ends in \\", 'slash\\"', "\\\\", ""])
def test_a_program_started_from_the_command_prompt_gets_the_same_words(words):
    line = command_line(["C:\\Program Files\\Blender\\blender.exe", *words], windows=True)
    assert arguments_of(command_prompt(line)) == ["C:\\Program Files\\Blender\\blender.exe", *words]


def test_what_needs_no_quotation_marks_has_none():
    words = ["C:\\blender.exe", "--background", "D:/shots/010.blend", "--set=material.layer_depth=0.4"]
    assert command_line(words, windows=True) == " ".join(words)


@pytest.mark.parametrize(("word", "windows"), [("bad\udcff.blend", False), ("bad\udcff.blend", True), ("a\nb", True)])
def test_what_cannot_be_typed_is_named(word, windows):
    with pytest.raises(InputError, match="rename"):
        command_line([word], windows=windows)
