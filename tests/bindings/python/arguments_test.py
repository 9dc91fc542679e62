# SPDX-License-Identifier: Apache-2.0
"""Wrong arguments: every function of the package takes none of them badly. An exception of one line, or a good answer."""
import os
import tempfile
import unittest

import numpy as np

import meltstage
from meltstage import Chip, Limits, Run, State

NAN, INF = float("nan"), float("inf")
ROOT = os.environ["MELTSTAGE_ROOT"]


class Hostile:
    def __repr__(self):
        raise ZeroDivisionError

    def __float__(self):
        raise TypeError("no\nfloat")


class OfManyLines:
    def __repr__(self):
        return "one\ntwo"


ANYTHING = [
    None, True, 0, -1, 2**70, -(2**70), 1.5, NAN, INF, -INF, 1e300, -1e-300, 1j, "", "x", "\n\0\ud800", "nan", b"\xff", (), [], {},
    [[]], [1], [1, 2], [1, 2, 3], [1, [2]], [[1, 2], [3]], [[1, 2], [NAN, 4]], ["a", "b"], [None], object(), OfManyLines(), Hostile(), Hostile, print,
    np.float32(2), np.int8(-3), np.array(7), np.zeros(0), np.zeros((0, 2)), np.zeros((3, 3), complex), np.full((4, 2), INF),
    np.arange(12).reshape(3, 2, 2), np.array([[1, 2], [3, 4]], dtype=object), np.ones((2, 3), bool), np.array(["1", "2"]),
    np.array([(1, 2.0)], dtype=[("a", int), ("b", float)]), np.array("2026-01-01", dtype="datetime64[D]"), np.ones((5, 2), np.float16)[::-2],
    np.asfortranarray(np.ones((3, 3))), np.broadcast_to(1.0, (4, 3)), Limits(), Limits(velocity_mm_s=NAN), State(position_mm="1"), Chip(), Run(),
]  # fmt: skip

POINTS = [[0.0, 1.0], [2.0, 3.0], [5.0, 1.0]]
PROFILE = meltstage.plan_scurve(3)
LINE = meltstage.plan_line((0, 0, 0), (1, 2, 3))
RECORDED = tempfile.NamedTemporaryFile(suffix=".mvec")
Run().until(0.01).record(RECORDED.name)
RECORDING = meltstage.read_recording(RECORDED.name)


def fresh_chip() -> Chip:
    chip = Chip()
    chip.step(100)
    return chip


# Each call with good arguments; one after the other is replaced by anything.
CALLS = [
    (lambda *a: fresh_chip().step(*a), [3]),
    (lambda *a: fresh_chip().advance(*a), [3]),
    (lambda a: fresh_chip().drive(uart_rx_i=a), [[0, 1]]),
    (lambda a, b: fresh_chip().drive(uart_rx_i=a, addr_strap_i=b), [[0, 1], [7, 3]]),
    (lambda a: fresh_chip().drive(**{a: [1]}), ["drop_i"]),
    (lambda a: setattr(fresh_chip().inputs, "addr_strap_i", a), [7]),
    (lambda a: setattr(fresh_chip().inputs, a, 1), ["drop_i"]),
    (lambda a: getattr(fresh_chip().outputs, a), ["heater_o"]),
    (lambda a: fresh_chip().flops.__getitem__(a), ["guard.run_q"]),
    (lambda a, b: fresh_chip().flops.__setitem__(a, b), ["guard.run_q", 1]),
    (lambda *a: fresh_chip().peek(*a), ["PV"]),
    (lambda *a: fresh_chip().read(*a), ["PV"]),
    (lambda *a: fresh_chip().write(*a), ["SETPOINT", 100]),
    (lambda *a: fresh_chip().command(*a), ["stop"]),
    (lambda *a: fresh_chip().differences(*a), [Chip()]),
    (lambda a: fresh_chip() == a, [Chip()]),
    (Run, ["0.1 run"]),
    (lambda *a: Run().until(*a), [0.01]),
    (lambda *a: Run().do(*a), ["run", 0.1]),
    (lambda *a: Run().pins(*a), [0.0, 0.1]),
    (lambda a: Run().until(0.01).record(a), [RECORDED.name]),
    (meltstage.play, ["0.1 run", 0.01]),
    (lambda a, b, c, d, e, f, g, h: meltstage.read_bumps(a, pitch_mm=b, origin_mm=c, rotation_deg=d, mirror_x=e, side=f, only=g, travel_mm=h),
     [f"{ROOT}/examples/bumps_8x8.xls", 0.5, (1, 1), 0.0, False, None, "", ((0, 200), (0, 200))]),
    (lambda a, b, c, d, e, f, g, h: meltstage.plan_tour(a, metric=b, closed=c, start_mm=d, end_mm=e, limits=f, pause_s=g, kicks_per_point=h),
     [POINTS, "time", False, (0, 0), (1, 1), Limits(), 0.0, 0.1]),
    (lambda a: meltstage.plan_tour(POINTS, search_s=a), [0.01]),
    (lambda a, b, c, d: meltstage.plan_scurve(a, b, start_velocity_mm_s=c, end_velocity_mm_s=d), [3.0, Limits(), 1.0, 1.0]),
    (meltstage.plan_to_state, [State(), State(3), Limits()]),
    (meltstage.plan_to_speed, [State(), 3.0, 1.0, Limits()]),
    (meltstage.plan_arrival, [State(), 3.0, 1.0, 1.0, Limits()]),
    (meltstage.plan_stop, [State(0, 1, 1), Limits()]),
    (meltstage.plan_line, [(0, 0, 0), (1, 2, 3), [Limits()] * 3]),
    (meltstage.plan_through, [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], 0.1, Limits()]),
    (meltstage.plan_together, [(0, 0, 0), (0, 0, 0), (0, 0, 0), (1, 2, 3), (0, 0, 0), Limits()]),
    (PROFILE.at, [[0.1, 0.2]]),
    (PROFILE.time_at, [[0.1, 0.2]]),
    (LINE.at, [[0.1, 0.2]]),
    (meltstage.Profile, [object()]),
    (meltstage.AxesMotion, [object()]),
    (meltstage.read_recording, [RECORDED.name]),
    (lambda a: RECORDING[a], ["heater_o"]),
    (lambda *a: RECORDING.at(*a), ["heater_o", [0, 1]]),
]  # fmt: skip

