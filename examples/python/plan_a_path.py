#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Plans the way over the bumps of a file, and the motion along it without a stop: plan_a_path.png."""
# %% Plan
import pathlib
import matplotlib.pyplot as plt
import meltstage
import numpy as np

bumps = meltstage.read_bumps(pathlib.Path(__file__).parent.parent / "bumps.csv")
tour = meltstage.plan_tour(bumps.points_mm, metric="euclidean")
print(f"{tour.cost:.1f} {tour.unit} in place of {tour.cost_before:.1f}; no order takes less than {tour.bound:.1f}")
points = np.column_stack([bumps.points_mm[tour.order], np.zeros(len(tour.order))])
motion = meltstage.plan_through(points, tolerance_mm=0.05)
print(f"{motion.duration_s:.2f} s; with a stop at each bump {meltstage.plan_through(points).duration_s:.2f} s")
# %% Draw the way and the speeds
times = np.linspace(0, motion.duration_s, 5000)
at = motion.at(times)
figure, (way, speed) = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
way.plot(at.position_mm[:, 0], at.position_mm[:, 1], linewidth=1)
way.plot(*bumps.points_mm.T, "k.", markersize=3)
way.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
speed.plot(times, at.velocity_mm_s[:, :2], label=["x", "y"])
speed.set(xlabel="s", ylabel="mm/s")
speed.legend()
figure.savefig("plan_a_path.png", dpi=120)
