"""The guidance laws by name, each with its named gain sets."""

import warnings
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from autopilot import nftsm, smc
from autopilot.guidance import Law


class LawKind(NamedTuple):
    """A law's class and its gain sets."""

    value: type[Law]
    gain_sets: Mapping[str, Mapping[str, float]]
    default: str  # the gain set of a law that names none: one with which it converges
    former_names: Mapping[str, str] = MappingProxyType({})  # of gain sets: still read, with a warning


LAWS: Mapping[str, LawKind] = MappingProxyType(
    {
        # The set `paper` is what Table 2 prints for NFTSM, and never converges: see docs/answers/fitted.md.
        "nftsm": LawKind(nftsm.Nftsm, nftsm.GAIN_SETS, "fitted", MappingProxyType({"identified": "fitted"})),
        "smc": LawKind(smc.Smc, smc.GAIN_SETS, "paper"),
    }
)


def law(name: str, gains: str | None = None, **parameters: float | str) -> Law:
    """A law by name with a named gain set, the law's default without one.

    `parameters` (SI, rad) override single gains. KeyError for an unknown law or gain set; FutureWarning for the former
    name of a gain set.
    """
    kind = LAWS[name]
    gains = kind.default if gains is None else gains
    if gains in kind.former_names:
        warnings.warn(renamed(gains, kind.former_names[gains]), FutureWarning, stacklevel=2)
        gains = kind.former_names[gains]
    return kind.value(**{"gains": gains, **kind.gain_sets[gains], **parameters})


def renamed(former: str, today: str) -> str:
    """What a user is told who gives a gain set by its former name."""
    return f'the gain set "{former}" is now called "{today}"; the former name is still read, for a while'
