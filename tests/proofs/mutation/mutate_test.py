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
                         {"value negated", "value stuck at 0", "value stuck at 1", "operand dropped", "comparison moved"})

    def test_condition(self):
        self.assertEqual([c for k, c in self.condition if k == "operand dropped"], ["without d_i == 4'd0", "without flag_q"])
        self.assertIn(("comparison moved", "== -> !="), self.condition)

    def test_word(self):
        self.assertEqual({kind for kind, _ in self.count}, {"assignment dropped", "lowest bit flipped", "highest bit flipped",
                                                            "literal + 1", "+ and - swapped"})

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


class Script(unittest.TestCase):
    def run_script(self, count, seed):
        with tempfile.TemporaryDirectory() as out:
            done = subprocess.run([sys.executable, "-B", FOLDER / "mutate.py", RTL, out, "--count", str(count), "--seed", str(seed)],
                                  capture_output=True, text=True, check=False)
            return done, {path.name: path.read_text() for path in pathlib.Path(out).iterdir()}

    def test_a_seed_gives_the_same_again_and_another_does_not(self):
        first, again, other = (self.run_script(20, seed)[1] for seed in (1, 1, 2))
        self.assertEqual(first, again)
        self.assertNotEqual(first["mutants.tsv"], other["mutants.tsv"])

    def test_every_mutant_of_the_list_is_in_the_copy(self):
        _, files = self.run_script(20, 3)
        rows = [row.split("\t") for row in files["mutants.tsv"].splitlines()]
        self.assertEqual([row[0] for row in rows], [str(n) for n in range(1, 22)])
        self.assertEqual(rows[-1][3], "identity")
        for row in rows:
            self.assertEqual(len(mutate.re.findall(rf"bug_i [!=]= 16'd{row[0]}\b", files[row[1]])), 1, row)

    def test_packages_pass_unchanged(self):
        _, files = self.run_script(20, 3)
        self.assertEqual(files["tc_math_pkg.sv"], (RTL / "tc_math_pkg.sv").read_text())

    def test_too_many_are_refused(self):
        done, files = self.run_script(1_000_000, 1)
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, r"^--count: expected 1 \.\. \d+ .*found 1000000\n$")
        self.assertEqual(files, {})


if __name__ == "__main__":
    unittest.main()
