"""Comparison of flights that differ in one setting, for notebooks."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from harness.error import did_you_mean
from harness.log.metric import METRICS
from harness.margins import Assess
from harness.runs.comparable import Comparable, comparable
from harness.runs.results import as_results
from harness.settings.columns import DIRECTORY
from harness.settings.laws import short_names
from harness.toml_text import shown
from harness.verdict.comparison import Comparison, compare_flights
from harness.verdict.pairs import CompareError, settings_of, usual

_NEEDED = ("key", "outcome", "plant", "aircraft", "seed", "duration_s", "law.name", "law.standoff_m", *METRICS)


def compare(
    results: str | Path | pd.DataFrame | Sequence[str | Path],
    by: str | None = None,
    baseline: object = None,
    where: Mapping[str, object] | None = None,
    *,
    assess: Assess | None = None,
) -> Comparison:
    """Pairs the flights that differ in the setting `by` alone, and compares their metrics.

    - `results`: a directory of `run`, several of them, or a DataFrame as `load_results` or `pd.read_parquet` gives it.
    - `by`: the setting, a column of the results; single gains change with a law or its set, nothing else does. None is
      the plant where several were flown, else the law or the first setting that varies; of several directories it is
      "directory": the same settings flown by other code or libraries, or with other settings throughout.
    - `baseline`: its value that the others are compared with; None is the lowest plant, or the first value.
    - `where`: only flights with these settings, as in `{"wind.turbulence": "none"}`; a list holds several values.
    - `assess`: the margins of the verdict; None: those that the run's settings say, of a DataFrame the defaults.

    Raises `CompareError` with what is missing or unknown, and what there is; `StoreError` without results.

    >>> comparison = harness.compare("out/wind", where={"aircraft": "aerosonde"})
    >>> print(comparison.answer)
    >>> comparison.differences.query("metric == 'range_error_rms_m'")
    >>> harness.compare(["out/before", "out/after"]).answer
    """
    if isinstance(results, pd.DataFrame):
        given = Comparable(_checked(results), Assess(), "")
    else:
        folders = [Path(results)] if isinstance(results, str | Path) else list(map(Path, results))
        by = by or (DIRECTORY if len(folders) > 1 else None)
        given = comparable(folders, by)
    return compare_chosen(given if assess is None else given._replace(assess=assess), by, baseline, where or {})


def compare_chosen(given: Comparable, by: str | None, baseline: object, where: Mapping[str, object]) -> Comparison:
    """The flights with these settings compared. Raises `CompareError` with what is missing or unknown."""
    flights = chosen(given.flights, where)
    by = by or usual(flights)
    known = [*([DIRECTORY] if DIRECTORY in flights else []), *settings_of(flights)]
    if by not in known:
        raise CompareError(_unknown("by", by, known))
    return compare_flights(flights, given.assess, by, baseline, given.question, given.changed)


def _checked(results: pd.DataFrame) -> pd.DataFrame:
    """The flights, each once, with rows that are numbered anew. CompareError when it is no table of results."""
    missing = [name for name in _NEEDED if name not in results]
    if missing:
        raise CompareError(
            f"the table has no column {', '.join(missing)}: it must be as harness.load_results gives it, "
            f"and has {', '.join(map(str, results.columns)) or 'none'}"
        )
    return as_results(results.drop_duplicates("key").reset_index(drop=True))


def chosen(flights: pd.DataFrame, where: Mapping[str, object]) -> pd.DataFrame:
    """The flights with these settings, a list for several values of one. Raises `CompareError` with what there is."""
    for key, wanted in where.items():
        if key not in settings_of(flights):
            raise CompareError(_unknown("where", key, settings_of(flights)))
        column = flights[key]
        values = wanted if isinstance(wanted, list) else [wanted]
        if column.map(lambda value: isinstance(value, tuple)).any() and not any(isinstance(v, tuple) for v in values):
            values = [tuple(values)]  # a setting that is a list itself
        there = list(dict.fromkeys(column))
        if key == "law.name":
            full = {name: own for own, name in short_names(there).items()}
            values = [full.get(str(value), value) for value in values]
        for value in values:
            if value not in there:
                known = ", ".join(map(str, there[:20])) + (", ..." if len(there) > 20 else "")
                hint = did_you_mean(value, map(str, there))
                asked = f"{value:g}" if isinstance(value, float) else shown(value)
                raise CompareError(f"where: no flight has {key} = {asked}{hint}; there is {known}")
        flights = flights[column.isin(values)]
        if not len(flights):
            raise CompareError(f"where: no flight is left that has {shown(where)}")
    return flights.reset_index(drop=True)


def _unknown(what: str, key: str, known: Sequence[str]) -> str:
    ending = [name for name in known if name.rpartition(".")[2].startswith(key)]
    hint = f" - did you mean {ending[0]!r}?" if ending else did_you_mean(key, known)
    return f"{what}: no setting is called {key!r}{hint}; the settings are {', '.join(known)}"
