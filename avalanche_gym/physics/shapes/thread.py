"""Bolt and nut: solids whose threads are swept along a helix.

A thread is a strip of one pitch, from root to root, wound around the axis; its lines of vertices follow the helix, so
crests and roots are sharp edges. Neighbouring turns share a line. The strip ends where it begins: along one turn of
helix and one profile, a loop that a flat ramp closes.

The helix of lead p at the radius r rises by the angle atan(p / (2 pi r)). On flanks that lean by ``flank`` [rad] from
the plane across the axis a nut that bears there holds itself if the friction exceeds

    mu* = tan(lead angle) cos(flank'),    tan(flank') = tan(flank) cos(lead angle)

(Shigley, "Mechanical Engineering Design", section on power screws: mu >= tan(lambda) cos(alpha_n)).

**Facets.** A flank of n facets a turn lies below the round one, by up to tan(flank) r a^2 / 8 in the middle of a facet
with a = 2 pi / n. That grows with r: where facets meet facets they bear on the crest of the bolt. A line of vertices of
the one that turns by b over a facet of the other has to be lifted by tan(flank) r b (a - b) / 2. If both have n facets
a turn, all lines are lifted at once: at rest the nut lies in a notch, whose sides are steeper than the round thread by
tan(flank) r a / 2, a part 2 pi^2 r tan(flank) / (n p) of the slope p / (2 pi) that drives it (more than a half for 48
facets on a thread of r = 2.5 p), and holds at a fraction of mu*. So bolt and nut have 45 and 48 facets. Of the 16
places that lines have on their facets one is always close to the middle, thrice around the axis, and the notches have
a sixteenth of that slope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import checks
from .ring_solids import quads_between
from .triangle_mesh import TriangleMesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Of bolt and nut by default: alike three times around, and else different.
BOLT_SEGMENTS, NUT_SEGMENTS = 45, 48

# A pitch is half a root, a flank, the crest, a flank and half a root.
CREST = 0.2  # length of the crest, in pitches; that of the root is the same
MOST_WIDENING = 0.45 * CREST  # [pitches] of a groove by the clearance: more would leave nothing between two grooves


@dataclass(frozen=True)
class Thread:
    """A right-handed thread of one start.

    Args:
        radius: [m] of the crest of the bolt.
        pitch: [m] between turns, which is the lead too.
        depth: [m] from crest to root.
    """

    radius: float
    pitch: float
    depth: float

    def __post_init__(self) -> None:
        for name in ("radius", "pitch", "depth"):
            checks.positive_number(f"Thread({name})", getattr(self, name))
        if self.depth >= self.radius:
            raise ValueError(f"Thread(depth)={self.depth!r} must be less than radius={self.radius!r}.")

    @property
    def flank(self) -> float:
        """[rad] by which a flank leans from the plane across the axis."""
        return math.atan2((0.5 - CREST) * self.pitch, self.depth)

    @property
    def self_locking_friction(self) -> float:
        """Friction above which a nut stays where it is, bearing on the crest of the bolt."""
        tangent = self.pitch / (2.0 * math.pi * self.radius)
        cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
        return tangent * math.cos(math.atan(math.tan(self.flank) * cosine))

    def profile(self, clearance: float = 0.0) -> tuple[Floats, Floats]:
        """Shares of a pitch (4,) and radii (4,) [m] of the bolt's outline, moved outwards by ``clearance`` [m]."""
        slope = 0.5 - CREST
        widen = clearance * (1.0 / math.cos(self.flank) - math.tan(self.flank)) / self.pitch
        widen = min(widen, MOST_WIDENING)
        shares = np.array([0.5 * CREST, 0.5 * CREST + slope, 0.5 * CREST + slope + CREST, 1.0 - 0.5 * CREST])
        shares = shares + np.array([-widen, -widen, widen, widen])
        root, crest = self.radius - self.depth + clearance, self.radius + clearance
        return shares, np.array([root, crest, crest, root])


def _strip(thread: Thread, turns: int, segments: int, clearance: float) -> tuple[Floats, Ints]:
    """Vertices, and their numbers (turns * segments + 1, 5) by angle and place on the profile; outside is outwards.

    The fifth place is the first one of the next turn; the last turn has its own.
    """
    shares, radii = thread.profile(clearance)
    steps = turns * segments
    angle = 2.0 * math.pi * np.arange(steps + segments + 1) / segments
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = []
    for share, radius in zip(shares, radii, strict=True):
        z = thread.pitch * (angle / (2.0 * math.pi) + share)
        vertices.append(np.concatenate([radius * circle, z[:, None]], axis=1))
    # The first line runs on for one more turn: it is the upper rim of the last one.
    lines = np.arange(4 * len(angle)).reshape(4, -1)
    numbers = np.stack([*(line[: steps + 1] for line in lines), lines[0, segments : segments + steps + 1]], axis=1)
    return np.concatenate(vertices), numbers


