#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""speed.py [--least RATIO] [--json]: how fast meltstage.Chip.step() is beside the same loop in a C++ program, in processor time.

Both take the same clocks from reset, in turn, and the fastest of their rounds counts. Run it as
build/release/python/speed.py. Exit status: 0, 1 when the ratio is below --least, 2 for wrong use.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import time

FOLDER = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER))
import meltstage  # noqa: E402

CLOCKS = 2_000_000
ROUNDS = 7


def python_ns() -> float:
    chip = meltstage.Chip()
    begin = time.process_time()
    chip.step(CLOCKS)
    return (time.process_time() - begin) / CLOCKS * 1e9


def cpp_ns() -> float:
    return float(subprocess.run([FOLDER / "step_loop", str(CLOCKS)], capture_output=True, text=True, check=True).stdout.split()[0])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--least", type=float, default=0.0, metavar="RATIO")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    rounds = [(python_ns(), cpp_ns()) for _ in range(ROUNDS)]
    python, cpp = (min(times) for times in zip(*rounds))
    if asked.json:
        print(json.dumps({"python_ns": python, "cpp_ns": cpp}))
    else:
        print(f"a clock by Chip.step(): {python:.1f} ns; in C++: {cpp:.1f} ns; speed of Python over C++: {cpp / python:.2f}")
    return 0 if cpp / python >= asked.least else 1


if __name__ == "__main__":
    sys.exit(main())
