#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""induction.py BASE.aig STEP.aig NAMES [NAME]: k-induction by CaDiCaL, each assertion by itself while all are assumed in the clocks before.

BASE.aig: logic of the first k clocks from reset, STEP.aig: of k + 1 clocks from any state; of each clock an output for each line of NAMES,
1 where that assertion fails (binary AIGER; outputs behind those are not looked at). NAME: only this assertion.
Columns of parity checks are where ABC's own solver doesn't end. Exit status: 0 proved, 1 not (the last line says which).
"""
import pathlib
import subprocess
import sys
import tempfile


def read_aiger(path):
    """The and gates as clauses, and the outputs as literals of them; variable 1 is false."""
    data = pathlib.Path(path).read_bytes()
    place = data.index(b"\n") + 1
    _, inputs, latches, outputs, gates = (int(x) for x in data[:place].split()[1:6])
    if latches:
        sys.exit(f"induction.py: {path}: found {latches} latches, expected logic alone")

    def literal(x):
        return -(x // 2 + 1) if x % 2 else x // 2 + 1

    outs = []
    for _ in range(outputs):
        end = data.index(b"\n", place)
        outs.append(literal(int(data[place:end])))
        place = end + 1

    def delta():
        nonlocal place
        value = shift = 0
        while True:
            byte = data[place]
            place += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    clauses = ["-1 0"]
    for gate in range(gates):
        out = 2 * (inputs + 1 + gate)
        left = out - delta()
        right = left - delta()
        o, a, b = literal(out), literal(left), literal(right)
        clauses += [f"{-o} {a} 0", f"{-o} {b} 0", f"{o} {-a} {-b} 0"]
    return inputs + gates + 1, clauses, outs


def never(problem, assumed, wanted):
    """True when none of the literals `wanted` can be true while the literals `assumed` are false."""
    variables, clauses, _ = problem
    more = [f"{-x} 0" for x in assumed] + [" ".join(str(x) for x in wanted) + " 0"]
    with tempfile.NamedTemporaryFile("w", suffix=".cnf") as file:
        file.write(f"p cnf {variables} {len(clauses) + len(more)}\n")
        file.write("\n".join(clauses + more) + "\n")
        file.flush()
        status = subprocess.run(["cadical", "-q", "-n", file.name], stdout=subprocess.DEVNULL, check=False).returncode
    if status not in (10, 20):
        sys.exit(f"induction.py: cadical ended with {status}")
    return status == 20


def main(base_file, step_file, names_file, only=None):
    names = [line.strip().rsplit("/", 1)[-1] for line in pathlib.Path(names_file).read_text().splitlines()]
    base, step = read_aiger(base_file), read_aiger(step_file)
    count = len(names)
    clocks = len(base[2]) // count
    if not never(base, [], base[2][:clocks * count]):
        print(f"refuted within {clocks} clocks of reset")
        return 1
    for number, name in enumerate(names):
        if only in (None, name) and not never(step, step[2][:clocks * count], [step[2][clocks * count + number]]):
            print(f"{name} does not follow from the {clocks} clocks before")
            return 1
    print("proved")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
