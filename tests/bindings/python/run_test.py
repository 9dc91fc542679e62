# SPDX-License-Identifier: Apache-2.0
"""meltstage.Run: a scenario as the command plays it, and what one sees of it. Given by the build: MELTSTAGE, the command."""
import csv
import os
import subprocess
import tempfile
import unittest

import numpy as np

import meltstage

HEAT = "head PH-A\n1 set SETPOINT 60; 1.2 run"


class Scenario(unittest.TestCase):
    def test_the_command_plays_the_same(self):
        with tempfile.NamedTemporaryFile("w", suffix=".txt") as scenario:
            scenario.write(HEAT + "\n9 sensor open\n")
            scenario.flush()
            told = subprocess.run(
                [os.environ["MELTSTAGE"], "chip", "play", scenario.name, "--for", "12"], capture_output=True, text=True, check=True
            )
        rows = list(csv.DictReader(told.stdout.splitlines()))
        trace = meltstage.play(HEAT + "\n9 sensor open", 12).trace
        self.assertEqual(len(rows), len(trace))
        for row, mine in zip(rows, trace):
            self.assertEqual(int(row["pins_hash"], 16), mine["pins_hash"])
            self.assertEqual(row["state"], meltstage.STATES[int(mine["state"])])
            self.assertAlmostEqual(float(row["block_degc"]), mine["block_degc"], places=3)

    def test_it_heats(self):
        run = meltstage.play(HEAT, 60)
        self.assertGreater(run.trace["block_degc"][-1], run.trace["block_degc"][0] + 5)
        self.assertTrue(np.isnan(run.trace["reading_degc"][0]))
        self.assertEqual((run.failures, run.failed, run.fault), ([], 0, ""))

    def test_going_on_in_parts_is_the_same_run(self):
        parts = meltstage.Run(HEAT)
        for time in (0.3, 1.1, 1.1, 4.0):
            parts.until(time)
        self.assertEqual(parts.trace.tobytes(), meltstage.play(HEAT, 4).trace.tobytes())
        self.assertEqual(parts.chip, meltstage.play(HEAT, 4).chip)

    def test_do_is_an_event_of_the_scenario(self):
        run = meltstage.Run("head PH-A").do("set SETPOINT 60", at_s=1).do("run", at_s=1.2).until(4)
        self.assertEqual(run.trace.tobytes(), meltstage.play(HEAT, 4).trace.tobytes())
        self.assertEqual(run.do("estop on").events_to_come, 1)
        self.assertIn("Inhibit", run.until(4.5).fault)

    def test_a_line_that_is_not_understood(self):
        with self.assertRaises(meltstage.UserError) as defect:
            meltstage.Run("head PH-A\n1 set SETPOINT 110\n2 sett X")
        self.assertEqual((defect.exception.line, defect.exception.found), (3, "sett X"))
        self.assertIn("one of set, run", defect.exception.expected)
        self.assertIn("scenario, line 3", str(defect.exception))
        with self.assertRaisesRegex(meltstage.UserError, "event: found 700, expected SETPOINT of 0.0 to 500.0 degC"):
            meltstage.Run().do("set SETPOINT 700")

    def test_what_the_chip_refuses_is_a_failure(self):
        run = meltstage.play("1 set SETPOINT 400", 2)
        self.assertEqual(run.failed, 1)
        self.assertEqual((run.failures[0].line, run.failures[0].failed), (1, True))
        self.assertIn("refused", run.failures[0].answer)


class Pins(unittest.TestCase):
    def test_changes_of_pins(self):
        run = meltstage.play(HEAT, 3)
        pins = run.pins(0, 3)
        self.assertEqual(pins["cycle"][0], 0)
        self.assertEqual(pins["rst_ni"][0], 0)
        self.assertTrue((np.diff(pins["cycle"].astype(np.int64)) > 0).all())
        later = run.pins(2, 2.5)
        inside = pins[(pins["cycle"] >= 24_000_000) & (pins["cycle"] < 30_000_000)]
        np.testing.assert_array_equal(later[1:], inside[-(len(later) - 1) :])
        with self.assertRaisesRegex(meltstage.UserError, "end_s: found 1, expected a time from begin_s"):
            run.pins(2, 1)

    def test_the_chip_goes_on_alone(self):
        chip = meltstage.play(HEAT, 2).chip
        self.assertEqual((chip.cycle, chip.inputs.rst_ni), (24_000_000, 1))


if __name__ == "__main__":
    unittest.main()
