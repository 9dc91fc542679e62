# SPDX-License-Identifier: Apache-2.0
"""The chip on its simulated, heated head, by a scenario."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core
from . import _check as check
from .chip import Chip
from .spec import CLOCK_HZ, PINS

_LONGEST_S = 1e9
_PIN_ROW = np.dtype([("cycle", np.uint64)] + [(name, np.uint8) for name in PINS])

EVENTS: dict[str, tuple[str, str]] = {word: (arguments, summary) for word, arguments, summary in _core.event_usages()}
"""Words of a scenario's events: what stands behind each, and what it does."""


class LogEntry(NamedTuple):
    """What went over the serial line, was done to the bench, or latched."""

    time_s: float
    what: str
    answer: str  # empty where nothing answers
    request: bytes  # on the line
    reply: bytes
    failed: bool  # asked of the chip without `try`, and refused or not answered
    line: int | None  # of the scenario, from 1


def _entries(entries: list[tuple[float, str, str, bytes, bytes, bool, int]]) -> list[LogEntry]:
    return [LogEntry(*entry[:6], entry[6] or None) for entry in entries]


class Run:
    """A chip, its head, sensor, heater and host, from power-up on, by a scenario.

    A scenario is a text: `head`, `sensor`, `noise` and so on, then a line an event with its time in seconds,
    such as `1 set SETPOINT 110`. docs/start/chip-in-a-page.md has the words; `EVENTS` lists them. Without a
    scenario the chip is powered, and its host polls it.

    Raises UserError for a scenario that isn't understood; `line`, `found` and `expected` of the exception say why.
    A run is used by one thread at a time; runs of their own may go on in several threads at once.
    """

    __slots__ = ("_run",)

    def __init__(self, scenario: str = "") -> None:
        self._run = _core.Run(check.text("scenario", scenario))

    def until(self, time_s: float) -> Run:
        """Goes on to that time since power-up, in s; not back. Returns the run. Other threads run meanwhile, and Ctrl-C ends it."""
        self._run.until(self._cycle_of("time_s", time_s))
        return self

    def do(self, event: str, at_s: float | None = None) -> Run:
        """Does one thing now, or at a time in s: "set SETPOINT 120", "sensor open". Returns the run.

        A time that is over means now. Raises UserError for an event that isn't understood.
        """
        cycle = self._run.cycle if at_s is None else self._cycle_of("at_s", at_s)
        self._run.add(check.text("event", event), cycle)
        return self

    @property
    def time_s(self) -> float:
        """Seconds since power-up."""
        return self._run.cycle / CLOCK_HZ

    @property
    def cycle(self) -> int:
        """Clocks since power-up."""
        return self._run.cycle

    @property
    def trace(self) -> npt.NDArray[np.void]:
        """A row each tenth of a second: a structured array, a copy.

        Fields, all doubles: time_s, set_point_degc (the working set-point), reading_degc (of the chip; NaN before
        the first sample), block_degc, heater_degc, duty_percent, state (a key of `STATES`), faults (bits that are
        latched, in the order of `FAULTS`), pin_changes so far, and pins_hash of them all. The last 200,000 rows at
        least are kept.
        """
        return self._run.rows()

    @property
    def log(self) -> list[LogEntry]:
        """The last 4,000 entries of what went over the serial line, was done to the bench, or latched."""
        return _entries(self._run.log())

    @property
    def failures(self) -> list[LogEntry]:
        """What events asked of the chip without `try`, and it refused or has not answered so far: the first 20, and all that wait."""
        return _entries(self._run.failures())

    @property
    def failed(self) -> int:
        """How many there are in all."""
        return self._run.failed()

    @property
    def events_to_come(self) -> int:
        """How many events of the scenario have a time that is not over."""
        return self._run.events_to_come()

    @property
    def fault(self) -> str:
        """The fault that latched first: what was measured, the limit, what to do next. Empty without a fault."""
        return self._run.fault()

    @property
    def chip(self) -> Chip:
        """A copy of the chip as it is now, with the levels at its pins."""
        return Chip._of(self._run.chip())

    def pins(self, begin_s: float, end_s: float) -> npt.NDArray[np.void]:
        """Changes of pins from `begin_s` to before `end_s`: a structured array of `cycle` and a field a pin of `PINS`.

        A row has all levels from its cycle on. The first row has those at the beginning, or those of the oldest
        change that is kept: some two million are, two minutes of a heater that is pulsed.
        """
        begin, end = self._cycle_of("begin_s", begin_s), self._cycle_of("end_s", end_s)
        if end < begin:
            raise check.wrong_value("end_s", end_s, f"a time from begin_s ({begin_s:g}) on")
        cycles, levels = self._run.pins(begin, end)
        rows = np.empty(cycles.size, _PIN_ROW)
        rows["cycle"] = cycles
        for column, name in enumerate(PINS):
            rows[name] = levels[:, column]
        return rows

    def record(self, path: Any) -> None:
        """Writes all pins since power-up as a recording (.mvec), which `read_recording()` reads and any simulator replays.

        Raises UserError for a run of which not all pins are kept any more, or for a path that can't be written.
        What a scenario does to flops and clock by itself, `flip` and `clock off`, is in no pin: such a recording
        doesn't replay.
        """
        self._run.record(check.path("path", path))

    def __repr__(self) -> str:
        return f"<Run: {self.time_s:.6g} s>"

    @staticmethod
    def _cycle_of(name: str, time_s: float) -> int:
        return round(check.number(name, time_s, 0.0, _LONGEST_S) * CLOCK_HZ)


def play(scenario: str = "", for_s: float = 300.0) -> Run:
    """Runs a scenario for some seconds of the chip, and returns the run: `play("1 set SETPOINT 110; 1.2 run").trace`.

    What `meltstage chip play` does. Raises as `Run` does.
    """
    return Run(scenario).until(for_s)
