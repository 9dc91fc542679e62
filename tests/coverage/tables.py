#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tables.py FOLDER: tables of FOLDER/cpp.json (gcovr) and FOLDER/rtl.dat (verilator_coverage), and lists of what no test has run:
FOLDER/cpp.txt, FOLDER/rtl.txt. Exit status 1 when a room of C++ has less than WANTED_CPP, or a file of RTL not all."""
import collections
import json
import pathlib
import re
import sys

WANTED_CPP = 0.95  # of the lines of a room


def runs(numbers):
    """[1, 2, 3, 7] as 1-3, 7."""
    text, numbers = [], sorted(numbers)
    while numbers:
        first = last = numbers.pop(0)
        while numbers and numbers[0] == last + 1:
            last = numbers.pop(0)
        text.append(str(first) if first == last else f"{first}-{last}")
    return ", ".join(text)


def table(counts):
    """counts: name -> [run, all]. Prints a row each."""
    for name, (run, of) in sorted(counts.items()):
        print(f"{name:<28} {run:>7} of {of:>7}  {100 * run / of:6.2f} %")


def cpp(folder):
    rooms, missed = collections.defaultdict(lambda: [0, 0]), {}
    for file in json.loads((folder / "cpp.json").read_text())["files"]:
        counted = {}
        for line in file["lines"]:  # of each instance of a template
            if not line.get("gcovr/noncode"):
                counted[line["line_number"]] = max(counted.get(line["line_number"], 0), line["count"])
        room = file["file"].split("/")[0]
        rooms[room][0] += sum(count > 0 for count in counted.values())
        rooms[room][1] += len(counted)
        missed[file["file"]] = [number for number, count in counted.items() if count == 0]
    table(rooms)
    (folder / "cpp.txt").write_text("".join(f"{name}: {runs(lines)}\n" for name, lines in sorted(missed.items()) if lines))
    return all(run >= WANTED_CPP * of for run, of in rooms.values()) and bool(rooms)


POINT = re.compile(r"^C '(.*)' (\d+)$")


def rtl(folder):
    files, missed = collections.defaultdict(lambda: [0, 0]), []
    points = collections.Counter()
    for line in (folder / "rtl.dat").read_text(errors="replace").splitlines():
        if found := POINT.match(line):
            key = dict(part.split("\x02", 1) for part in found[1].split("\x01") if "\x02" in part)
            if "/properties/" in key["f"]:  # no part of the chip
                continue
            where = (pathlib.Path(key["f"]).name, int(key["l"]), key.get("o", ""), key.get("n", ""))
            points[where] += int(found[2])  # of all instances
    for (name, number, kind, _), count in points.items():
        files[name][0] += count > 0
        files[name][1] += 1
        if count == 0:
            missed.append(f"rtl/{name}:{number}: {kind}\n")
    table(files)
    (folder / "rtl.txt").write_text("".join(sorted(missed)))
    return all(run == of for run, of in files.values()) and bool(files)


def main():
    folder = pathlib.Path(sys.argv[1])
    good = [cpp(folder), rtl(folder)]
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
