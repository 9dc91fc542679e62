#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of mutate.py: which sites it finds, which mutants it makes of them, that a seed gives the same list again."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import mutate

FOLDER = pathlib.Path(__file__).resolve().parent
RTL = FOLDER.parents[2] / "rtl"
MODULE = """
module tc_x (
  input  logic       clk_i,
  input  logic [3:0] d_i,
  output logic       q_o
);
  localparam logic [3:0] Top = 4'd9;
  logic flag_q;
  logic [3:0] count_q;   // count_q = 4'd0
  assign q_o = flag_q && count_q <= Top;
  tc_sync #(.Width(1)) u_sync (.clk_i, .d_i(d_i <= 4'd3), .q_o());
  always_ff @(posedge clk_i) begin
    if (d_i == 4'd0 || flag_q)
      count_q <= count_q + 4'd1;
    flag_q <= 1'b0;
  end
`ifdef FORMAL
  assign proof = flag_q;
`endif
`ifndef SYNTHESIS
  logic past_q;
  always_ff @(posedge clk_i) past_q <= flag_q;
  `TC_ASSERT(Name_A, count_q <= Top)
`endif
endmodule
"""


def changes(site):
    return [(m.kind, m.change) for m in mutate.mutants(site)]


class Sites(unittest.TestCase):
    def setUp(self):
        self.sites = mutate.sites("tc_x.sv", MODULE)

    def test_only_code_that_a_chip_has(self):
        self.assertEqual([(s.lhs, s.clocked, s.width1) for s in self.sites],
                         [("q_o", False, True), (None, False, True), ("count_q", True, False), ("flag_q", True, True)])

    def test_a_field_is_named_whole_and_constants_are_left_alone(self):
        code = """
  localparam logic [3:0] Top = twice(4'd2);
  function automatic logic [3:0] twice(input logic [3:0] x);
    twice = plus(x, x);
  endfunction
  function automatic logic [3:0] plus(input logic [3:0] x, input logic [3:0] y);
    plus = x + y;
  endfunction
  function automatic logic [3:0] half(input logic [3:0] x);
    half = x >> 1;
  endfunction
  for (genvar i = 0; i < 2; i++) begin : gen_bit
    if (i == 0) begin : gen_first
      assign record_o.count = half(d_i);
    end
  end
"""
        self.assertEqual([s.lhs for s in mutate.sites("tc_x.sv", code)], ["half", "record_o.count"])

    def test_a_mutant_reads_no_signal_that_the_code_did_not_read(self):
        for name, text in mutate.variants.read(RTL).items():
            if name.endswith("_pkg.sv") or not name.endswith(".sv"):
                continue
            for site in mutate.sites(name, text):
                own = set(mutate.re.findall(r"[A-Za-z_]\w*", site.expression + " " + (site.lhs or ""))) | {"bits", "b0", "b1"}
                for mutant in mutate.mutants(site):
                    plain = mutate.LITERAL.sub("", (mutant.broken or "").replace("2'sd1", "").replace("1'b", "b"))
                    self.assertLessEqual(set(mutate.re.findall(r"[A-Za-z_]\w*", plain)), own, mutant)


