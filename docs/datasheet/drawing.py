# SPDX-License-Identifier: Apache-2.0
"""A drawing in SVG, by presentation attributes alone: browsers and the printer of the PDF show it alike."""
import html

INK = "#222222"
FAINT = "#c8c8c8"
PALE = "#eef3f8"
# Okabe and Ito's colours, which differ for all kinds of colour vision.
BLUE, VERMILION, GREEN, PURPLE = "#0072b2", "#d55e00", "#009e73", "#aa4499"


class Drawing:
    """Lengths are pixels of CSS; the page's width is 640."""

    def __init__(self, width: float, height: float, label: str) -> None:
        self.size = f"{width:g} {height:g}"
        self.label = html.escape(label)
        self.parts: list[str] = []

    def add(self, tag: str, text: str = "", **attributes: object) -> None:
        named = "".join(f' {key.rstrip("_").replace("_", "-")}="{number(value)}"' for key, value in attributes.items() if value is not None)
        self.parts.append(f"<{tag}{named}>{text}</{tag}>" if text else f"<{tag}{named}/>")

    def line(self, x1: float, y1: float, x2: float, y2: float, colour: str = INK, width: float = 1.0, dash: str | None = None) -> None:
        self.add("line", x1=x1, y1=y1, x2=x2, y2=y2, stroke=colour, stroke_width=width, stroke_dasharray=dash)

    def polyline(self, points: list[tuple[float, float]], colour: str = INK, width: float = 1.2, dash: str | None = None) -> None:
        self.add("polyline", points=" ".join(f"{x:.2f},{y:.2f}" for x, y in points), fill="none", stroke=colour, stroke_width=width,
                 stroke_dasharray=dash, stroke_linejoin="round")

    def area(self, points: list[tuple[float, float]], fill: str, colour: str = "none") -> None:
        self.add("polygon", points=" ".join(f"{x:.2f},{y:.2f}" for x, y in points), fill=fill, stroke=colour)

    def rect(self, x: float, y: float, width: float, height: float, fill: str = "white", colour: str = INK, radius: float = 0.0) -> None:
        self.add("rect", x=x, y=y, width=width, height=height, fill=fill, stroke=colour, rx=radius)

    def circle(self, x: float, y: float, radius: float, fill: str = INK, colour: str = INK) -> None:
        self.add("circle", cx=x, cy=y, r=radius, fill=fill, stroke=colour)

    def text(self, x: float, y: float, text: str, anchor: str = "middle", size: float = 10.0, colour: str = INK, bold: bool = False,
             turned: bool = False) -> None:
        self.add("text", html.escape(text), x=x, y=y, text_anchor=anchor, font_size=size, fill=colour, font_family="DejaVu Sans, sans-serif",
                 font_weight="bold" if bold else None, transform=f"rotate(-90 {x:g} {y:g})" if turned else None)

    def head(self, x: float, y: float, dx: float, dy: float, colour: str = INK, size: float = 5.0) -> None:
        """Of an arrow that ends at (x, y) and came along (dx, dy), a direction along one axis or of any length."""
        length = (dx * dx + dy * dy) ** 0.5
        ux, uy = dx / length * size, dy / length * size
        self.area([(x, y), (x - ux - uy / 2, y - uy + ux / 2), (x - ux + uy / 2, y - uy - ux / 2)], colour)

    def arrow(self, points: list[tuple[float, float]], colour: str = INK, width: float = 1.0, both: bool = False) -> None:
        """A line by way of these points, with a head at its end, or at both."""
        self.polyline(points, colour, width)
        (x1, y1), (x2, y2) = points[-2:]
        self.head(x2, y2, x2 - x1, y2 - y1, colour)
        if both:
            (x1, y1), (x2, y2) = points[:2]
            self.head(x1, y1, x1 - x2, y1 - y2, colour)

    def svg(self) -> str:
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.size}" width="100%" role="img" aria-label="{self.label}">'
                + "".join(self.parts) + "</svg>")


def number(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers from low to high, at most so many."""
    step = 10.0 ** -9
    factors = (2.0, 2.5, 2.0)
    turn = 0
    while (high - low) / step > most - 1:
        step *= factors[turn % 3]
        turn += 1
    first = int(low / step) * step
    first += step if first < low - 1e-12 else 0.0
    return [first + step * i for i in range(int((high - first) / step + 1e-9) + 1)]
