# SPDX-License-Identifier: Apache-2.0
"""Bumps, tours, and motions of one and of three axes."""
import os
import unittest

import numpy as np

import meltstage
from meltstage import Limits, State

ROOT = os.environ["MELTSTAGE_ROOT"]


def integral(times: np.ndarray, values: np.ndarray) -> float:
    return float(np.sum((values[1:] + values[:-1]) / 2 * np.diff(times)))


class Bumps(unittest.TestCase):
    def test_points_and_notes(self):
        bumps = meltstage.read_bumps(f"{ROOT}/examples/bumps_8x8.xls", pitch_mm=0.5)
        self.assertEqual((bumps.points_mm.shape, bumps.rows.shape), ((24, 2), (24,)))
        wide = meltstage.read_bumps(f"{ROOT}/examples/bumps_8x8.xls", pitch_mm=1, origin_mm=(10, 20))
        np.testing.assert_allclose(wide.points_mm, bumps.points_mm * 2 + [10, 20])

    def test_refusals_name_the_place(self):
        with self.assertRaisesRegex(meltstage.UserError, "nowhere.csv"):
            meltstage.read_bumps("nowhere.csv")
        with self.assertRaisesRegex(meltstage.UserError, "bumps.csv"):
            meltstage.read_bumps(f"{ROOT}/examples/bumps.csv", travel_mm=((0, 1), (0, 1)))


class Tours(unittest.TestCase):
    POINTS = np.random.default_rng(7).uniform(0, 50, (60, 2))

    def length(self, order):
        return np.abs(np.diff(self.POINTS[order], axis=0)).sum()

    def test_the_cost_is_that_of_the_order(self):
        tour = meltstage.plan_tour(self.POINTS)
        self.assertEqual(sorted(tour.order), list(range(60)))
        self.assertAlmostEqual(tour.cost, self.length(tour.order))
        self.assertAlmostEqual(tour.cost_before, self.length(np.arange(60)))
        self.assertLessEqual(tour.bound, tour.cost + 1e-9)
        self.assertLess(tour.cost, tour.cost_before / 2)
        self.assertEqual(tour.unit, "mm")

    def test_metrics_ends_and_arrays_of_any_kind(self):
        slow = meltstage.plan_tour(self.POINTS, metric="time", pause_s=0.1)
        self.assertEqual(slow.unit, "s")
        self.assertGreater(slow.cost, 6.0)
        straight = meltstage.plan_tour(self.POINTS, metric="euclidean", closed=True, start_mm=(0, 0))
        self.assertLess(straight.cost, meltstage.plan_tour(self.POINTS, closed=True, start_mm=(0, 0)).cost)
        for points in (self.POINTS.tolist(), np.asfortranarray(self.POINTS), self.POINTS.repeat(2, 0)[::2]):
            np.testing.assert_array_equal(meltstage.plan_tour(points).order, meltstage.plan_tour(self.POINTS).order)
        self.assertEqual(meltstage.plan_tour(np.array([[1, 2]])).order.tolist(), [0])


