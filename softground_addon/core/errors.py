"""Errors that a user can act on, each with a code and facts for programs; their words name no part of any panel."""


class SoftGroundError(Exception):
    """Base of all errors that are shown to the user instead of a traceback.

    Attributes
    ----------
    code : str
        What kind of error it is; docs/library.md lists those of the library. Errors of Blender's side have none.
    facts : dict
        What it is about, in SI units: names, numbers, paths.
    message : str
        What is wrong, and mostly what to do.
    remedy : str
        What to do, where a panel may say it in words of its own.

    Examples
    --------
    >>> error = InputError("It is 2 m long", "length", remedy="make it shorter.", length=2.0)
    >>> str(error), error.code, error.facts
    ('It is 2 m long: make it shorter.', 'length', {'length': 2.0})
    """

    def __init__(self, message: str, code: str = "", *, remedy: str = "", **facts: object) -> None:
        super().__init__(message)
        self.message, self.code, self.remedy, self.facts = message, code, remedy, facts

    def __str__(self) -> str:
        return joined(self.message, self.remedy)


class InputError(SoftGroundError):
    """Something that the user gave cannot be used as it is; nothing was changed."""


class BakeError(SoftGroundError):
    """A bake ran and its result failed a check; nothing was kept."""


def joined(message: str, remedy: str) -> str:
    """What is wrong and what to do in one text."""
    return f"{message}{' ' if message.endswith('.') else ': '}{remedy}" if remedy else message


def damaged_record(error: BaseException, what: str = "record") -> InputError:
    """Error about what a bake has left in a file."""
    message = f"The stored {what} of the footprints is damaged ({error}): clear the bake and bake again."
    return InputError(message, "damaged_record")


def damaged(origin: str, what: str) -> InputError:
    """Error about what is written somewhere, such as in a file of a preset."""
    return InputError(f"{origin}: {what}", "damaged_text", origin=origin)
