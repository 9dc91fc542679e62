# SPDX-License-Identifier: Apache-2.0
"""A timing diagram: rows of pins as a run had them, of bytes, and of lengths."""
from drawing import BLUE, FAINT, INK, PALE, VERMILION, Drawing, ticks
from waves import Waves

WIDTH = 640
LEFT, RIGHT = 84, 632
ROW, WAVE = 25, 15
CHARACTER = 5.4  # width of one in the size of a length
FEW = 9          # heights of the labels of lengths


class TimingDiagram:
    """Rows from the top down; clocks from `begin` to `end`, times counted from `zero` in `unit` clocks."""

    def __init__(self, waves: Waves, begin: float, end: float, zero: float, unit: tuple[str, float], label: str) -> None:
        self.waves, self.begin, self.end, self.zero = waves, begin, end, zero
        self.unit, self.clocks_a_unit = unit
        self.label = label
        self.rows: list[tuple] = []
        self.guides: list[float] = []

    def pin(self, name: str) -> "TimingDiagram":
        self.rows.append((self._draw_pin, name, ROW))
        return self

    def cells(self, name: str, cells: list[tuple[float, float, str]]) -> "TimingDiagram":
        """What a line carries, from clock to clock."""
        self.rows.append((self._draw_cells, (name, cells), ROW))
        return self

    def lengths(self, *lengths: tuple[float, float, str]) -> "TimingDiagram":
        """From clock to clock, with what it is; dashed lines lead up and down to the edges."""
        self.rows.append((self._draw_lengths, lengths, ROW - 6))
        self.guides += [clock for begin, end, _ in lengths for clock in (begin, end)]
        return self

    def svg(self) -> str:
        height = sum(row[2] for row in self.rows)
        drawing = Drawing(WIDTH, height + 30, self.label)
        for guide in sorted(set(self.guides)):
            drawing.line(self.x(guide), 2, self.x(guide), height, FAINT, 0.8, "2 2")
        top = 0
        for draw, what, row_height in self.rows:
            draw(drawing, top, what)
            top += row_height
        self._draw_axis(drawing, height + 4)
        return drawing.svg()

    def x(self, clock: float) -> float:
        return LEFT + (clock - self.begin) / (self.end - self.begin) * (RIGHT - LEFT)

    def _draw_pin(self, drawing: Drawing, top: float, name: str) -> None:
        high, low = top + ROW - 4 - WAVE, top + ROW - 4
        y = {1: high, 0: low}
        level = self.waves.level(name, int(self.begin))
        points = [(float(LEFT), y[level])]
        for clock, new in self.waves.edges(name, int(self.begin) + 1, int(self.end)):
            points += [(self.x(clock), y[level]), (self.x(clock), y[new])]
            level = new
        points.append((float(RIGHT), y[level]))
        drawing.text(LEFT - 6, low - 3, name, "end", 9)
        drawing.polyline(points, BLUE)

    def _draw_cells(self, drawing: Drawing, top: float, named: tuple) -> None:
        name, cells = named
        low = top + ROW - 4
        drawing.text(LEFT - 6, low - 3, name, "end", 9)
        for begin, end, text in cells:
            drawing.rect(self.x(begin), low - WAVE, self.x(end) - self.x(begin), WAVE, PALE, INK)
            drawing.text((self.x(begin) + self.x(end)) / 2, low - 4, text, size=8.5)

    def _draw_lengths(self, drawing: Drawing, top: float, lengths: tuple) -> None:
        y = top + 9
        for begin, end, text in lengths:
            left, right = self.x(begin), self.x(end)
            room = len(text) * CHARACTER
            if right - left > room + 20:
                drawing.arrow([(left, y), (right, y)], VERMILION, 0.9, both=True)
                drawing.rect((left + right) / 2 - room / 2, y - 6, room, 12, "white", "none")
                drawing.text((left + right) / 2, y + 3, text, size=9)
                continue
            # too short for its text: arrows come from outside, and the text stands where there is room
            drawing.arrow([(left - 14, y), (left, y)], VERMILION, 0.9)
            drawing.arrow([(right + 14, y), (right, y)], VERMILION, 0.9)
            drawing.line(left, y, right, y, VERMILION, 0.9)
            if right + 18 + room < RIGHT + 6:
                drawing.text(right + 18, y + 3, text, "start", 9)
            else:
                drawing.text(left - 18, y + 3, text, "end", 9)

    def _draw_axis(self, drawing: Drawing, y: float) -> None:
        drawing.line(LEFT, y, RIGHT, y, INK, 0.8)
        low, high = ((clock - self.zero) / self.clocks_a_unit for clock in (self.begin, self.end))
        for tick in ticks(low, high, FEW):
            x = self.x(self.zero + tick * self.clocks_a_unit)
            drawing.line(x, y, x, y + 4, INK, 0.8)
            drawing.text(x, y + 14, f"{tick:.6g}", size=9)
        drawing.text(2, y + 14, f"time, {self.unit}", "start", 9)
