"""Errors that a user can act on: each message says what is wrong and what to do about it."""


class SoftGroundError(Exception):
    """Base of all errors that are shown to the user instead of a traceback."""


class InputError(SoftGroundError):
    """Something that the user gave cannot be used as it is; nothing was changed."""


class BakeError(SoftGroundError):
    """A bake ran and its result failed a check; nothing was kept."""