class OneAxis(unittest.TestCase):
    def test_samples_keep_limits_and_fit_each_other(self):
        limits = Limits(velocity_mm_s=100, acceleration_mm_s2=800, deceleration_mm_s2=500)
        profile = meltstage.plan_scurve(40, limits)
        times = np.linspace(0, profile.duration_s, 20_001)
        motion = profile.at(times)
        self.assertAlmostEqual(motion.position_mm[-1], 40)
        self.assertLessEqual(motion.velocity_mm_s.max(), 100 + 1e-9)
        self.assertLessEqual(motion.acceleration_mm_s2.max(), 800 + 1e-9)
        self.assertGreaterEqual(motion.acceleration_mm_s2.min(), -500 - 1e-9)
        self.assertAlmostEqual(integral(times, motion.velocity_mm_s), 40, places=5)
        self.assertAlmostEqual(float(profile.time_at(40)), profile.duration_s)
        np.testing.assert_allclose(profile.at(profile.time_at([10, 20])).position_mm, [10, 20])
        np.testing.assert_allclose(profile.segments.duration_s.sum(), profile.duration_s)

    def test_shapes_of_times(self):
        profile = meltstage.plan_scurve(1)
        self.assertEqual(profile.at(0.01).position_mm.shape, ())
        self.assertEqual(profile.at([[0, 1, 2], [3, 4, 5]]).jerk_mm_s3.shape, (2, 3))
        self.assertEqual(profile.at(np.zeros(0)).position_mm.shape, (0,))
        times = np.linspace(0, 1, 1000)[::7]
        np.testing.assert_array_equal(profile.at(times).position_mm, profile.at(times.copy()).position_mm)

    def test_positions_are_absolute(self):
        state = State(5, 30, 100)
        for profile in (
            meltstage.plan_to_state(state, State(50, 10, 20)),
            meltstage.plan_to_speed(state, 50, 10),
            meltstage.plan_arrival(state, 50, 2.0, 10),
        ):
            begin, end = profile.at(0), profile.at(profile.duration_s)
            self.assertAlmostEqual(float(begin.position_mm), 5)
            self.assertAlmostEqual(float(begin.velocity_mm_s), 30)
            self.assertAlmostEqual(float(end.position_mm), 50)
            self.assertAlmostEqual(float(end.velocity_mm_s), 10)
        self.assertAlmostEqual(meltstage.plan_arrival(state, 50, 2.0, 10).duration_s, 2.0)
        stop = meltstage.plan_stop(state)
        self.assertAlmostEqual(float(stop.at(stop.duration_s).velocity_mm_s), 0)
        self.assertGreater(float(stop.at(stop.duration_s).position_mm), 5)

    def test_what_cannot_be(self):
        with self.assertRaisesRegex(meltstage.UserError, "limits.jerk1_mm_s3: found -1.0, expected a number above 0"):
            meltstage.plan_scurve(1, Limits(jerk1_mm_s3=-1))
        with self.assertRaises(meltstage.UserError):
            meltstage.plan_scurve(1e-3, end_velocity_mm_s=300)
        with self.assertRaises(meltstage.UserError):
            meltstage.plan_arrival(State(), 100, 0.01)


class ThreeAxes(unittest.TestCase):
    def test_a_line(self):
        move = meltstage.plan_line((0, 0, 0), (30, 40, 0), [Limits(), Limits(), Limits(velocity_mm_s=10)])
        motion = move.at(np.linspace(0, move.duration_s, 50))
        self.assertEqual(motion.position_mm.shape, (50, 3))
        np.testing.assert_allclose(motion.position_mm[:, 0] * 4, motion.position_mm[:, 1] * 3, atol=1e-9)
        np.testing.assert_allclose(motion.position_mm[-1], [30, 40, 0])

    def test_through_points(self):
        points = np.array([[0, 0, 0], [20, 0, 0], [40, 4, 0], [60, 4, 0.0]])
        stops, rounded = meltstage.plan_through(points), meltstage.plan_through(points, 0.05)
        self.assertLess(rounded.duration_s, stops.duration_s)
        near = np.linalg.norm(rounded.at(rounded.passed_s).position_mm - points, axis=1)
        self.assertLessEqual(near.max(), 0.05 + 1e-9)

    def test_together(self):
        joint = meltstage.plan_together((1, 2, 3), (10, 0, -5), (0, 0, 0), (20, 2, 10), (5, 0, 0))
        end = joint.at(joint.duration_s)
        np.testing.assert_allclose(end.position_mm, [20, 2, 10], atol=1e-9)
        np.testing.assert_allclose(end.velocity_mm_s, [5, 0, 0], atol=1e-9)
        np.testing.assert_allclose(joint.at(0).position_mm, [1, 2, 3])


if __name__ == "__main__":
    unittest.main()
