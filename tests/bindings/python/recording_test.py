# SPDX-License-Identifier: Apache-2.0
"""Recordings: signals as arrays, and the replay's first mismatch."""
import hashlib
import pathlib
import re
import tempfile
import unittest

import numpy as np

import meltstage

RUN = meltstage.play("0.1 set SETPOINT 110\n0.2 run", 0.5)


class Recordings(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name) / "run.mvec"
        RUN.record(self.path)

    def sealed(self, body: str) -> meltstage.Recording:
        """The recording with other lines and the hash that belongs to them."""
        body = body.rsplit("sha256 ", 1)[0]
        other = self.path.with_name("edited.mvec")
        other.write_text(f"{body}sha256 {hashlib.sha256(body.encode()).hexdigest()}\n")
        return meltstage.read_recording(other)

    def test_signals_are_those_of_the_run(self):
        recording = meltstage.read_recording(self.path)
        pins = RUN.pins(0, 0.5)
        self.assertEqual(list(recording), list(meltstage.PINS))
        self.assertEqual((recording.first_cycle, recording.final_cycle, recording.clock_hz), (0, 5_999_999, 12e6))
        for name in ("uart_rx_i", "spi_sclk_o", "safe_en_o", "rst_ni"):
            np.testing.assert_array_equal(recording.at(name, pins["cycle"]), pins[name], name)
            self.assertTrue((np.diff(recording[name].values.astype(int)) != 0).all())
        self.assertEqual(recording.signals["addr_strap_i"][1:], ("in", 3, "chip"))

    def test_the_model_replays_its_own_run(self):
        replay = meltstage.read_recording(self.path).replay()
        self.assertEqual(replay, meltstage.Replay(6_000_000, None))

    def test_the_first_mismatch_is_told(self):
        body = self.path.read_text()
        alone = re.search(r"^(\d+) uart_tx_o=0$", body, re.M)  # the start bit of an answer
        cycle = int(alone[1])
        early = self.sealed(body.replace(alone[0], f"{cycle - 1} uart_tx_o=0"))
        self.assertEqual(early.replay(), meltstage.Replay(cycle - 1, meltstage.Mismatch(cycle - 1, "uart_tx_o", 0, 1)))

    def test_defects_have_a_place(self):
        self.path.write_text(self.path.read_text().replace("\nend ", "\nEnd "))
        with self.assertRaisesRegex(meltstage.UserError, "run.mvec:") as defect:
            meltstage.read_recording(self.path)
        self.assertGreater(defect.exception.line, 20)
        self.assertEqual(defect.exception.column, 1)

    def test_text_that_is_no_utf_8(self):
        body = self.path.read_bytes().rsplit(b"sha256 ", 1)[0].replace(b"origin meltstage", b"origin \xffmeltstage", 1)
        self.path.write_bytes(body + b"sha256 " + hashlib.sha256(body).hexdigest().encode() + b"\n")
        self.assertTrue(meltstage.read_recording(self.path).origin.startswith("\\xffmeltstage"))

    def test_recordings_that_do_not_replay(self):
        body = self.path.read_text()
        for edited, why in (
            (body.replace("heater_o", "heater_x"), "found no pin heater_o"),
            (body.replace("clock_hz 12000000", "clock_hz 16000000"), "found a clock of"),
            (body.replace("rst_ni=0", "rst_ni=1", 1).replace("\n20 rst_ni=1", "\n20 drop_i=1"), "found reset released in cycle 0"),
        ):
            with self.assertRaisesRegex(meltstage.UserError, why):
                self.sealed(edited).replay()

    def test_places_that_cannot_be_written(self):
        with self.assertRaises(meltstage.UserError):
            RUN.record(self.path / "inside-a-file.mvec")
        with self.assertRaises(meltstage.UserError):
            RUN.record(self.path.parent / "no-folder" / "run.mvec")


if __name__ == "__main__":
    unittest.main()
