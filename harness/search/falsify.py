"""A search for the settings that violate a requirement most: the prober receives the robustness of each trial."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from harness.error import SettingsError
from harness.plants.ladder import PLANTS, rung
from harness.plants.plant import Outcome
from harness.requirement import OUTCOME, Requirement
from harness.runs.run import Options, Progress
from harness.search.dimension import SearchError
from harness.search.flown import Candidate, fly_search
from harness.search.prober import Probe, Prober
from harness.search.space import Space
from harness.search.tune import AT_ONCE, PATIENCE
from harness.verdict.statistics import upper_bound

GUIDING = 64  # trials of a guide; independent of the number of flights, so that a search can be extended
_REFUSED = 1.0  # robustness of invalid settings, for the prober only
_UNKNOWN = -1.0  # robustness of a missing number, as of a wrong truth value


class Trial(NamedTuple):
    """Settings that were flown, and the robustness of the worst of their flights."""

    candidate: Candidate
    uniform: bool  # drawn uniformly from the ranges
    robustness: float | None  # below 0 the requirement is broken; None: a flight failed, so that nothing is known
    broken: bool
    decisive: int  # the condition in which it does worst


class UpperBound(NamedTuple):
    """The bound from the uniform trials on the share of the ranges in which the requirement is violated."""

    trials: int
    broken: int
    failed: int  # of them a flight failed: they count as broken
    share: float  # at most, with 95 % confidence


@dataclass(slots=True, kw_only=True)
class Falsification:
    """A search for the settings that break a requirement most, and its trials so far."""

    space: Space
    requirement: Requirement
    flights: int  # at most
    seed: int
    trials: list[Trial]
    refused: list[str]  # the first line of what is wrong, of settings that no flight can have
    progress: Progress
    guide: "Falsification | None" = None  # the same search on a cheaper plant, which is flown first
    prober: Prober = field(init=False)

    def __post_init__(self) -> None:
        self.prober = Prober(len(self.space.dimensions), self.seed)

    def fly(self, folder: Path, options: Options) -> Iterator[Progress]:
        """Searches, and yields the progress: see `fly_search`."""
        yield from fly_search(self.batches(), self.space.matrix, folder, options, self.progress)

    def batches(self) -> Iterator[Sequence[Candidate]]:
        """The candidates to be flown next; each batch is judged before the next one is requested."""
        if self.guide:
            yield from self._guided(self.guide)
        prober = self.prober
        conditions = len(self.space.conditions)
        count, size = self.flights // conditions, -(-AT_ONCE // conditions)
        while len(self.trials) < count:
            batch: list[tuple[Probe, bool, Candidate]] = []
            while len(batch) < min(size, count - len(self.trials)):
                uniform = prober.is_uniform(len(self.trials) + len(batch))
                asked = self._asked(prober, uniform)
                if asked is None:
                    break
                batch.append((asked[0], uniform, asked[1]))
            if not batch:
                return
            yield [candidate for _, _, candidate in batch]
            for probe, uniform, candidate in batch:
                trial = self._judged(candidate, uniform)
                self.trials.append(trial)
                if trial.robustness is not None:
                    prober.tell(probe, trial.robustness)
            if self.worst:
                self.progress.note = f"{len(self.broken)} broken, worst {self.value(self.worst)}"

    def _guided(self, guide: "Falsification") -> Iterator[Sequence[Candidate]]:
        """The batches of the guide, whose result becomes the prober's prior; only one if it lacks the metric."""
        for cheap in guide.batches():
            if guide.trials and not guide.knows:
                self.progress.total -= (GUIDING - len(guide.trials)) * len(guide.space.conditions)
                return
            yield cheap
            self.progress.note = f"on {guide.plant}, as a guide: {guide.progress.note}"
        self.prober = Prober(len(self.space.dimensions), self.seed, guide.prober.guide)

    def _asked(self, prober: Prober, uniform: bool) -> tuple[Probe, Candidate] | None:
        """Valid settings; None if none are found."""
        names = [self.requirement.name] if self.requirement.is_foreseen else []
        for _ in range(PATIENCE):
            probe = prober.ask(uniform)
            values = {d.key: d.value(x) for d, x in zip(self.space.dimensions, probe.at.tolist(), strict=True)}
            try:
                return probe, self.space.candidate(values, names)
            except SettingsError as error:
                prober.tell(probe, _REFUSED)
                self.refused.append(error.lines[0])
        return None

    def _judged(self, candidate: Candidate, uniform: bool) -> Trial:
        distances = [self.requirement.distance(facts) for facts in candidate.facts]
        distances = [x if math.isfinite(x) else _UNKNOWN for x in distances]
        decisive = distances.index(min(distances))
        if any(Outcome(str(facts[OUTCOME])).failed for facts in candidate.facts):
            return Trial(candidate, uniform, None, False, decisive)
        broken = not all(map(self.requirement.is_met, candidate.facts))
        return Trial(candidate, uniform, distances[decisive], broken, decisive)

    @property
    def plant(self) -> str:
        """The highest plant of the conditions."""
        return max((str(flight.plant) for flight in self.space.middle.flights), key=rung)

    @property
    def knows(self) -> bool:
        """Whether any flight had a value of the requirement's name."""
        return any(facts.get(self.requirement.name) is not None for t in self.trials for facts in t.candidate.facts)

    @property
    def worst(self) -> Trial | None:
        """The trial that violates the requirement most, or comes closest to it; the earliest of equal ones."""
        known = [trial for trial in self.trials if trial.robustness is not None]
        return min(known, key=lambda trial: (not trial.broken, trial.robustness), default=None)

    @property
    def broken(self) -> Sequence[Trial]:
        """The trials that break the requirement, the worst first."""
        return sorted((t for t in self.trials if t.broken), key=lambda trial: trial.robustness or 0.0)

    @property
    def bound(self) -> UpperBound:
        """The upper bound on the share of the ranges that breaks the requirement."""
        drawn = [trial for trial in self.trials if trial.uniform]
        failed = sum(trial.robustness is None for trial in drawn)
        broken = sum(trial.broken for trial in drawn)
        return UpperBound(len(drawn), broken, failed, upper_bound(broken + failed, len(drawn)))

    @property
    def first_broken(self) -> int | None:
        """The number of the first trial that broke the requirement, from 1."""
        return next((i for i, trial in enumerate(self.trials, start=1) if trial.broken), None)

    def value(self, trial: Trial) -> str:
        """The value of the requirement's name in the trial's worst flight."""
        fact = trial.candidate.facts[trial.decisive].get(self.requirement.name)
        return "unknown" if fact is None else f"{fact:.4g}" if isinstance(fact, float) else str(fact).lower()


