# SPDX-License-Identifier: Apache-2.0
"""Recordings of pins over clock cycles (.mvec, docs/make/formats/mvec.md), and their replay on the model."""

from __future__ import annotations

import os
from typing import Any, Iterator, Mapping, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core
from . import _check as check
from .spec import near


class Changes(NamedTuple):
    """Changes of a signal: from each cycle on it has that value."""

    cycles: npt.NDArray[np.uint64]  # (n,), rising; the first one is the recording's first cycle
    values: npt.NDArray[np.uint64]  # (n,)


class Signal(NamedTuple):
    """What a recording says of a signal."""

    name: str
    direction: str  # in, out or inout, seen from the owner
    width: int  # bits, 1 to 64
    owner: str  # chip, stage, ...


class Mismatch(NamedTuple):
    """The first output of the model that is another than the recorded one."""

    cycle: int
    signal: str
    recorded: int
    chip: int


class Replay(NamedTuple):
    """What a replay found."""

    cycles: int  # that agree, from the first one on
    mismatch: Mismatch | None


class Recording(Mapping[str, Changes]):
    """A recording in memory: a mapping of its signals' names to their changes. `read_recording()` makes it."""

    def __init__(self, path: Any) -> None:
        self._recording = _core.Recording(check.path("path", path))
        self._name = os.fsdecode(path)
        self._signals = {signal[0]: Signal(*signal) for signal in self._recording.signals()}
        changes = [Changes(*arrays) for arrays in self._recording.changes()]
        for cycles, values in changes:
            cycles.flags.writeable = values.flags.writeable = False
        self._changes = dict(zip(self._signals, changes))

    def __getitem__(self, name: str) -> Changes:
        found = self._changes.get(name) if isinstance(name, str) else None
        if found is None:
            raise KeyError(f"signal: found {check.shown(name)}, expected a name such as {near(name, self._changes)}")
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._changes)

    def __len__(self) -> int:
        return len(self._changes)

    @property
    def signals(self) -> dict[str, Signal]:
        """Direction, width and owner of each signal."""
        return dict(self._signals)

    @property
    def clock_hz(self) -> float:
        """The clock, in Hz."""
        return self._recording.clock_hz

    @property
    def origin(self) -> str:
        """Who recorded."""
        return self._recording.origin

    @property
    def meta(self) -> dict[str, str]:
        """What the recording says of itself beside that."""
        return self._recording.meta

    @property
    def first_cycle(self) -> int:
        """The first cycle recorded."""
        return self._recording.first_cycle

    @property
    def final_cycle(self) -> int:
        """The last cycle recorded."""
        return self._recording.final_cycle

    def at(self, name: str, cycles: npt.ArrayLike) -> npt.NDArray[np.uint64]:
        """Values of a signal in cycles: an array of their shape. Raises UserError for a cycle that isn't recorded."""
        signal = self[name]
        wanted = check.cycles("cycles", cycles)
        outside = (wanted < self.first_cycle) | (wanted > self.final_cycle)
        if outside.any():
            found = int(wanted[outside].flat[0])
            raise check.wrong_value("cycles", found, f"cycles of {self.first_cycle} to {self.final_cycle}")
        places = np.searchsorted(signal.cycles, wanted.astype(np.uint64), side="right")
        return np.asarray(signal.values[places - 1])

    def replay(self) -> Replay:
        """Puts the recorded inputs into the model of the chip, from reset on, and compares its outputs with the recorded ones.

        Raises UserError for a recording that isn't one of the chip from reset on. Other threads run meanwhile, and
        Ctrl-C ends it.
        """
        cycles, mismatch = self._recording.replay(check.shown(self._name))
        return Replay(cycles, None if mismatch is None else Mismatch(*mismatch))

    def __repr__(self) -> str:
        return f"<Recording: {len(self)} signals, cycles {self.first_cycle} to {self.final_cycle}>"


def read_recording(path: Any) -> Recording:
    """Reads a recording (.mvec) whole. Raises UserError, with `line` and `column`, for a file with a defect."""
    return Recording(path)
