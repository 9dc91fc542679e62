# SPDX-License-Identifier: Apache-2.0
"""meltstage.Chip: clocks, pins, registers, flops and the whole state."""
import copy
import math
import pickle
import unittest

import numpy as np

import meltstage


def running() -> meltstage.Chip:
    chip = meltstage.Chip()
    chip.step(1000)
    return chip


class Clocks(unittest.TestCase):
    def test_advance_ends_in_the_state_of_step(self):
        stepped, advanced = running(), running()
        stepped.step(2_500_000)
        advanced.advance(2_500_000)
        self.assertEqual(advanced.differences(stepped), {})
        self.assertEqual(stepped.cycle, 2_501_000)
        self.assertEqual(stepped, advanced)

    def test_drive_is_step_with_pins_set_before_each(self):
        driven, stepped = running(), running()
        stop = np.array([0, 1, 1, 0, 1, 0, 0], bool)
        strap = np.arange(7)
        rows = driven.drive(inhibit_i=stop, addr_strap_i=strap)
        for clock in range(7):
            stepped.inputs.inhibit_i = bool(stop[clock])
            stepped.inputs.addr_strap_i = strap[clock]
            stepped.step()
            for pin in rows.dtype.names:
                self.assertEqual(rows[pin][clock], getattr(stepped.outputs, pin), (pin, clock))
        self.assertEqual(driven, stepped)

    def test_a_byte_on_the_serial_line_comes_back_as_an_answer(self):
        frame = bytes([1, 0x03, 0x01, 0x01, 0, 1])  # reads SETPOINT
        crc = 0xFFFF
        for byte in frame:
            crc ^= byte
            for _ in range(8):
                crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
        bits = []
        for byte in frame + crc.to_bytes(2, "little"):
            data = [byte >> i & 1 for i in range(8)]
            bits += [0, *data, sum(data) % 2, 1]
        rx = np.concatenate([np.repeat(np.array(bits), 104), np.ones(60_000, int)])
        self.assertEqual(running().drive(uart_rx_i=rx)["uart_de_o"].max(), 1)

    def test_drive_of_no_clock_moves_nothing(self):
        chip = running()
        self.assertEqual(len(chip.drive(inhibit_i=np.zeros(0, int))), 0)
        self.assertEqual(chip, running())


class Pins(unittest.TestCase):
    def test_emergency_stop_latches_its_fault(self):
        chip = running()
        self.assertEqual((chip.outputs.fault_no, chip.fault), (1, ""))
        chip.inputs.inhibit_i = 1
        chip.step(10)
        self.assertEqual(chip.outputs.fault_no, 0)
        self.assertTrue(chip.fault.startswith("Inhibit: "), chip.fault)

    def test_every_pin_is_there(self):
        chip = running()
        for name, pin in meltstage.PINS.items():
            level = getattr(chip.outputs if pin.output else chip.inputs, name)
            self.assertIn(level, range(1 << pin.width))
        self.assertEqual(sorted(dir(chip.inputs) + dir(chip.outputs)), sorted(meltstage.PINS))


class Registers(unittest.TestCase):
    def test_values_are_in_the_unit(self):
        chip = running()
        self.assertTrue(math.isnan(chip.peek("PV")))
        chip.write("setpoint", 110.04)
        chip.step(2_000_000)
        self.assertAlmostEqual(chip.peek("SETPOINT"), 110.0)
        chip.write("T_MIN", -12.5)
        self.assertAlmostEqual(chip.read("T_MIN"), -12.5)

    def test_reading_as_a_host_counts_as_a_message_and_a_look_does_not(self):
        chip = running()
        before = chip.peek("MESSAGES")
        chip.peek("STATUS")
        self.assertEqual(chip.peek("MESSAGES"), before)
        chip.read("STATUS")
        self.assertEqual(chip.peek("MESSAGES"), before + 1)

    def test_the_chip_refuses(self):
        chip = running()
        with self.assertRaisesRegex(meltstage.Refused, "write SETPOINT.*refuses with exception 3") as refusal:
            chip.write("SETPOINT", 400)  # above T_MAX
        self.assertEqual(refusal.exception.code, 3)
        with self.assertRaises(meltstage.Refused):
            meltstage.Chip().read("STATUS")  # in reset

    def test_commands(self):
        chip = running()
        chip.write("SETPOINT", 100)
        chip.step(2_000_000)
        chip.command("run")
        chip.step(10)
        self.assertEqual(chip.flops["guard.run_q"], 1)


class WholeState(unittest.TestCase):
    def setUp(self):
        self.chip = meltstage.play("1 set SETPOINT 90\n1.2 run", 3).chip
        self.chip.inputs.addr_strap_i = 5

    def same_future(self, other: meltstage.Chip):
        self.assertEqual(other, self.chip)
        self.assertEqual(other.cycle, self.chip.cycle)
        stop = np.tile([0, 0, 1, 0], 5000)
        np.testing.assert_array_equal(other.drive(drop_i=stop), self.chip.drive(drop_i=stop))
        self.assertEqual(other, self.chip)

    def test_copy(self):
        self.same_future(copy.copy(self.chip))

    def test_pickle(self):
        self.same_future(pickle.loads(pickle.dumps(self.chip)))

    def test_a_damaged_pickle_is_refused(self):
        def damaged(**parts):
            return {**self.chip.__getstate__(), **parts}

        flops = self.chip.__getstate__()["flops"]
        for state in (None, {}, damaged(flops={}), damaged(inputs={}), damaged(cycle=-1), damaged(cycle=2**63), damaged(cycle=2**70),
                      damaged(flops={**flops, "guard.run_q": 2}), damaged(flops={**flops, "guard.run_q": -1})):
            with self.assertRaises(meltstage.UserError) as raised:
                meltstage.Chip.__new__(meltstage.Chip).__setstate__(state)
            self.assertNotIn("\n", str(raised.exception))

    def test_a_copy_goes_its_own_way(self):
        other = copy.deepcopy(self.chip)
        other.step(1000)
        self.assertNotEqual(other, self.chip)

    def test_flops(self):
        self.chip.flops["guard.run_q"] = 0
        self.assertEqual(self.chip.flops["guard.run_q"], 0)
        other = copy.copy(self.chip)
        other.flops["mem.active_q[3]"] ^= 1
        self.assertEqual(list(self.chip.differences(other)), ["mem.active_q[3]"])
        self.assertGreater(len(self.chip.flops), 300)


if __name__ == "__main__":
    unittest.main()
