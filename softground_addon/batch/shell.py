"""Command lines as text that a shell takes apart again into the same words."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence

from ..core.errors import InputError

_PLAIN = re.compile(r"[\w\\/:.=+@~-]+", re.ASCII)
"""Words that the Windows shell leaves alone."""

_SPECIAL = re.compile(r'[()%!^"<>&|]')
"""Characters that the Windows shell acts on outside quotation marks, unless a caret stands before them."""


def command_line(words: Sequence[str], *, windows: bool) -> str:
    r"""The words of a command line as text for a terminal.

    Parameters
    ----------
    words : sequence of str
        The program and its arguments.
    windows : bool
        For the Command Prompt of Windows; otherwise for a POSIX shell.

    Raises
    ------
    InputError
        If a word cannot be typed: it is not Unicode text, or holds a line break on Windows.

    References
    ----------
    How programs on Windows take their arguments apart: Microsoft, "Parsing C command-line arguments".

    Examples
    --------
    >>> print(command_line(["blender", "it's.blend"], windows=False))
    blender 'it'"'"'s.blend'
    >>> print(command_line([r"C:\Program Files\blender.exe", "a & b.blend"], windows=True))
    "C:\Program Files\blender.exe" "a & b.blend"
    """
    for word in words:
        if any("\ud800" <= letter <= "\udfff" for letter in word):
            raise InputError(f"{word!r} is not Unicode text: rename the file.")
        if windows and re.search(r"[\r\n]", word):
            raise InputError(f"{word!r} holds a line break, which the Command Prompt does not take: rename it.")
    return " ".join(map(_for_command_prompt, words)) if windows else shlex.join(words)


def _for_command_prompt(word: str) -> str:
    if _PLAIN.fullmatch(word):
        return word
    quoted = '"' + re.sub(r'(\\*)(?="|$)', r"\1\1", word).replace('"', r"\"") + '"'
    # inside quotation marks a % would still name a variable, and a " would end them
    return _SPECIAL.sub(r"^\g<0>", quoted) if re.search('[%"]', word) else quoted
