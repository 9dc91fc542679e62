# SPDX-License-Identifier: Apache-2.0
"""Long calls: other threads run meanwhile, a signal ends them, and two threads don't meet in one object."""
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import numpy as np

import meltstage

FOREVER = 2**62


class Stopped(Exception):
    pass


def stop(*_):
    raise Stopped


class Signals(unittest.TestCase):
    def setUp(self):
        before = signal.signal(signal.SIGALRM, stop)
        self.addCleanup(signal.signal, signal.SIGALRM, before)
        self.addCleanup(signal.setitimer, signal.ITIMER_REAL, 0)

    def is_stopped(self, call, *arguments, **named):
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        begin = time.monotonic()
        with self.assertRaises(Stopped):
            call(*arguments, **named)
        self.assertLess(time.monotonic() - begin, 5)  # other work of the machine counted

    def test_step_and_advance(self):
        chip = meltstage.Chip()
        self.is_stopped(chip.step, FOREVER)
        stepped = chip.cycle
        self.assertGreater(stepped, 0)
        self.is_stopped(chip.advance, FOREVER)
        again = meltstage.Chip()
        again.advance(chip.cycle)
        self.assertEqual(again, chip)  # what was done is whole

    def test_run(self):
        run = meltstage.Run("1 set SETPOINT 110\n1.2 run")
        self.is_stopped(run.until, 1e9)
        self.assertEqual(run.trace.tobytes(), meltstage.play("1 set SETPOINT 110\n1.2 run", run.time_s).trace.tobytes())

    def test_tour(self):
        points = np.random.default_rng(1).uniform(0, 100, (3000, 2))
        self.is_stopped(meltstage.plan_tour, points, search_s=600)

    def test_samples(self):
        self.is_stopped(lambda: [meltstage.plan_scurve(3).at(np.zeros(1_000_000)) for _ in range(10_000)])

    def test_replay(self):
        with tempfile.NamedTemporaryFile(suffix=".mvec") as file:
            meltstage.play("0.1 set SETPOINT 110\n0.2 run", 2).record(file.name)
            recording = meltstage.read_recording(file.name)
        self.is_stopped(lambda: [recording.replay() for _ in range(10_000)])


class Threads(unittest.TestCase):
    def test_python_counts_while_the_chip_steps(self):
        chip = meltstage.Chip()
        steps = threading.Thread(target=chip.step, args=(3_000_000,))
        count = 0
        steps.start()
        while steps.is_alive():
            count += 1
        self.assertEqual(chip.cycle, 3_000_000)
        self.assertGreater(count, 1000)  # with the interpreter's lock held: a handful

    def test_a_second_thread_is_turned_away(self):
        for held, look in ((meltstage.Chip(), lambda chip: chip.cycle), (meltstage.Run("1 run"), lambda run: run.trace)):
            work = held.step if isinstance(held, meltstage.Chip) else held.until
            thread = threading.Thread(target=work, args=(2_000_000 if isinstance(held, meltstage.Chip) else 60,))
            thread.start()
            refusals = 0
            while thread.is_alive():
                try:
                    look(held)
                except RuntimeError as refusal:
                    self.assertIn("found the object at work in another thread", str(refusal))
                    refusals += 1
            self.assertGreater(refusals, 0)
            look(held)

    def test_daemon_threads_outlive_the_interpreter(self):
        program = """if True:
            import threading, time, meltstage, numpy
            points = numpy.random.default_rng(1).uniform(0, 100, (3000, 2))
            for work in (
                lambda: meltstage.Chip().step(2**62),
                lambda: meltstage.Run().until(1e9),
                lambda: meltstage.plan_tour(points, search_s=600),
                lambda: [meltstage.plan_scurve(3).at(numpy.zeros(1000)) for _ in range(10**9)],
            ):
                threading.Thread(target=work, daemon=True).start()
            time.sleep(0.3)
        """
        ended = subprocess.run(["/usr/bin/python3", "-B", "-c", program], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((ended.returncode, ended.stderr), (0, ""))

    def test_chips_of_several_threads_do_not_disturb_each_other(self):
        chips = [meltstage.Chip() for _ in range(4)]
        threads = [threading.Thread(target=chip.step, args=(500_000,)) for chip in chips]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        alone = meltstage.Chip()
        alone.step(500_000)
        self.assertTrue(all(chip == alone for chip in chips))


if __name__ == "__main__":
    unittest.main()
