"""A search for the best settings: each trial is flown over all conditions, and its result is passed to the sampler."""

import math
import statistics
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from harness.error import SettingsError, did_you_mean
from harness.log.metric import METRICS
from harness.requirement import OUTCOME, Facts, Requirement
from harness.runs.run import Options, Progress
from harness.search.dimension import SearchError
from harness.search.flown import Candidate, fly_search
from harness.search.sampler import Ask, Sampler
from harness.search.space import Space

_MOST_GOALS = 2
AGGREGATES = ("worst", "mean")
AT_ONCE = 8  # least number of flights in a batch of trials, independent of the number of workers
PATIENCE = 300  # candidates refused in a row, before a search ends
_LEAST = 1e-9  # violation of a requirement exactly at its border
_NEAR = 0.1  # margin over the value, below which a requirement counts as active
_END = 0.02  # share of a range: a setting this near to an end is constrained by it


class Attempt(NamedTuple):
    """A trial: its settings, its results, and the requirement that rejected it."""

    candidate: Candidate
    goals: tuple[float, ...]  # the smaller, the better; empty when it was refused
    refused_by: str = ""  # empty when it meets everything that is required
    was_flown: bool = True


@dataclass(slots=True, kw_only=True)
class Tuning:
    """A search for the settings that minimise one or two metrics, and its trials so far."""

    space: Space
    goals: Sequence[str]  # metrics: minimised is the distance from their ideal value
    requirements: Sequence[Requirement]  # of every flight
    aggregate: str  # of a goal over the conditions: one of AGGREGATES
    flights: int  # at most
    seed: int
    attempts: list[Attempt]
    progress: Progress

    def fly(self, folder: Path, options: Options) -> Iterator[Progress]:
        """Searches, and yields the progress at least a few times a second; the flights are kept in `folder`.

        What is kept there is not flown again: the same search goes on where it stopped. Raises `StoreError` and
        `WorkersError`.
        """
        yield from fly_search(self.batches(), self.space.matrix, folder, options, self.progress)

    def batches(self) -> Iterator[Sequence[Candidate]]:
        """The candidates to be flown next; each batch is judged before the next one is requested."""
        sampler = Sampler(self.space.dimensions, len(self.goals), self.seed)
        conditions = len(self.space.conditions)
        left, size = self.flights // conditions, -(-AT_ONCE // conditions)
        while left > 0:
            batch: list[tuple[Ask, Candidate]] = []
            while len(batch) < min(size, left) and (asked := self._asked(sampler)):
                batch.append(asked)
            if not batch:
                return
            left -= len(batch)
            yield [candidate for _, candidate in batch]
            for ask, candidate in batch:
                self._judge(sampler, ask, candidate)

    def _asked(self, sampler: Sampler) -> tuple[Ask, Candidate] | None:
        """A candidate that meets the predicted constraints; None if none is found."""
        beforehand = [one for one in self.requirements if one.is_foreseen]
        for _ in range(PATIENCE):
            ask = sampler.ask()
            try:
                candidate = self.space.candidate(ask.values, [one.name for one in beforehand])
            except SettingsError as error:
                sampler.tell(ask, 1.0)
                self.attempts.append(Attempt(Candidate(ask.values, (), ()), (), f"a setting: {error.lines[0]}", False))
                continue
            refused_by, off = _missed(beforehand, candidate.foreseen)
            if not refused_by:
                return ask, candidate
            sampler.tell(ask, off)
            self.attempts.append(Attempt(candidate, (), refused_by, False))
        return None

    def _judge(self, sampler: Sampler, ask: Ask, candidate: Candidate) -> None:
        refused_by, off = _missed(self.requirements, candidate.facts)
        reached = [self._reached(goal, candidate.facts) for goal in self.goals]
        without = [goal for goal, value in zip(self.goals, reached, strict=True) if value is None]
        if without and not refused_by:
            refused_by, off = f"{without[0]} (a flight has none)", 1.0
        if refused_by:
            sampler.tell(ask, off)
            self.attempts.append(Attempt(candidate, (), refused_by))
            return
        goals = tuple(value for value in reached if value is not None)
        sampler.tell(ask, off, goals)
        self.attempts.append(Attempt(candidate, goals))
        best = min(attempt.goals[0] for attempt in self.attempts if attempt.goals)
        self.progress.note = f"best {self.goals[0]} {best:.3g}"

    def _reached(self, goal: str, facts: Sequence[Facts]) -> float | None:
        """The distance of a metric from its ideal over the conditions; None where a flight does not have it."""
        values = [fact.get(goal) for fact in facts]
        known = [abs(float(value) - METRICS[goal].ideal) for value in values if value is not None]
        if len(known) < len(values):
            return None
        return max(known) if self.aggregate == "worst" else statistics.fmean(known)

    @property
    def trials(self) -> int:
        """How many were flown."""
        return sum(attempt.was_flown for attempt in self.attempts)

    @property
    def front(self) -> Sequence[Attempt]:
        """The Pareto-optimal attempts in the order of the first goal; with one goal only the best."""
        found = [attempt for attempt in self.attempts if attempt.goals]
        front: list[Attempt] = []
        for attempt in sorted(found, key=lambda attempt: attempt.goals):
            if all(any(x < y for x, y in zip(attempt.goals, other.goals, strict=True)) for other in front):
                front.append(attempt)
        return front

    @property
    def refusals(self) -> Mapping[str, tuple[int, bool]]:
        """By reason of rejection: the number of attempts, and whether before a flight; the most frequent first."""
        counts = Counter((attempt.refused_by, not attempt.was_flown) for attempt in self.attempts if attempt.refused_by)
        return {what: (count, before) for (what, before), count in counts.most_common()}

    @property
    def unchecked(self) -> Mapping[str, int]:
        """What is asked only where it is known: in how many trials that were flown it was unknown for a flight."""
        flown = [attempt.candidate.facts for attempt in self.attempts if attempt.was_flown]
        return {
            one.name: sum(any(facts.get(one.name) is None for facts in trial) for trial in flown)
            for one in self.requirements
            if one.where_known
        }

    def decisive(self, attempt: Attempt) -> int:
        """The number of the condition in which an attempt is worst in the first goal."""
        ideal = METRICS[self.goals[0]].ideal
        values = [abs(float(facts.get(self.goals[0]) or 0.0) - ideal) for facts in attempt.candidate.facts]
        return values.index(max(values))

    def least(self, attempt: Attempt, name: str) -> float | bool | None:
        """The value of this name with the smallest margin to its requirements, among the flights of an attempt."""
        asked = [one for one in self.requirements if one.name == name]
        facts = min(attempt.candidate.facts, key=lambda facts: min(one.distance(facts) for one in asked))
        fact = facts.get(name)
        return None if isinstance(fact, str) else fact

    def constrained(self, attempt: Attempt) -> Iterator[str]:
        """The active constraints of an attempt, in words: requirements barely met, ends of ranges."""
        for one in self.requirements:
            facts = min(attempt.candidate.facts, key=one.distance)
            fact = facts.get(one.name)
            if isinstance(fact, float) and one.distance(facts) <= _NEAR:
                yield f"{one} (it has {fact:.3g})"
        for d in self.space.dimensions:
            share = d.share(attempt.candidate.values[d.key])
            if min(share, 1.0 - share) <= _END:
                yield f"the {'low' if share < 0.5 else 'high'} end of {d}"


