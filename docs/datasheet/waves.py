# SPDX-License-Identifier: Apache-2.0
"""The pins of a run, clock by clock, from the VCD that `meltstage chip play --vcd` writes."""
import bisect
import pathlib
import re

PICOSECONDS = {"s": 10 ** 12, "ms": 10 ** 9, "us": 10 ** 6, "ns": 10 ** 3, "ps": 1}


class Waves:
    """Level of each pin at each clock; a clock's levels are those before its edge."""

    def __init__(self, path: pathlib.Path, clock_hz: int) -> None:
        self.clock_hz = clock_hz
        self.changes: dict[str, tuple[list[int], list[int]]] = {}
        text = path.read_text(encoding="ascii")
        header, _, body = text.partition("$enddefinitions $end")
        scale = re.search(r"\$timescale\s+(\d+)\s*(\w+)", header)
        unit_ps = int(scale[1]) * PICOSECONDS[scale[2]]
        names = dict(re.findall(r"\$var \w+ 1 (\S+) (\S+(?: ?\[\d+\])?) \$end", header))
        by_code = {code: self.changes.setdefault(name.replace(" ", ""), ([], [])) for code, name in names.items()}
        clock = 0
        for word in body.split():
            if word[0] == "#":
                clock = round(int(word[1:]) * unit_ps * clock_hz / 10 ** 12)
            elif word[0] in "01":
                clocks, levels = by_code[word[1:]]
                clocks.append(clock)
                levels.append(int(word[0]))

    def level(self, pin: str, clock: int) -> int:
        clocks, levels = self.changes[pin]
        return levels[bisect.bisect_right(clocks, clock) - 1]

    def edges(self, pin: str, begin: int, end: int) -> list[tuple[int, int]]:
        """Clock and new level of each change from begin on, before end."""
        clocks, levels = self.changes[pin]
        first = max(bisect.bisect_left(clocks, begin), 1)  # the first entry is the level at the start, no change
        return [(clocks[i], levels[i]) for i in range(first, bisect.bisect_left(clocks, end))]

    def next_edge(self, pin: str, after: int, level: int) -> int:
        """Clock of the first change to that level, from `after` on."""
        clocks, levels = self.changes[pin]
        for i in range(max(bisect.bisect_left(clocks, after), 1), len(clocks)):
            if levels[i] == level:
                return clocks[i]
        raise ValueError(f"{pin}: found no change to {level} after clock {after}, expected one: another scenario?")

    def last_edge(self, pin: str, before: int, level: int) -> int:
        """Clock of the last change to that level before `before`."""
        clocks, levels = self.changes[pin]
        for i in range(bisect.bisect_left(clocks, before) - 1, 0, -1):
            if levels[i] == level:
                return clocks[i]
        raise ValueError(f"{pin}: found no change to {level} before clock {before}, expected one: another scenario?")

    def clock_at(self, seconds: float) -> int:
        return round(seconds * self.clock_hz)
