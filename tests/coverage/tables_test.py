#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What tables.py makes of counts: tables, lists of what no test has run, and its verdict."""
import contextlib
import io
import json
import pathlib
import tempfile
import unittest

import tables


def point(file, line, kind, hierarchy, count):
    return f"C '\x01f\x02/home/x/{file}\x01l\x02{line}\x01n\x025\x01page\x02v_line/m\x01o\x02{kind}\x01h\x02{hierarchy}' {count}\n"


class Tables(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def cpp(self, counts):
        lines = [{"line_number": number, "count": count} for number, count in counts]
        (self.folder / "cpp.json").write_text(json.dumps({"files": [{"file": "motion/a.cpp", "lines": lines}]}))
        return self.told(tables.cpp)

    def rtl(self, *points):
        (self.folder / "rtl.dat").write_text("# SystemC::Coverage-3\n" + "".join(points))
        return self.told(tables.rtl)

    def told(self, of):
        text = io.StringIO()
        with contextlib.redirect_stdout(text):
            good = of(self.folder)
        return good, text.getvalue()

    def test_lines_that_no_test_has_run_are_listed(self):
        good, text = self.cpp([(1, 3), (2, 0), (3, 0), (5, 0), (6, 1)])
        self.assertFalse(good)
        self.assertIn("motion", text)
        self.assertIn("2 of       5", text)
        self.assertEqual((self.folder / "cpp.txt").read_text(), "motion/a.cpp: 2-3, 5\n")

    def test_a_line_of_two_instances_is_run_when_one_is(self):
        good, text = self.cpp([(1, 0), (1, 2)])
        self.assertTrue(good)
        self.assertIn("1 of       1", text)

    def test_95_percent_are_enough_and_94_are_not(self):
        self.assertTrue(self.cpp([(number, number > 5) for number in range(1, 101)])[0])
        self.assertFalse(self.cpp([(number, number > 6) for number in range(1, 101)])[0])

    def test_nothing_counted_is_not_good(self):
        (self.folder / "cpp.json").write_text('{"files": []}')
        self.assertFalse(self.told(tables.cpp)[0])
        self.assertFalse(self.rtl()[0])

    def test_a_point_of_rtl_is_met_in_any_instance(self):
        good, text = self.rtl(point("rtl/tc_a.sv", 7, "else", "top.u1", 0), point("rtl/tc_a.sv", 7, "else", "top.u2", 4))
        self.assertTrue(good)
        self.assertIn("tc_a.sv", text)

    def test_a_point_of_rtl_that_is_not_met_is_listed(self):
        good, _ = self.rtl(point("rtl/tc_a.sv", 7, "else", "top.u1", 0), point("rtl/tc_a.sv", 7, "if", "top.u1", 4))
        self.assertFalse(good)
        self.assertEqual((self.folder / "rtl.txt").read_text(), "rtl/tc_a.sv:7: else\n")

    def test_properties_are_no_part_of_the_chip(self):
        good, text = self.rtl(point("rtl/properties/tc_p.sv", 7, "if", "top.p", 0), point("rtl/tc_a.sv", 7, "if", "top.u1", 4))
        self.assertTrue(good)
        self.assertNotIn("tc_p.sv", text)


if __name__ == "__main__":
    unittest.main()
