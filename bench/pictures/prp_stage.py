#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# Draws docs/pictures/prp_stage.svg: the 3-PRP stage from above, moves far larger than its 5 mm so that they show.
#   prp_stage.py > PICTURE.svg
import math

D1, D2, D3 = 268.0, 39.5, 431.5      # mm, as in motion/align/prp.hpp
Q1, Q2, Q3 = 48.0, -22.0, 38.0       # drawn ten times too large
SCALE, LEFT, BOTTOM = 1.25, 120.0, 490.0
DARK, BLUE, RED, GREY = "#222222", "#1f5fa8", "#b03a2e", "#888888"
out = []


def at(x, y):
    return LEFT + SCALE * x, BOTTOM - SCALE * y


def line(a, b, color=DARK, width=1.5, dash="", arrow=False):
    (x1, y1), (x2, y2) = at(*a), at(*b)
    out.append(f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{color}" stroke-width="{width}"'
               + (f' stroke-dasharray="{dash}"' if dash else "") + (' marker-end="url(#tip)"' if arrow else "") + "/>")


def text(x, y, words, color=DARK, anchor="middle", size=14):
    px, py = at(x, y)
    out.append(f'<text x="{px:.1f}" y="{py:.1f}" fill="{color}" text-anchor="{anchor}" font-size="{size}">{words}</text>')


def joint(x, y):
    px, py = at(x, y)
    out.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="6" fill="#ffffff" stroke="{BLUE}" stroke-width="2.5"/>')


def sub(name, index):
    return name + "₀₁₂₃"[index]


turn = math.atan2(Q3 - Q2, D3 - D2)
along, across = (math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))
# Where the guides cross: from branch 2's joint along its guide to the foot of branch 1's joint.
foot = (Q1 - D2) * along[0] + (D1 - Q2) * along[1]
corner = (D2 + foot * along[0], Q2 + foot * along[1])


def platform(u, v):
    return corner[0] + u * along[0] + v * across[0], corner[1] + u * along[1] + v * across[1]


# The platform and its two guides.
points = " ".join(f"{x:.1f},{y:.1f}" for x, y in (at(*platform(u, v)) for u, v in ((-70, -14), (405, -14), (405, 330), (-70, 330))))
out.append(f'<polygon points="{points}" fill="#eef3f9" stroke="{GREY}" stroke-width="1"/>')
line(platform(-62, 0), platform(398, 0), BLUE, 3)
line(platform(0, 0), platform(0, 322), BLUE, 3)
text(*platform(230, 165), "platform", GREY)
text(*platform(190, 18), "guide of branches 2 and 3", BLUE)
x, y = at(*platform(10, 215))
out.append(f'<text x="{x:.1f}" y="{y:.1f}" fill="{BLUE}" font-size="14">guide of branch 1</text>')
# The angle between the guides.
(ax, ay), (bx, by) = at(*platform(34, 0)), at(*platform(0, 34))
out.append(f'<path d="M {ax:.1f} {ay:.1f} A {34 * SCALE} {34 * SCALE} 0 0 0 {bx:.1f} {by:.1f}" fill="none" stroke="{RED}" stroke-width="1.5"/>')
text(*platform(38, 32), sub("α", 1), RED)
# The frame.
line((-75, 0), (490, 0), GREY, 1, "6 4")
line((0, -90), (0, 365), GREY, 1, "6 4")
text(497, -4, "X", GREY)
text(0, 371, "Y", GREY)
text(-9, -14, "O", GREY)
# Ways of the sliders, and the sliders on them.
for x, index, q in ((D2, 2, Q2), (D3, 3, Q3)):
    line((x, -55), (x, 60), DARK, 6)
    line((x - 13, 0), (x - 13, q), RED, 1.5, arrow=True)
    text(x - 30, 0.5 * q - 4, sub("q", index), RED)
    joint(x, q)
    text(x + 12, -52, f"branch {index}, {sub('β', index)}", DARK, "start")
line((-60, D1), (72, D1), DARK, 6)
line((0, D1 + 16), (Q1, D1 + 16), RED, 1.5, arrow=True)
text(0.5 * Q1, D1 + 23, sub("q", 1), RED)
joint(Q1, D1)
text(78, D1 - 4, f"branch 1, {sub('β', 1)}", DARK, "start")
# Places of the branches.
line((-38, 0), (-38, D1), RED, 1, arrow=True)
text(-50, 0.5 * D1, sub("d", 1), RED)
line((0, -68), (D2, -68), RED, 1, arrow=True)
text(18, -64, sub("d", 2), RED)
line((0, -86), (D3, -86), RED, 1, arrow=True)
text(220, -80, sub("d", 3), RED)
# The platform's turn.
line((D2, Q2), (D2 + 330, Q2), GREY, 1, "3 4")
text(300, -8, "θ", RED)

print('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 760 620" width="760" height="620" font-family="sans-serif">')
print(f'<defs><marker id="tip" markerWidth="9" markerHeight="8" refX="8" refY="4" orient="auto"><path d="M0,0 L9,4 L0,8 z" fill="{RED}"/></marker></defs>')
print('<rect width="760" height="620" fill="#ffffff"/>')
print("\n".join(out))
print("</svg>")