def falsification(
    space: Space, requirement: Requirement, *, flights: int, seed: int = 0, guide: Space | None = None
) -> Falsification:
    """A search, not begun; `guide`: the space on the plant that guides it. Raises `SearchError`."""
    conditions = len(space.conditions)
    if flights < conditions:
        raise SearchError(f"--flights is {flights}, must be {conditions} at least, which is one trial")
    total = flights // conditions * conditions
    cheap = None
    if guide:
        guiding = GUIDING * len(guide.conditions)
        cheap = falsification(guide, requirement, flights=guiding, seed=seed)
        total += guiding
    return Falsification(
        space=space, requirement=requirement, flights=flights, seed=seed, trials=[], refused=[],
        progress=Progress(total), guide=cheap,
    )  # fmt: skip


def guide_to(space: Space, asked: str | None) -> Space | None:
    """The space on the plant that guides a search: the requested plant, or else the nearest cheaper one.

    By default only 6-DOF flights have a guide, if it can fly their settings. Raises `SearchError` and `SettingsError`.
    """
    plants = {str(flight.plant) for flight in space.middle.flights}
    if asked is not None:
        if not all(rung(asked) < rung(plant) for plant in plants):
            raise SearchError(f"--guide {asked}: must be a cheaper plant than {', '.join(sorted(plants, key=rung))}")
        return space.on(asked)
    cheap = [name for name, kind in PLANTS.items() if not kind.has_body]
    if not all(PLANTS[plant].has_body for plant in plants):
        return None
    try:
        guide = space.on(cheap[-1])
        guide.middle  # noqa: B018  # whether it can be flown
    except SettingsError:
        return None
    return guide
