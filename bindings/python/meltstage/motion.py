# SPDX-License-Identifier: Apache-2.0
"""Bumps, the order in which they are visited, and motions of axes. Lengths in mm, times in s."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import Any, NamedTuple, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _core
from . import _check as check

Array = npt.NDArray[np.float64]

_METRICS = ("manhattan", "chebyshev", "euclidean", "time")
_UNITS = {"time": "s"}


class Bumps(NamedTuple):
    """What a coordinate file holds."""

    points_mm: Array  # (n, 2), in the stage's frame
    rows: npt.NDArray[np.int64]  # (n,), where each came from: row of the sheet or line, from 1
    notes: list[str]  # a line each on what is in the file but is no bump


@dataclass(frozen=True)
class Limits:
    """Limits of an axis or a path; each above 0. The jerks are those of the segments 1, 3, 5 and 7 of an S-curve."""

    velocity_mm_s: float = 400.0
    acceleration_mm_s2: float = 4000.0
    deceleration_mm_s2: float = 4000.0
    jerk1_mm_s3: float = 2e5  # acceleration rises
    jerk3_mm_s3: float = 2e5  # acceleration falls
    jerk5_mm_s3: float = 2e5  # deceleration rises
    jerk7_mm_s3: float = 2e5  # deceleration falls


LimitsOfAxes = Union[Limits, Sequence[Limits]]
"""The same limits for all axes, or limits for each."""


@dataclass(frozen=True)
class State:
    """Where an axis is, how fast, and how that changes."""

    position_mm: float = 0.0
    velocity_mm_s: float = 0.0
    acceleration_mm_s2: float = 0.0


class Tour(NamedTuple):
    """The order in which points are visited."""

    order: npt.NDArray[np.int64]  # indices into the points that were given
    cost_before: float  # of the points in the order in which they were given
    cost: float  # in the planned order
    bound: float  # no order costs less
    gap: float  # how far above the cheapest order the plan can be, as a fraction of the bound
    unit: str  # of the costs: mm, or s


class Motion(NamedTuple):
    """Samples of a motion: arrays of the shape of the times, with a last axis of 3 for a motion of three axes."""

    position_mm: Array
    velocity_mm_s: Array
    acceleration_mm_s2: Array
    jerk_mm_s3: Array


class Segments(NamedTuple):
    """Segments of constant jerk, (n,) each: when they begin, how long they last, and the state at their beginning."""

    start_s: Array
    duration_s: Array
    position_mm: Array
    velocity_mm_s: Array
    acceleration_mm_s2: Array
    jerk_mm_s3: Array


class Profile:
    """A motion of one axis. The functions `plan_...` make it."""

    __slots__ = ("_profile", "_from_mm")

    def __init__(self, profile: _core.Profile, from_mm: float = 0.0) -> None:
        if not isinstance(profile, _core.Profile):
            raise check.wrong_type("profile", profile, "one that a function plan_... made")
        self._profile = profile
        self._from_mm = from_mm

    @property
    def duration_s(self) -> float:
        """How long the motion takes."""
        return self._profile.duration_s

    def at(self, times_s: npt.ArrayLike) -> Motion:
        """Position, velocity, acceleration and jerk at times in s: arrays of the shape of `times_s`.

        Before and after the motion the axis goes on with the speed of its beginning or end: at rest it stands.
        Raises UserError for a time that isn't finite.
        """
        times = check.numbers("times_s", times_s)
        columns = self._profile.sample(times.ravel()).T.reshape(4, *times.shape)
        return Motion(columns[0] + self._from_mm, columns[1].copy(), columns[2].copy(), columns[3].copy())

    def time_at(self, positions_mm: npt.ArrayLike) -> Array:
        """When positions are first reached, for a motion that never turns back: 0 before it, its duration behind it."""
        positions = check.numbers("positions_mm", positions_mm)
        return self._profile.times_at((positions - self._from_mm).ravel()).reshape(positions.shape)

    @property
    def segments(self) -> Segments:
        """The segments of constant jerk that the motion is made of."""
        table = self._profile.segments().T.copy()
        table[2] += self._from_mm
        return Segments(*table)

    def __repr__(self) -> str:
        return f"<Profile: {self.duration_s:.6g} s>"


class AxesMotion:
    """A motion of three axes. The functions `plan_...` make it."""

    __slots__ = ("_motion",)

    def __init__(self, motion: _core.AxesMotion) -> None:
        if not isinstance(motion, _core.AxesMotion):
            raise check.wrong_type("motion", motion, "one that a function plan_... made")
        self._motion = motion

    @property
    def duration_s(self) -> float:
        """How long the motion takes."""
        return self._motion.duration_s

    @property
    def passed_s(self) -> Array:
        """When each point is passed, for `plan_through()`; otherwise empty."""
        return self._motion.passed_s

    def at(self, times_s: npt.ArrayLike) -> Motion:
        """Position, velocity, acceleration and jerk of the axes at times in s: arrays of the shape of `times_s`, and 3.

        Raises UserError for a time that isn't finite.
        """
        times = check.numbers("times_s", times_s)
        columns = self._motion.sample(times.ravel()).reshape(4, *times.shape, 3)
        return Motion(columns[0], columns[1], columns[2], columns[3])

    def __repr__(self) -> str:
        return f"<AxesMotion: {self.duration_s:.6g} s>"


def read_bumps(
    path: Any,
    *,
    pitch_mm: float = 1.0,
    origin_mm: npt.ArrayLike = (0.0, 0.0),
    rotation_deg: float = 0.0,
    mirror_x: bool = False,
    side: str | None = None,
    only: str = "",
    travel_mm: npt.ArrayLike = ((0.0, 200.0), (0.0, 200.0)),
) -> Bumps:
    """Reads bumps from a workbook, table, KiCad file, drawing, Gerber layer or drill file (docs/motion/path.md).

    `pitch_mm` is the unit of a file that says none. The bumps are mirrored, scaled, rotated and then shifted so
    that the file's (0, 0) lies at `origin_mm`. `side` ("top" or "bottom") and `only` (a tool, aperture,
    footprint or layer) choose among a file's bumps. `travel_mm` is where the stage can go, least and most of x
    and of y. Raises UserError, with the place in the file, for one that can't be used or a bump out of travel.
    """
    travel = check.points("travel_mm", travel_mm, 2)
    if travel.shape != (2, 2):
        raise check.refused("travel_mm", f"shape {travel.shape}", "shape (2, 2): least and most of x and of y")
    points, rows, notes = _core.read_bumps(
        check.path("path", path),
        check.number("pitch_mm", pitch_mm),
        check.vector("origin_mm", origin_mm, 2),
        check.number("rotation_deg", rotation_deg),
        check.flag("mirror_x", mirror_x),
        None if side is None else check.one_of("side", side, ("top", "bottom")) == "bottom",
        check.text("only", only),
        travel.tolist(),
    )
    return Bumps(points, rows, notes)


def plan_tour(
    points_mm: npt.ArrayLike,
    *,
    metric: str = "manhattan",
    closed: bool = False,
    start_mm: npt.ArrayLike | None = None,
    end_mm: npt.ArrayLike | None = None,
    limits: LimitsOfAxes = Limits(),
    pause_s: float = 0.0,
    kicks_per_point: float | None = None,
    search_s: float | None = None,
) -> Tour:
    """Plans the order in which the stage visits points, and tells how far from the cheapest it can be.

    `points_mm` has shape (n, 2). A hop costs by `metric`: "manhattan", "chebyshev" or "euclidean" in mm, or
    "time" in s, with the `limits` of x and y and a pause of `pause_s` at each point. The way begins at
    `start_mm` and ends at `end_mm`, where they are given; a `closed` one returns to where it began.
    `kicks_per_point` (>= 0) says how long is searched, `search_s` (> 0) gives it seconds by the clock in place
    of that. Other threads run meanwhile, and Ctrl-C ends it.
    """
    points = check.points("points_mm", points_mm, 2)
    if len(points) > _core.MOST_POINTS:
        raise check.refused("points_mm", f"{len(points)} points", f"{_core.MOST_POINTS} at most")
    order, before, after, bound, gap = _core.plan_tour(
        points,
        _METRICS.index(check.one_of("metric", metric, _METRICS)),
        check.flag("closed", closed),
        None if start_mm is None else check.vector("start_mm", start_mm, 2),
        None if end_mm is None else check.vector("end_mm", end_mm, 2),
        _limits_of_axes(limits, 2),
        check.number("pause_s", pause_s),
        None if kicks_per_point is None else check.number("kicks_per_point", kicks_per_point),
        None if search_s is None else check.number("search_s", search_s),
    )
    return Tour(order, before, after, bound, gap, _UNITS.get(metric, "mm"))


def plan_scurve(
    distance_mm: float, limits: Limits = Limits(), *, start_velocity_mm_s: float = 0.0, end_velocity_mm_s: float = 0.0
) -> Profile:
    """The fastest S-curve of seven segments over a distance (>= 0), from one speed to another, each 0 to the limit.

    Raises UserError for a limit that isn't positive, or a distance too short for the change of speed.
    """
    return Profile(
        _core.plan_scurve(
            _limits(limits),
            check.number("distance_mm", distance_mm),
            check.number("start_velocity_mm_s", start_velocity_mm_s),
            check.number("end_velocity_mm_s", end_velocity_mm_s),
        )
    )


def plan_to_state(state: State, end: State, limits: Limits = Limits()) -> Profile:
    """The fastest motion from any state to any other one, within the smaller of both accelerations and the least jerk.

    Raises UserError for an end that can't be reached within the limits.
    """
    now = _state("state", state)
    goal = _state("end", end)
    return Profile(_core.plan_to_state(_limits(limits), [0.0, *now[1:]], [goal[0] - now[0], *goal[1:]]), now[0])


def plan_to_speed(state: State, target_mm: float, end_velocity_mm_s: float = 0.0, limits: Limits = Limits()) -> Profile:
    """From any state to a target that is passed with a speed and no acceleration; with a speed of 0 the axis rests there.

    Raises UserError for an end speed above the limit.
    """
    now = _state("state", state)
    target = check.number("target_mm", target_mm)
    speed = check.number("end_velocity_mm_s", end_velocity_mm_s)
    return Profile(_core.plan_to_speed(_limits(limits), [0.0, *now[1:]], target - now[0], speed), now[0])


def plan_arrival(
    state: State, target_mm: float, duration_s: float, end_velocity_mm_s: float = 0.0, limits: Limits = Limits()
) -> Profile:
    """As `plan_to_speed()`, in exactly `duration_s`. Raises UserError, with the least one, for a duration that can't be."""
    now = _state("state", state)
    return Profile(
        _core.plan_arrival(
            _limits(limits),
            [0.0, *now[1:]],
            check.number("target_mm", target_mm) - now[0],
            check.number("end_velocity_mm_s", end_velocity_mm_s),
            check.number("duration_s", duration_s),
        ),
        now[0],
    )


