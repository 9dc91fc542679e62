# SPDX-License-Identifier: Apache-2.0
"""A chart of curves over time, with one axis on the left."""
import dataclasses

from drawing import FAINT, INK, Drawing, ticks

WIDTH = 640
LEFT, RIGHT = 52, 630


@dataclasses.dataclass
class Curve:
    name: str
    points: list[tuple[float, float]]
    colour: str
    dash: str | None = None


def chart(label: str, x_axis: str, y_axis: str, curves: list[Curve], x_range: tuple[float, float], y_range: tuple[float, float],
          height: float = 190, marks: tuple[tuple[float, str], ...] = ()) -> str:
    """Curves with a legend above them; `marks` are moments, each with a word."""
    drawing = Drawing(WIDTH, height, label)
    top, bottom = 22, height - 34

    def x(value: float) -> float:
        return LEFT + (value - x_range[0]) / (x_range[1] - x_range[0]) * (RIGHT - LEFT)

    def y(value: float) -> float:
        return bottom - (value - y_range[0]) / (y_range[1] - y_range[0]) * (bottom - top)

    for tick in ticks(*x_range, 11):
        drawing.line(x(tick), top, x(tick), bottom, FAINT, 0.6)
        drawing.text(x(tick), bottom + 13, f"{tick:.6g}", size=9)
    for tick in ticks(*y_range, 7):
        drawing.line(LEFT, y(tick), RIGHT, y(tick), FAINT, 0.6)
        drawing.text(LEFT - 5, y(tick) + 3, f"{tick:.6g}", "end", 9)
    drawing.rect(LEFT, top, RIGHT - LEFT, bottom - top, "none", INK)
    drawing.text((LEFT + RIGHT) / 2, height - 6, x_axis, size=9.5)
    drawing.text(12, (top + bottom) / 2, y_axis, size=9.5, turned=True)
    for curve in curves:
        drawing.polyline([(x(t), min(max(y(value), top), bottom)) for t, value in thinned(curve.points, x_range)], curve.colour, 1.5, curve.dash)
    for at, word in marks:
        drawing.line(x(at), top, x(at), bottom, INK, 0.9, "4 3")
        drawing.text(x(at) + 4, top + 11, word, "start", 9)
    left = float(LEFT)
    for curve in curves:
        drawing.line(left, 10, left + 22, 10, curve.colour, 2.0, curve.dash)
        drawing.text(left + 27, 13.5, curve.name, "start", 9.5)
        left += 44 + 6.1 * len(curve.name)
    return drawing.svg()


def thinned(points: list[tuple[float, float]], x_range: tuple[float, float], most: int = 700) -> list[tuple[float, float]]:
    """As many as a page shows: of each stretch of time its first, lowest and highest point, in their order."""
    inside = [point for point in points if x_range[0] <= point[0] <= x_range[1]]
    size = max(1, -(-3 * len(inside) // most))
    found = []
    for i in range(0, len(inside), size):
        stretch = inside[i:i + size]
        kept = {stretch[0], min(stretch, key=lambda p: p[1]), max(stretch, key=lambda p: p[1])}
        found += sorted(kept)
    return found