def _lateral(numbers: Ints) -> Ints:
    """Triangles of a strip, counter-clockwise from outside."""
    return np.concatenate([quads_between(numbers[:, k], numbers[:, k + 1]) for k in range(4)])


def bolt(thread: Thread, turns: int = 8, *, segments: int = BOLT_SEGMENTS) -> TriangleMesh:
    """A threaded rod about the z axis, from z = 0 upwards, a solid.

    Args:
        thread: its shape.
        turns: of the thread.
        segments: a turn; others than those of the nut, or it sticks (see above).
    """
    _check(turns, segments)
    vertices, numbers = _strip(thread, turns, segments, 0.0)
    bottom, top = _loops(numbers, turns, segments)
    height = thread.pitch * (turns + 1)
    base = thread.pitch * 0.5
    vertices = np.concatenate([vertices, [(0.0, 0.0, base), (0.0, 0.0, height - base + thread.pitch * CREST)]])
    low, high = len(vertices) - 2, len(vertices) - 1
    faces = [
        _lateral(numbers),
        np.stack([np.full(len(bottom), low), np.roll(bottom, -1), bottom], axis=1),
        np.stack([np.full(len(top), high), top, np.roll(top, -1)], axis=1),
    ]
    return _mesh(vertices, np.concatenate(faces))


def nut(
    thread: Thread, turns: int = 3, *, clearance: float, width: float | None = None, segments: int = NUT_SEGMENTS
) -> TriangleMesh:
    """A hexagonal nut about the z axis, its thread in step with that of ``bolt`` where both have the same place.

    Args:
        thread: of the bolt.
        turns: of the thread.
        clearance: [m] between the two threads all round.
        width: [m] across the corners; 3.4 times the radius of the bolt by default.
        segments: a turn, a multiple of six.
    """
    _check(turns, segments)
    clearance = checks.positive_number("nut(clearance)", clearance)
    width = checks.positive_number("nut(width)", 3.4 * thread.radius if width is None else width)
    if segments % 6:
        raise ValueError(f"nut(segments)={segments!r}; give a multiple of six, so that the corners are sharp.")
    if 0.5 * width * math.cos(math.pi / 6.0) <= thread.radius + clearance:
        raise ValueError(f"nut(width)={width!r} leaves no wall around a bolt of radius {thread.radius!r}; give more.")
    vertices, numbers = _strip(thread, turns, segments, clearance)
    bottom, top = _loops(numbers, turns, segments)
    angle = 2.0 * math.pi * np.arange(segments) / segments
    sector = np.mod(angle + 1e-9, math.pi / 3.0) - math.pi / 6.0
    reach = 0.5 * width * math.cos(math.pi / 6.0) / np.cos(sector)
    outline = np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=1)
    heights = (0.5 * thread.pitch, thread.pitch * (turns + 0.5 + CREST))
    rings = [np.concatenate([outline, np.full((segments, 1), z)], axis=1) for z in heights]
    first = len(vertices)
    vertices = np.concatenate([vertices, *rings])
    low = np.append(first + np.arange(segments), first)
    high = low + segments
    faces = [_lateral(numbers)[:, ::-1], quads_between(low, high)]
    for loop, ring, turned in ((bottom, low, False), (top, high, True)):
        # One turn of helix beside the outline, then the profile from the end of the turn back to its start.
        helix, step = loop[: segments + 1], np.append(loop[segments:], loop[0])
        cap = np.concatenate(
            [quads_between(helix, ring), np.stack([np.full(len(step) - 1, ring[0]), step[:-1], step[1:]], axis=1)]
        )
        faces.append(cap[:, ::-1] if turned else cap)
    return _mesh(vertices, np.concatenate(faces))


def _loops(numbers: Ints, turns: int, segments: int) -> tuple[Ints, Ints]:
    """The loops at both ends of a strip: a turn of helix counter-clockwise from above, then back along the profile."""
    steps = turns * segments
    bottom = np.concatenate([numbers[: segments + 1, 0], numbers[0, 3:0:-1]])
    top = np.concatenate([numbers[steps - segments : steps + 1, 4], numbers[steps, 3:0:-1]])
    return bottom, top


def _mesh(vertices: Floats, faces: Ints) -> TriangleMesh:
    """Without vertices that no face uses."""
    used, inverse = np.unique(faces, return_inverse=True)
    return TriangleMesh(vertices[used], inverse.reshape(-1, 3))


def _check(turns: int, segments: int) -> None:
    for name, value, least in (("turns", turns, 1), ("segments", segments, 6)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
            raise ValueError(f"Thread {name}={value!r}; give a whole number of at least {least}.")
