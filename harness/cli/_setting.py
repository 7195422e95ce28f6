"""KEY=VALUE on the command line: what a shell offers to complete it."""

from __future__ import annotations

from collections.abc import Iterator

import click
from click.shell_completion import CompletionItem


class SettingType(click.ParamType[str]):
    """A setting: any text, which the settings file checks; `table` is the one table whose keys a shell offers."""

    name = "setting"

    def __init__(self, table: str = "") -> None:
        self.table = table

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """The keys that begin so; once the key is known, also the values that it is known to have."""
        name, equals, _ = incomplete.partition("=")
        meanings = {key: meaning for key, meaning in _keys() if key.startswith(self.table)}
        begun = [key for key in meanings if key == name or (not equals and key.startswith(name))]
        offered = [f"{key}=" for key in begun]
        if len(begun) == 1:  # its values as well: a shell does not end a word that may go on
            offered += [f"{begun[0]}={value}" for value in _values(begun[0])]
        return [
            CompletionItem(text, help=meanings[text.partition("=")[0]])
            for text in offered
            if text.startswith(incomplete) and text != incomplete
        ]


SETTING = SettingType()
MARGIN = SettingType("assess.")


def _keys() -> Iterator[tuple[str, str]]:
    """Each key in its dotted form, and its meaning."""
    from harness.settings.catalogue import TABLES, keys_of

    for table in TABLES:
        if not table.is_list:
            yield from ((table.prefix + one.key, one.meaning) for one in keys_of(table))


def _values(key: str) -> list[str]:
    """The values of a closed list; of a gain those of the named sets; of any other key its default."""
    import aircraft
    from autopilot.laws import LAWS
    from harness.settings.catalogue import REQUIRED, TABLES, TRUTH, keys_of

    if key == "aircraft":
        return list(aircraft.names())
    sets = [gains for law in LAWS.values() for gains in law.gain_sets.values()]
    if in_sets := [f"{gains[gain]:g}" for gains in sets if (gain := key.removeprefix("law.")) in gains]:
        return list(dict.fromkeys(in_sets))
    one = next(one for table in TABLES for one in keys_of(table) if table.prefix + one.key == key)
    if one.choices or one.allowed == TRUTH:
        return list(one.choices) or ["true", "false"]
    return [] if one.default in ("", REQUIRED) or one.default.startswith("(") else [one.default.replace(" ", "")]
