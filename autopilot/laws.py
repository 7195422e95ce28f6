"""The guidance laws by name, each with its named gain sets."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from autopilot import nftsm, smc
from autopilot.guidance import Law


class LawKind(NamedTuple):
    """A law's class and its gain sets; the set `paper` is every law's default."""

    value: type[Law]
    gain_sets: Mapping[str, Mapping[str, float]]


LAWS: Mapping[str, LawKind] = MappingProxyType(
    {
        "nftsm": LawKind(nftsm.Nftsm, nftsm.GAIN_SETS),
        "smc": LawKind(smc.Smc, smc.GAIN_SETS),
    }
)


def law(name: str, gains: str = "paper", **parameters: float | str) -> Law:
    """A law by name with a named gain set; `parameters` (SI, rad) override it. KeyError for unknown names."""
    kind = LAWS[name]
    return kind.value(**{"gains": gains, **kind.gain_sets[gains], **parameters})