GOOD_ENDS = (TypeError, ValueError, KeyError, AttributeError, meltstage.Refused)


class WrongArguments(unittest.TestCase):
    def one(self, call, arguments, place):
        try:
            call(*arguments)
        except GOOD_ENDS as error:
            message = str(error)
            self.assertTrue(message, (call, place))
            self.assertNotIn("\n", message, (call, place))
            self.assertLess(len(message), 700, (call, place))
            self.assertNotIn("incompatible function arguments", message, (call, place))

    def test_anything_in_every_place(self):
        folder = os.getcwd()
        with tempfile.TemporaryDirectory() as scratch:  # a path that is taken may be written
            os.chdir(scratch)
            try:
                for call, good in CALLS:
                    for place in range(len(good)):
                        for value in ANYTHING:
                            arguments = [*good]
                            arguments[place] = value
                            with self.subTest(call=call, place=place):
                                self.one(call, arguments, place)
            finally:
                os.chdir(folder)

    def test_what_is_said(self):
        for call, expected, why in (
            (lambda: meltstage.plan_tour([[0, 1], [NAN, 2]]), meltstage.UserError, r"points_mm\[1, 0\]: found nan, expected a finite number"),
            (lambda: meltstage.plan_tour([0, 1, 2]), meltstage.UserError, r"points_mm: found shape \(3,\), expected shape \(n, 2\)"),
            (lambda: meltstage.plan_tour(np.ma.masked_greater([[0.0, 1.0], [9.0, 2.0]], 5)), meltstage.UserError, "points_mm: found masked elements"),
            (lambda: PROFILE.at(np.ma.masked), meltstage.UserError, "times_s: found masked elements"),
            (lambda: meltstage.plan_scurve(np.ma.masked), TypeError, "distance_mm: found an array of float64, shape .*, expected a number"),
            (lambda: meltstage.plan_tour([["a", "b"]]), TypeError, "points_mm: found .*, expected an array of numbers"),
            (lambda: meltstage.plan_tour([[1, 2]], metric="air"), meltstage.UserError, "metric: found 'air', expected one of manhattan, "),
            (lambda: PROFILE.at(INF), meltstage.UserError, r"times_s\[\]: found inf, expected a finite number"),
            (lambda: Chip().step(-1), meltstage.UserError, "clocks: found -1, expected 0 to "),
            (lambda: Chip().step(1.0), TypeError, "clocks: found 1.0, expected a whole number"),
            (lambda: setattr(Chip().inputs, "addr_strap_i", 8), meltstage.UserError, "addr_strap_i: found 8, expected 0 to 7"),
            (lambda: Chip().inputs.estop, AttributeError, "pin: found 'estop', expected one of rst_ni, "),
            (lambda: Chip().drive(drop_i=[0, 2]), meltstage.UserError, "drop_i: found 2, expected levels of 0 to 1"),
            (lambda: Chip().drive(drop_i=[0.5]), TypeError, "drop_i: found .0.5., expected an array of whole numbers or bools"),
            (lambda: Chip().drive(drop_i=[0], inhibit_i=[0, 1]), meltstage.UserError, "drive: found arrays of .1, 2. clocks"),
            (lambda: Chip().write("SETPOINT", NAN), meltstage.UserError, "SETPOINT: found nan, expected a finite number"),
            (lambda: Chip().write("SETPOINT", 600), meltstage.UserError, "SETPOINT: found 600.0, expected 0.0 to 500.0 degC"),
            (lambda: Chip().write("PV", 1), meltstage.UserError, "register: found PV, expected one that can be written"),
            (lambda: Chip().peek("SETPINT"), meltstage.UserError, "expected a name such as .*SETPOINT"),
            (lambda: Chip().flops["guard.runq"], KeyError, "expected a name such as guard.run_q"),
            (lambda: Run().until(-1), meltstage.UserError, "time_s: found -1.0, expected 0 to 1e"),
            (lambda: RECORDING["heater"], KeyError, "expected a name such as heater_"),
            (lambda: RECORDING.at("heater_o", 10**9), meltstage.UserError, "cycles: found 1000000000, expected cycles of 0 to 119999"),
        ):  # fmt: skip
            with self.assertRaisesRegex(expected, why):
                call()


if __name__ == "__main__":
    unittest.main()
