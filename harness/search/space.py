"""The space of a search: the settings that are searched, and the conditions over which each trial is flown."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from harness.requirement import foreseen
from harness.runs.matrix import Combination, Matrix, read_matrix
from harness.search.dimension import Dimension, SearchError
from harness.search.flown import Candidate
from harness.settings import SettingsFile, overridden


class Space:
    """Dimensions over a settings file; the conditions are the flights of its [matrix], the same for every trial."""

    def __init__(self, file: SettingsFile, dimensions: Sequence[Dimension]) -> None:
        """Raises `SettingsError` and `SearchError`."""
        for i, one in enumerate(dimensions):
            if one.key in [other.key for other in dimensions[:i]]:
                raise SearchError(f"{one.option} {one}: {one.key} is given twice")
            if text := file.overrides.get(("flight", *one.key.split("."))):
                raise SearchError(f"{one.option} {one}: {text} gives it one value: leave one of them out")
        self.file, self.dimensions = file, dimensions
        lowest = {d.key: d.low for d in dimensions}
        self.matrix = read_matrix(self._with(file, lowest))  # a key that is searched is no axis of it
        self.conditions = list(self.matrix.combinations())

    def on(self, plant: str) -> "Space":
        """The same space on another plant. Raises `SettingsError` and `SearchError`."""
        return Space(overridden(self.file, [f"plant={plant}"], "--guide"), self.dimensions)

    @property
    def tried(self) -> Sequence[Matrix]:
        """The conditions at the low end, at the middle and at the high end of every range: for checks beforehand."""
        return [self.matrix, self._at(self._middle), self._at({d.key: d.high for d in self.dimensions})]

    @property
    def middle(self) -> Candidate:
        """The settings in the middle of every range."""
        return self.candidate(self._middle)

    def candidate(
        self,
        values: Mapping[str, float],
        names: Collection[str] = (),
        conditions: Sequence[Combination] | None = None,
    ) -> Candidate:
        """These settings over the conditions, by default all, with the predictions of these names.

        Raises `SettingsError`.
        """
        matrix = self._at(values)
        flights = [matrix.flight(condition) for condition in (self.conditions if conditions is None else conditions)]
        return Candidate(values, flights, [foreseen(flight, names) for flight in flights])

    @property
    def _middle(self) -> Mapping[str, float]:
        return {d.key: d.rounded(0.5 * (d.low + d.high)) for d in self.dimensions}

    def _at(self, values: Mapping[str, float]) -> Matrix:
        return replace(self.matrix, file=self._with(self.matrix.file, values))

    def _with(self, file: SettingsFile, values: Mapping[str, float]) -> SettingsFile:
        for d in self.dimensions:
            file = overridden(file, [f"{d.key}={values[d.key]!r}"], d.option)
        return file