class Mutants(unittest.TestCase):
    def setUp(self):
        self.pin, self.condition, self.count, self.flag = (changes(s) for s in mutate.sites("tc_x.sv", MODULE))

    def test_value_of_one_bit(self):
        self.assertEqual({kind for kind, _ in self.pin},
                         {"value negated", "value stuck at 0", "value stuck at 1", "operand dropped", "&& and || exchanged",
                          "comparison moved", "lowest bit not compared", "highest bit not compared"})

    def test_condition(self):
        self.assertEqual([c for k, c in self.condition if k == "operand dropped"], ["without d_i == 4'd0", "without flag_q"])
        self.assertIn(("comparison moved", "== -> !="), self.condition)

    def test_word(self):
        self.assertEqual({kind for kind, _ in self.count}, {"assignment dropped", "lowest bit flipped", "middle bit flipped",
                                                            "highest bit flipped", "literal + 1", "+ and - swapped"})

    def test_constant_of_one_bit(self):
        self.assertEqual([kind for kind, _ in self.flag], ["assignment dropped", "value negated"])

    def test_literal_wraps_at_its_width(self):
        literals = ("4'd9", "4'hF", "3'b111", "16'sd63", "10'h3FF")
        self.assertEqual([mutate.literal_plus_one(mutate.LITERAL.fullmatch(x)) for x in literals],
                         ["4'd10", "4'h0", "3'b0", "16'sd64", "10'h0"])

    def test_conditions_of_a_chain(self):
        text = "a ? x : b && c ? (d ? y : z) : w"
        self.assertEqual([text[i:j].strip() for i, j in mutate.conditions(text, 0, len(text))], ["a", "b && c"])

    def test_operands_inside_brackets(self):
        self.assertEqual([rest.split() for _, rest in mutate.operand_drops("a && (b || c)", 0, 13)],
                         [x.split() for x in ("  (b || c)", "a ", "a && ( c)", "a && (b )")])


    def test_a_comparison_ends_where_its_operands_do(self):
        text = "run_q && (tc_pkg::Top - a <= {b, c}) || d == 2'd1"
        spans = [mutate.around(text, *found.span()) for found in mutate.re.finditer("<=|==", text)]
        self.assertEqual([text[i:j].strip() for i, j in spans], ["tc_pkg::Top - a <= {b, c}", "d == 2'd1"])


class Branches(unittest.TestCase):
    def test_reset_branches_are_told(self):
        code = """
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      a_q <= 1'b0;
    end else begin
      a_q <= d_i;
    end
  end
  always_ff @(posedge clk_i or negedge rst_ni)
    if (!rst_ni) b_q <= 1'b0;
    else b_q <= d_i;
"""
        self.assertEqual([(s.lhs, s.branch) for s in mutate.sites("tc_x.sv", code)],
                         [(None, "reset"), ("a_q", "reset"), ("a_q", "logic"), (None, "reset"), ("b_q", "reset"), ("b_q", "logic")])


class Script(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as out:
            subprocess.run([sys.executable, "-B", FOLDER / "mutate.py", RTL, out], check=True)
            cls.files = {path.name: path.read_text() for path in pathlib.Path(out).iterdir()}

    def test_every_mutant_of_the_list_is_in_the_copy(self):
        rows = [row.split("\t") for row in self.files["mutants.tsv"].splitlines()]
        self.assertEqual([row[0] for row in rows], [str(n) for n in range(1, len(rows) + 1)])
        self.assertEqual(rows[-1][4], "identity")
        in_file = {name: set(mutate.re.findall(r"bug_i [!=]= 16'd(\d+)\b", text)) for name, text in self.files.items()}
        for row in rows:
            self.assertIn(row[0], in_file[row[1]], row)

    def test_each_module_and_instance_has_the_choice(self):
        for name, text in self.files.items():
            self.assertEqual(text.count("input logic [15:0] bug_i,"), len(mutate.re.findall(r"^module ", text, mutate.re.M)), name)
            self.assertEqual(text.count(".bug_i(bug_i)"), len(mutate.re.findall(r"^ +tc_\w+ .*u_\w+ \(", text, mutate.re.M)), name)

    def test_a_file_alone_has_the_same_numbers(self):
        with tempfile.TemporaryDirectory() as out:
            subprocess.run([sys.executable, "-B", FOLDER / "mutate.py", RTL, out, "--file", "tc_sync.sv"], check=True)
            own = {path.name: path.read_text() for path in pathlib.Path(out).iterdir()}
        self.assertEqual(own["tc_sync.sv"], self.files["tc_sync.sv"])
        self.assertEqual(len(mutate.re.findall(r"bug_i [!=]= ", own["tc_guard.sv"])), 0)
        rows = [row for row in self.files["mutants.tsv"].splitlines(keepends=True) if row.split("\t")[1] == "tc_sync.sv"]
        self.assertTrue(own["mutants.tsv"].startswith("".join(rows)))

    def test_packages_pass_unchanged(self):
        self.assertEqual(self.files["tc_math_pkg.sv"], (RTL / "tc_math_pkg.sv").read_text())


if __name__ == "__main__":
    unittest.main()