def plan_stop(state: State, limits: Limits = Limits()) -> Profile:
    """The fastest stop from any state."""
    now = _state("state", state)
    return Profile(_core.plan_stop(_limits(limits), [0.0, *now[1:]]), now[0])


def plan_line(from_mm: npt.ArrayLike, to_mm: npt.ArrayLike, limits: LimitsOfAxes = Limits()) -> AxesMotion:
    """The fastest straight motion from rest to rest of three axes, with limits for all or for each."""
    return AxesMotion(
        _core.plan_line(_limits_of_axes(limits, 3), check.vector("from_mm", from_mm, 3), check.vector("to_mm", to_mm, 3))
    )


def plan_through(points_mm: npt.ArrayLike, tolerance_mm: float = 0.0, limits: LimitsOfAxes = Limits()) -> AxesMotion:
    """From rest at the first of some points, shape (n, 3), through all others to rest at the last one.

    Lines whose corners are rounded: each point is passed within `tolerance_mm` (0: with a stop). Never slower
    than with a stop at each corner.
    """
    return AxesMotion(
        _core.plan_through(
            check.points("points_mm", points_mm, 3), _limits_of_axes(limits, 3), check.number("tolerance_mm", tolerance_mm)
        )
    )


def plan_together(
    position_mm: npt.ArrayLike,
    velocity_mm_s: npt.ArrayLike,
    acceleration_mm_s2: npt.ArrayLike,
    target_mm: npt.ArrayLike,
    end_velocity_mm_s: npt.ArrayLike = (0.0, 0.0, 0.0),
    limits: LimitsOfAxes = Limits(),
) -> AxesMotion:
    """Three axes from any state to a point that is passed with a velocity, all at the same moment; 3 numbers each.

    Raises UserError for a speed above the limits, and when no time is common to all axes.
    """
    state = [
        check.vector("position_mm", position_mm, 3),
        check.vector("velocity_mm_s", velocity_mm_s, 3),
        check.vector("acceleration_mm_s2", acceleration_mm_s2, 3),
    ]
    end = check.vector("end_velocity_mm_s", end_velocity_mm_s, 3)
    return AxesMotion(_core.plan_together(_limits_of_axes(limits, 3), state, check.vector("target_mm", target_mm, 3), end))


def _limits(limits: Limits) -> list[float]:
    if not isinstance(limits, Limits):
        raise check.wrong_type("limits", limits, "meltstage.Limits")
    numbers = []
    for name, value in zip(Limits.__dataclass_fields__, astuple(limits)):
        number = check.number(f"limits.{name}", value)
        if not number > 0.0:
            raise check.wrong_value(f"limits.{name}", number, "a number above 0")
        numbers.append(number)
    return numbers


def _limits_of_axes(limits: LimitsOfAxes, axes: int) -> list[list[float]]:
    if isinstance(limits, Limits):
        return [_limits(limits)] * axes
    if not isinstance(limits, Sequence) or isinstance(limits, (str, bytes)):
        raise check.wrong_type("limits", limits, f"meltstage.Limits, or {axes} of them")
    if len(limits) != axes:
        raise check.refused("limits", f"{len(limits)} of them", f"one, or {axes}")
    return [_limits(one) for one in limits]


def _state(name: str, state: State) -> list[float]:
    if not isinstance(state, State):
        raise check.wrong_type(name, state, "meltstage.State")
    return [check.number(f"{name}.{field}", value) for field, value in zip(State.__dataclass_fields__, astuple(state))]
