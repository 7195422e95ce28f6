"""The shape of an aircraft in the scene, drawn with its own span and chord. Body axes, m."""

import numpy as np
import rerun as rr
from numpy.typing import NDArray

import aircraft
from harness.flight import Flight
from harness.review.styled import Colour, mixed

Array = NDArray[np.float64]
Corner = tuple[float, float, float]

_BLACK = (0, 0, 0)
_WHITE = (255, 255, 255)


def size(flight: Flight) -> tuple[float, float, bool]:
    """Span, m, mean chord, m, and whether there is a tail; those of a small aircraft where the files do not say."""
    try:
        data = aircraft.data(aircraft.folder(flight.aircraft))
        return float(data["ref"]["b"]["v"]), float(data["ref"]["c"]["v"]), bool(data["meta"]["has_rudder"])
    except (OSError, ValueError, KeyError, TypeError):
        return 1.5, 0.25, True


def airframe(flight: Flight, times: float, colour: Colour) -> rr.Mesh3D:
    """A mesh with the airframe's span and chord, enlarged `times`; the body and the tail are only sketched."""
    b, c, tail = size(flight)
    length = 0.75 * b if tail else 1.6 * c
    nose = 0.35 * length if tail else 0.9 * c
    bright, dark = mixed(colour, _WHITE, 0.25), mixed(colour, _BLACK, 0.45)
    sweep = 0.0 if tail else 0.22 * b
    root, tip = (0.5 * c, -0.5 * c), (0.5 * c - sweep, -0.5 * c - sweep) if tail else (-sweep, -sweep - 0.6 * c)
    right, left = (
        _quad((root[0], 0, 0), (tip[0], side, 0), (tip[1], side, 0), (root[1], 0, 0)) for side in (0.5 * b, -0.5 * b)
    )
    parts = [(bright, right), (mixed(colour, _BLACK, 0.2), left)]
    r, back = 0.06 * length, nose - length
    corners = [(0.6 * nose, r, 0.0), (0.6 * nose, 0.0, r), (0.6 * nose, -r, 0.0), (0.6 * nose, 0.0, -r)]
    for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
        parts += [(dark, _triangle((nose, 0, 0), p, q)), (dark, _triangle((back, 0, 0), p, q))]
    if tail:
        h = 0.16 * b
        parts += [
            (bright, _quad((back + 0.7 * c, h, 0), (back + 0.7 * c, -h, 0), (back, -h, 0), (back, h, 0))),
            (dark, _quad((back + 0.7 * c, 0, 0), (back + 0.2 * c, 0, -h), (back, 0, -h), (back, 0, 0))),
        ]
    else:
        for side in (0.5 * b, -0.5 * b):  # winglets
            fin = _quad(
                (tip[0], side, 0), (tip[1], side, -0.5 * c), (tip[1] - 0.1 * c, side, -0.5 * c), (tip[1], side, 0)
            )
            parts.append((dark, fin))
    vertices = times * np.vstack([part for _, part in parts])
    colours = [shade for shade, part in parts for _ in part]
    return rr.Mesh3D(
        vertex_positions=vertices,
        triangle_indices=np.arange(len(vertices)).reshape(-1, 3),
        vertex_colors=colours,
        face_rendering=rr.components.MeshFaceRendering.DoubleSided,
    )


def _triangle(a: Corner, b: Corner, c: Corner) -> Array:
    return np.array((a, b, c))


def _quad(a: Corner, b: Corner, c: Corner, d: Corner) -> Array:
    return np.array((a, b, c, a, c, d))