def tuning(
    space: Space,
    goals: Sequence[str],
    requirements: Sequence[Requirement],
    *,
    margin: float,
    aggregate: str = "worst",
    flights: int,
    seed: int = 0,
) -> Tuning:
    """A search, not begun. By default flights must complete, with at least `margin` to the limit cycle.

    Raises `SearchError`.
    """
    conditions = len(space.conditions)
    if flights < conditions:
        raise SearchError(f"--flights is {flights}, must be {conditions} at least, which is one trial")
    for goal in goals:
        if goal not in METRICS:
            raise SearchError(
                f"--minimise {goal}: must be a metric, see `harness list metrics`{did_you_mean(goal, METRICS)}"
            )
    if len(set(goals)) < len(goals) or len(goals) > _MOST_GOALS:
        raise SearchError(f"--minimise is {', '.join(goals)}, must be one metric or two different ones")
    named = {one.name for one in requirements}
    usual = [
        Requirement("limit_cycle_margin", ">=", margin, where_known=True),
        Requirement(OUTCOME, "=", "completed"),
    ]
    asked = [*(one for one in usual if one.name not in named), *requirements]
    total = flights // conditions * conditions
    return Tuning(
        space=space, goals=goals, requirements=asked, aggregate=aggregate, flights=flights, seed=seed, attempts=[],
        progress=Progress(total),
    )  # fmt: skip


def _missed(requirements: Sequence[Requirement], facts: Sequence[Facts]) -> tuple[str, float]:
    """The first requirement that a flight violates, in words, and the violation; negative: the margin."""
    off = max((-min(map(one.distance, facts)) for one in requirements), default=-math.inf)
    missed = [one for one in requirements if not all(map(one.is_met, facts))]
    if not missed:
        return "", min(off, 0.0)
    first = missed[0]
    unknown = any(fact.get(first.name) is None for fact in facts if not first.is_met(fact))
    return f"{first}{' (unknown)' if unknown else ''}", max(off, _LEAST)
