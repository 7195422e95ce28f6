"""The errors that users meet: all have one base, and each message says what is wrong and what is allowed."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches


class HarnessError(Exception):
    """The base of the harness's errors: an input cannot be used."""


class SettingsError(HarnessError, ValueError):
    """Mistakes in the settings, one line for each: `lines`."""

    def __init__(self, lines: Sequence[str]) -> None:
        super().__init__("\n".join(lines))
        self.lines = list(lines)


class ArgumentError(HarnessError, ValueError):
    """An argument of a function that cannot be used."""


class RecordingError(HarnessError, OSError, ValueError):
    """A recording that cannot be read or written, or does not contain the requested flight."""


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """The end of a message about an unknown word: the nearest of those known, or nothing."""
    nearest = get_close_matches(str(word), list(known), n=1)
    return f" - did you mean {nearest[0]!r}?" if nearest else ""
