#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""closed_forms.py CHANGES MODEL TRIAL BUILD: each change of CHANGES is made in a copy of the model, and the tests of skipping are run on it.

The copy is TRIAL/cmodel, the program that is built from it the target closed_form_trial of the build folder BUILD. Prints a line for each
change that the tests don't find. Exit status: 0 all are found and the model itself passes, 1 not so, 2 wrong use.
"""
import pathlib
import shutil
import subprocess
import sys


def build_and_run(trial, build):
    made = subprocess.run(["cmake", "--build", build, "--target", "closed_form_trial"], capture_output=True, text=True)
    if made.returncode != 0:
        sys.exit(f"closed_forms.py: cannot build closed_form_trial:\n{made.stdout[-3000:]}")
    tests = subprocess.run([trial / "closed_form_trial", "--gtest_brief=1", "--gtest_fail_fast"], capture_output=True, timeout=600)
    return tests.returncode == 0


def main():
    if len(sys.argv) != 5:
        print("closed_forms.py: expected CHANGES MODEL TRIAL BUILD", file=sys.stderr)
        return 2
    changes, model, trial = map(pathlib.Path, sys.argv[1:4])
    copy = trial / "cmodel"
    shutil.rmtree(copy, ignore_errors=True)
    # Files with the time of now: a run that was cut off left objects of a changed model, newer than the model's own files.
    shutil.copytree(model, copy, copy_function=shutil.copyfile)
    missed = 0
    lines = [line for line in changes.read_text().splitlines() if not line.startswith("#")]
    if not build_and_run(trial, sys.argv[4]):
        print("the model as it is: the tests fail")
        missed += 1
    for number, line in enumerate(lines, 1):
        name, old, new = line.split("\t")
        text = (model / name).read_text()
        if text.count(old) != 1:
            print(f"{changes}: change {number}: found {text.count(old)} places with '{old}' in {name}, expected 1")
            missed += 1
            continue
        (copy / name).write_text(text.replace(old, new))
        if build_and_run(trial, sys.argv[4]):
            print(f"not found: {name}: '{new}' for '{old}'", flush=True)
            missed += 1
        (copy / name).write_text(text)
    print(f"{len(lines)} changes of the closed forms, {missed} not found")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
