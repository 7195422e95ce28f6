"""Flights on their way to another machine: the files of their user go with them, known by their content.

A machine that flies keeps each set of files once, in a folder named by the hash of their names and content. So the law,
the airframe and the track of a flight have other paths there, and the same content and last names: the flight has the
same key.
"""

import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import aircraft
from autopilot.laws import law
from harness.files import content_hash, read
from harness.flight import Flight
from harness.key import hashed
from harness.settings.law_source import FILES
from harness.settings.laws import kind_of, parameters, source_of

Parcel = Mapping[str, bytes]  # the content of files, by their path below the folder of the parcel
_SUFFIXES = (".toml", ".xml")  # of the files of an airframe
_NO_LAW = law("nftsm")  # stands for a law that is not unpacked yet


class ParcelPlace(NamedTuple):
    """Where something lies: the number of a parcel, and a path in it."""

    parcel: str
    path: str

    def below(self, folder: Path) -> Path:
        """Its path where the parcels are in `folder`."""
        return folder / self.parcel / self.path


class FileLaw(NamedTuple):
    """A user-defined law from a file."""

    at: ParcelPlace
    class_name: str
    values: Mapping[str, Any]  # of its fields


class Packed(NamedTuple):
    """A flight without the paths of its user."""

    flight: Flight  # without what follows, where that is given
    law: FileLaw | None
    airframe: ParcelPlace | None
    track: ParcelPlace | None

    @property
    def parcels(self) -> set[str]:
        """The numbers of the parcels that it needs."""
        return {place.parcel for place in (self.law and self.law.at, self.airframe, self.track) if place}


@dataclass(slots=True)
class Parcels:
    """The parcels of a run, each read once."""

    content: dict[str, Parcel] = field(default_factory=dict)  # by number
    _known: dict[object, ParcelPlace] = field(default_factory=dict)  # by the requested object

    def packed(self, flight: Flight) -> Packed:
        """The flight, whose files are kept in `content`. Raises OSError when one is missing."""
        own, track, airframe = source_of(flight.law), flight.target.track, None
        carried = None
        if own and not own.is_module:
            names = {label.removeprefix(FILES): path for label, path in own.files.items()}
            at = self._place(("law", own.name, *own.hashes.values()), names, own.main.name)
            carried, flight = FileLaw(at, own.class_name, parameters(flight.law)), replace(flight, law=_NO_LAW)
        if flight.aircraft not in aircraft.names():
            airframe = self._airframe(aircraft.folder(flight.aircraft))
            flight = replace(flight, aircraft="")
        at_track = None
        if track is not None:
            name = Path(track).name
            at_track = self._place(("track", track), {name: Path(track)}, name)
            flight = replace(flight, target=replace(flight.target, track=None))
        return Packed(flight, carried, airframe, at_track)

    def _airframe(self, folder: Path) -> ParcelPlace:
        if aircraft.is_recorded(folder):
            return self._place(("aircraft", folder), {folder.name: folder}, folder.name)
        if ("aircraft", folder) in self._known:
            return self._known["aircraft", folder]
        files = [path for path in folder.iterdir() if path.suffix in _SUFFIXES and path.is_file()]
        return self._place(("aircraft", folder), {f"{folder.name}/{path.name}": path for path in files}, folder.name)

    def _place(self, what: object, files: Mapping[str, Path], path: str) -> ParcelPlace:
        if what not in self._known:
            parcel = {name: read(path) for name, path in files.items()}
            number = hashed({name: content_hash(content) for name, content in parcel.items()})
            self.content[number] = parcel
            self._known[what] = ParcelPlace(number, path)
        return self._known[what]


def unpacked(packed: Packed, folder: Path) -> Flight:
    """The flight where its parcels are in `folder`. Raises `LawError` for a law that cannot be loaded here."""
    flight = packed.flight
    if packed.law:
        kind = kind_of(f"{packed.law.at.below(folder)}:{packed.law.class_name}", run=True)
        flight = replace(flight, law=kind.value(**packed.law.values))
    if packed.airframe:
        flight = replace(flight, aircraft=str(packed.airframe.below(folder)))
    if packed.track:
        flight = replace(flight, target=replace(flight.target, track=str(packed.track.below(folder))))
    return flight


def keep(parcels: Mapping[str, Parcel], folder: Path) -> None:
    """Writes the parcels that `folder` lacks; each is there completely or not at all."""
    for number, parcel in parcels.items():
        if (folder / number).exists():
            continue
        partial = folder / f".{number}.{os.getpid()}"
        for name, content in parcel.items():
            (partial / name).parent.mkdir(parents=True, exist_ok=True)
            (partial / name).write_bytes(content)
        try:
            partial.rename(folder / number)
        except OSError:  # another process was first
            shutil.rmtree(partial, ignore_errors=True)
