"""The guidance laws by name, each with its named gain sets."""

import warnings
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from inspect import signature
from types import MappingProxyType
from typing import NamedTuple

from autopilot import l1, lgvf, lq_orbit, nftsm, nftsm_lead, npfg, orbit_field, smc
from autopilot.guidance import Law
from autopilot.rules import Rule


class LawKind(NamedTuple):
    """A law's class and its gain sets: those with numbers, and those that follow from a rule."""

    value: type[Law]
    gain_sets: Mapping[str, Mapping[str, float]]
    default: str  # the gain set of a law that names none: one with which it converges
    rules: Mapping[str, Rule] = MappingProxyType({})
    former_names: Mapping[str, str] = MappingProxyType({})  # of gain sets: still read, with a warning

    @property
    def sets(self) -> list[str]:
        """The names of all gain sets."""
        return [*self.gain_sets, *self.rules]

    def numbers(self, gains: str) -> Mapping[str, float]:
        """The numbers of a gain set; of a rule those that it starts from. Of any other set there are none."""
        return self.gain_sets.get(self.rules[gains].base if gains in self.rules else gains, {})


LAWS: Mapping[str, LawKind] = MappingProxyType(
    {
        # The set `paper` is what Table 2 prints for NFTSM, and never converges: see docs/answers/fitted.md.
        "nftsm": LawKind(
            nftsm.Nftsm, nftsm.GAIN_SETS, "fitted", nftsm.RULES, MappingProxyType({"identified": "fitted"})
        ),
        "smc": LawKind(smc.Smc, smc.GAIN_SETS, "paper", smc.RULES),
        "nftsm_lead": LawKind(nftsm_lead.NftsmLead, nftsm_lead.GAIN_SETS, "calm", nftsm_lead.RULES),
        "lq_orbit": LawKind(lq_orbit.LqOrbit, lq_orbit.GAIN_SETS, "slow", lq_orbit.RULES),
        "l1": LawKind(l1.L1, l1.GAIN_SETS, "published", l1.RULES),
        "npfg": LawKind(npfg.Npfg, npfg.GAIN_SETS, "published", npfg.RULES),
        "lgvf": LawKind(lgvf.Lgvf, lgvf.GAIN_SETS, "published", lgvf.RULES),
        "orbit_field": LawKind(orbit_field.OrbitField, orbit_field.GAIN_SETS, "published", orbit_field.RULES),
    }
)


def law(name: str, gains: str | None = None, **parameters: float | str) -> Law:
    """A guidance law by name with a named gain set, the law's default without one; a frozen value.

    `parameters` override single gains and what all laws have: `standoff` (m), `max_heading_rate` (rad/s, not degrees),
    `direction`, `airspeed`, `command`. `harness list laws` shows all of them.

    Raises ValueError for a law, a gain set or a parameter that there is not, with those that there are, and for a gain
    set that follows from a flight by a rule; FutureWarning
    for the former name of a gain set.

    >>> harness.law("nftsm")
    >>> harness.law("nftsm", "paper_1", k2=4.0, max_heading_rate=math.radians(10.0))
    """
    if name not in LAWS:
        raise ValueError(_unknown("law", name, LAWS))
    return made(name, LAWS[name], gains, **parameters)


def made(name: str, kind: LawKind, gains: str | None, **parameters: float | str) -> Law:
    """The gain sets of any law; a law without gain sets has its own defaults."""
    gains = kind.default if gains is None else gains
    if gains in kind.former_names:
        warnings.warn(renamed(gains, kind.former_names[gains]), FutureWarning, stacklevel=2)
        gains = kind.former_names[gains]
    if kind.sets and gains not in kind.sets:
        raise ValueError(_unknown(f"gain set of {name}", gains, kind.sets))
    known = [parameter for parameter in signature(kind.value).parameters if parameter != "gains"]
    if gains in kind.rules:
        raise ValueError(f"the gain set {gains!r} of {name} follows from a flight by a rule: give the flight")
    for parameter in parameters:
        if parameter not in known:
            raise ValueError(_unknown(f"parameter of {name}", parameter, known))
    named = {"gains": gains} if gains and "gains" in signature(kind.value).parameters else {}
    return kind.value(**{**named, **kind.numbers(gains), **parameters})


def _unknown(what: str, name: str, known: Collection[str]) -> str:
    near = get_close_matches(str(name), known, n=1)
    hint = f" - did you mean {near[0]!r}?" if near else ""
    return f"no {what} is called {name!r}: there is {', '.join(known)}{hint}"


def renamed(former: str, today: str) -> str:
    """The deprecation message for a gain set that is given by its former name."""
    return f'deprecated: the gain set "{former}" was renamed "{today}"; the old name will be removed'
