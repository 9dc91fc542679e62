// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/netlist.hpp"

#include <gmock/gmock.h>

#include "asic/dft/core/bench_file.hpp"
#include "asic/dft/core/faults.hpp"
#include "asic/dft/program.hpp"
#include "asic/dft/scan/scan.hpp"
#include "base/error.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::string cell(const std::string& name, const std::string& type, const std::string& pins) {
  return "\"" + name + "\": {\"type\": \"" + type + "\", \"connections\": {" + pins + "}}";
}
std::string json(const std::string& ports, const std::string& cells) {
  return R"({"modules": {"top": {"attributes": {"top": "1"}, "ports": {)" + ports + "}, \"cells\": {" +
         cells + R"(}, "netnames": {}}}})";
}
const std::string kPorts =
    R"("a": {"direction": "input", "bits": [2]}, "b": {"direction": "input", "bits": [3]}, "y": {"direction": "output", "bits": [4]})";

CaptureView view_of(const std::string& text) {
  const TestFolder folder;
  return capture_view(read_yosys_json(folder.file("n.json", text)), mini_library());
}

TEST(Netlist, DirectionsAreThoseOfTheLibrary) {
  const auto with = [](const std::string& direction) {
    return json(kPorts, R"("g": {"type": "INV", "port_directions": {"A": ")" + direction +
                            R"("}, "connections": {"A": [2], "Y": [4]}})");
  };
  EXPECT_NO_THROW(view_of(with("input")));
  EXPECT_THAT([&] { view_of(with("output")); },
              ThrowsMessage<UserError>(HasSubstr(
                  "n.json: cells of INV: found A as output in port_directions, expected input as in ")));
}

// Two inputs, one NAND: ports and pins are six sites; a, b stuck-at-0 and y stuck-at-1 are one class.
TEST(Netlist, SitesAndClassesOfAGate) {
  const CaptureView view = view_of(json(kPorts, cell("g", "NAND2", R"("A": [2], "B": [3], "Y": [4])")));
  EXPECT_EQ(view.circuit.sites().size(), 6u);
  EXPECT_EQ(collapse(view.circuit).classes.size(), 4u);
}

// The pins of an AOI21 are branches of two gates: 4 pins and 4 ports, and A, B stuck-at-0 are one class.
TEST(Netlist, CellsOfSeveralGatesHaveFaultsOnTheirPinsAlone) {
  const CaptureView view = view_of(json(R"("c": {"direction": "input", "bits": [5]}, )" + kPorts,
                                        cell("g", "AOI21", R"("A": [2], "B": [3], "C": [5], "Y": [4])")));
  EXPECT_EQ(view.circuit.sites().size(), 8u);
  EXPECT_EQ(collapse(view.circuit).classes.size(), 6u);  // A0=B0, A1, B1, C0, C1=Y0, Y1
}

// A port that a net reaches besides a pin is a branch of its own.
TEST(Netlist, BranchesToPortsCount) {
  const CaptureView view = view_of(json(R"("z": {"direction": "output", "bits": [2]}, )" + kPorts,
                                        cell("g", "NAND2", R"("A": [2], "B": [3], "Y": [4])")));
  EXPECT_EQ(view.circuit.sites().size(), 7u);
  EXPECT_EQ(collapse(view.circuit).classes.size(), 8u);
}

TEST(Netlist, WrongNetlistsAreNamed) {
  EXPECT_THAT([] { view_of(json(kPorts, cell("g", "NAND9", R"("A": [2], "Y": [4])"))); },
              ThrowsMessage<UserError>(HasSubstr("cell g: found type NAND9")));
  EXPECT_THAT([] { view_of(json(kPorts, cell("g", "INV", R"("A": [9], "Y": [4])"))); },
              ThrowsMessage<UserError>(HasSubstr("g/A: found no driver")));
  EXPECT_THAT([] { view_of(json(kPorts, cell("g", "INV", R"("A": ["x"], "Y": [4])"))); },
              ThrowsMessage<UserError>(HasSubstr("no driver of net x")));
  EXPECT_THAT(
      [] {
        view_of(json(kPorts, cell("g", "INV", R"("A": [2], "Y": [4])") + "," +
                                 cell("h", "INV", R"("A": [3], "Y": [4])")));
      },
      ThrowsMessage<UserError>(HasSubstr("second driver")));
  EXPECT_THAT(
      [] {
        view_of(json(kPorts, cell("g", "AND2", R"("A": [2], "B": [5], "Y": [4])") + "," +
                                 cell("h", "INV", R"("A": [4], "Y": [5])")));
      },
      ThrowsMessage<UserError>(HasSubstr("combinational loop")));
  EXPECT_THAT([] { view_of("{}"); }, ThrowsMessage<UserError>(HasSubstr("found no \"modules\"")));
  EXPECT_THAT([] { view_of("nothing"); }, ThrowsMessage<UserError>(HasSubstr("n.json:1:2: found no JSON")));
}

TEST(Netlist, WrongStructureNamesThePlace) {
  const auto refuses = [](const std::string& text, const std::string& message) {
    EXPECT_THAT([&] { parse_yosys_json(text, "n.json"); }, ThrowsMessage<UserError>(HasSubstr(message)))
        << text;
  };
  refuses("", "n.json:1:1: found no JSON");
  refuses(json(R"("a": {"direction": "inout", "bits": [2]})", ""), "port a: inout, expected input or output");
  refuses(json(R"("a": {"bits": [2]})", ""), "port a: found no direction");
  refuses(json(R"("a": {"direction": "input", "bits": []})", ""), "port a: found no bit");
  refuses(json(kPorts, "\n" + cell("g", "INV", R"("A": [2, 3])")),
          "n.json:2:48: found cell g/A: several bits");
  refuses(json(kPorts, cell("g", "INV", "") + "," + cell("g", "INV", "")), "found cell g again");
  refuses(json(kPorts, "\"g\": {}"), "cell g: found no type");
  // the parser would take the last of two
  refuses(json(kPorts, "}, \"cells\": {"), "found key cells again, expected each name once");
  refuses(json(kPorts, cell("g", "INV", R"("A": [2], "A": [3])")), "found key A again");
  refuses(json(kPorts + ", " + kPorts, ""), "found port a again");
  refuses(json(kPorts, cell("g", "INV", R"("A": ["z"], "Y": [4])")), "found bit \"z\", expected a net");
  refuses(json(kPorts, R"("g": {"type": "INV", "port_directions": {"A": "in"}})"),
          "found direction in of cell g/A, expected input, output or inout");
  refuses(json(kPorts, R"("g": {"type": "INV", "port_directions": {"A": "input"}},
                          "h": {"type": "INV", "port_directions": {"A": "output"}})"),
          "n.json: cell h/A: found output, expected input as in another cell of INV");
  for (const char* bit :
       {"1", "-2", "2.5", "1e9", "100000001", "99999999999999999999", "\"2\"", "[2]", "{}", "null"})
    refuses(json("\n\"a\": {\"direction\": \"input\", \"bits\": [" + std::string(bit) + "]}", ""),
            "n.json:2:");
  refuses(R"({"modules": {"m": {"attributes": {"blackbox": "1"}}}})", "found black boxes alone");
  // Pins are named by the bits of their port.
  refuses(json(R"("a": {"direction": "input", "upto": 1, "bits": [2, 3, 4, 5]})", ""),
          "n.json: port a: found the range [0:3], expected [3:0], by which test patterns name its pins");
  refuses(json(R"("a": {"direction": "input", "offset": 2, "bits": [2, 3, 4]})", ""),
          "n.json: port a: found the range [4:2], expected [2:0]");
  refuses(R"({"modules": )" + std::string(100000, '['),
          "found objects and lists 65 deep, expected at most 64");
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "{\"a\":";
  refuses(deep, "found objects and lists 65 deep");
}

TEST(BenchFile, WhatStandsBesideTheInputsIsRefused) {
  const auto refuses = [](const std::string& row, const std::string& message) {
    EXPECT_THAT([&] { parse_bench("INPUT(a)\nINPUT(b)\nOUTPUT(y)\n" + row + "\n", "n.bench"); },
                ThrowsMessage<UserError>(HasSubstr("n.bench:4:1: found " + message)))
        << row;
  };
  refuses("y = AND(a, b) + c", "\"y = AND(a, b) + c\", expected NAME = GATE(INPUTS)");
  refuses("y = AND(a, b);", "\"y = AND(a, b);\", expected NAME");
  refuses("y = NAND(a, )", "an input without a name in \"y = NAND(a, )\"");
  refuses("y = NAND(a, , b)", "an input without a name");
  refuses("y = NAND(a, b,)", "an input without a name");
  refuses("y = NAND(a b)", "a blank within a name in \"y = NAND(a b)\", expected a comma between two names");
  refuses("y 1 = NAND(a, b)", "a blank within a name");
  refuses("INPUT(c) OUTPUT(q)", "more than one gate in \"INPUT(c) OUTPUT(q)\", expected one a line");
  EXPECT_NO_THROW(parse_bench(
      " INPUT ( a )\t\r\nOUTPUT(y)\nn = vdd\nz = GND()\ny = AND(a, n, z) # a remark\n", "n.bench"));
}

TEST(Netlist, NetsHaveTheIndicesOfTheirRange) {
  const Netlist netlist = parse_yosys_json(
      R"({"modules": {"m": {"ports": {}, "cells": {}, "netnames": {
         "u.up": {"upto": 1, "offset": 2, "bits": [2, 3]}, "u.down": {"offset": 4, "bits": [4, 5]}}}}})",
      "n.json");
  EXPECT_EQ(netlist.net_names.at(2), "u.up[3]");
  EXPECT_EQ(netlist.net_names.at(3), "u.up[2]");
  EXPECT_EQ(netlist.net_names.at(4), "u.down[4]");
  EXPECT_EQ(netlist.nets_in_modules.at("u.down[5]"), 5);
}

// Which of two modules is meant nobody knows; that of a library is none.
TEST(Netlist, ASecondTopIsRefused) {
  const auto design = [](const std::string& a, const std::string& b) {
    const auto module = [](const std::string& name, const std::string& attributes) {
      return "\n\"" + name + "\": {\"attributes\": {" + attributes +
             R"(}, "ports": {"i": {"direction": "input", "bits": [2]}}})";
    };
    return R"({"modules": {)" + module("a", a) + "," + module("b", b) + "}}";
  };
  const std::string top = R"("top": "00000000000000000000000000000001")";
  const auto top_of = [&](const std::string& a, const std::string& b) {
    return parse_yosys_json(design(a, b), "n.json").top;
  };
  EXPECT_EQ(top_of(top, ""), "a");
  EXPECT_EQ(top_of("", top), "b");
  EXPECT_EQ(top_of(R"("top": 1)", R"("top": "0000")"), "a");
  EXPECT_EQ(top_of(R"("blackbox": "1")", ""), "b");
  EXPECT_EQ(top_of("", R"("whitebox": 1)"), "a");
  EXPECT_EQ(top_of(R"("blackbox": 0)", R"("blackbox": true)"), "a");
  EXPECT_THAT([&] { top_of(top, top); },
              ThrowsMessage<UserError>(
                  HasSubstr("n.json:3:6: found modules a (line 2) and b (line 3) both marked as the top")));
  EXPECT_THAT([&] { top_of("", ""); },
              ThrowsMessage<UserError>(HasSubstr(
                  "n.json:3:6: found 2 modules, a (line 2) and b (line 3), none of them marked as the top")));
}

// What `rules` says of a netlist, a line a violation.
std::string broken_rules(const std::string& text, const CellLibrary& library = mini_library()) {
  std::string lines;
  for (const RuleViolation& v : check_rules(parse_yosys_json(text, "n.json"), library))
    lines += v.rule + ": " + v.offender + ": " + v.text + "\n";
  return lines;
}

TEST(Rules, ConnectionsThatGenerationRefusesAreToldPlainly) {
  const auto rules = [](const std::string& cells) { return broken_rules(json(kPorts, cells)); };
  EXPECT_EQ(rules(cell("g", "NAND2", R"("A": [2], "B": [3], "Y": [4])")), "");
  EXPECT_EQ(rules(cell("g", "NAND2", R"("A": [2], "Y": [4])")),
            "unconnected pin: g/B: nothing is connected to it\n");
  EXPECT_EQ(rules(cell("g", "NAND2", R"("A": [2], "B": [], "Y": [4])")),
            "unconnected pin: g/B: nothing is connected to it\n");
  EXPECT_EQ(rules(cell("g", "NAND2", R"("A": [2], "B": [3], "Z": [3], "Y": [4])")),
            "unknown pin: g/Z: NAND2 has no such pin\n");
  EXPECT_EQ(
      rules(cell("g", "INV", R"("A": [2], "Y": [4])") + "," + cell("h", "INV", R"("A": [3], "Y": [4])")),
      "several drivers: net 4: g/Y and h/Y drive it\n");
  EXPECT_EQ(
      rules(cell("g", "INV", R"("A": [2], "Y": [4])") + "," + cell("h", "INV", R"("A": [2], "Y": [3])")),
      "several drivers: net 3: port b and h/Y drive it\n");
  EXPECT_EQ(
      rules(cell("g", "INV", R"("A": [2], "Y": [4])") + "," + cell("h", "INV", R"("A": [2], "Y": ["1"])")),
      "driven constant: h/Y: it drives the constant 1\n");
  // an output that nobody reads asks for nothing
  EXPECT_EQ(rules(cell("g", "INV", R"("A": [2], "Y": [4])") + "," + cell("h", "INV", "")), "");
}

// The way of a reset is looked at before the connections are.
TEST(Rules, AFlopsPinsAreAskedForToo) {
  const std::string ports =
      R"("ck": {"direction": "input", "bits": [2]}, "rn": {"direction": "input", "bits": [3]}, "q": {"direction": "output", "bits": [4]})";
  const auto rules = [&](const std::string& cells) { return broken_rules(json(ports, cells)); };
  const std::string reset = cell("r", "AND2", R"("A": [3], "B": [4], "Y": [5], "NO": [3])");
  EXPECT_EQ(rules(cell("f", "DFFR", R"("CK": [2], "RN": [3], "D": [4], "Q": [4])")), "");
  EXPECT_EQ(rules(cell("f", "DFFR", R"("RN": [3], "D": [4], "Q": [4])")),
            "unconnected pin: f/CK: nothing is connected to it\n");
  EXPECT_EQ(rules(cell("f", "DFFR", R"("CK": [2], "Q": [4])")),
            "unconnected pin: f/D: nothing is connected to it\nunconnected pin: f/RN: nothing is connected "
            "to it\n");
  EXPECT_THAT(rules(reset + "," + cell("f", "DFFR", R"("CK": [2], "RN": [5], "D": [4], "Q": [4])")),
              HasSubstr("unknown pin: r/NO: AND2 has no such pin\n"));
  const TestFolder folder;
  const auto path = folder.file("n.json", json(ports, cell("f", "DFFR", R"("RN": [3], "D": [4], "Q": [4])")));
  EXPECT_THAT([&] { test_subject(path, mini_library(), {}); },
              ThrowsMessage<UserError>(HasSubstr("cell f: found nothing connected to CK, expected a clock")));
}

// Whatever else generation refuses, rules tells.
TEST(Rules, NothingThatGenerationRefusesPasses) {
  const std::string ports =
      R"("ck": {"direction": "input", "bits": [2]}, "scan_o": {"direction": "output", "bits": [4]})";
  EXPECT_THAT(
      broken_rules(json(ports, cell("f", "DFF", R"("CK": [2], "D": [4], "Q": [4])"))),
      HasSubstr("no tests: top: n.json: found logic that drives scan_o, expected a constant before scan\n"));
}

TEST(Rules, ADefectOfTheLibraryIsTheLibrarys) {
  const auto with = [](const std::string& output, const std::string& ff = "") {
    return parse_liberty("library (x) {\ncell (G) { " + ff +
                             "pin (A) { direction : input; } pin (B) { direction : input; }\n pin (Y) { "
                             "direction : output; " +
                             output + " } } }",
                         "x.lib");
  };
  const std::string netlist = json(kPorts, cell("g", "G", R"("A": [2], "B": [3], "Y": [4])")),
                    unused = json(kPorts, cell("h", "H", R"("Y": [4])"));
  const auto expect_told = [&](const CellLibrary& library, const std::string& rule, const std::string& said) {
    EXPECT_THAT(broken_rules(netlist, library), HasSubstr(rule));
    EXPECT_THAT(broken_rules(netlist, library), HasSubstr(said));
    EXPECT_THAT([&] { capture_view(parse_yosys_json(netlist, "n.json"), library); },
                ThrowsMessage<UserError>(testing::StartsWith(said)));
    EXPECT_THAT(broken_rules(unused, library), testing::Not(HasSubstr("x.lib")));
  };
  const std::string defect = "defect of the library: G: x.lib:";
  expect_told(with("function : \"A & NOPE\";"), defect,
              "x.lib:3:32: found NOPE in the function of G/Y, expected pins of the cell and its state");
  expect_told(with("function : \"A\"; three_state : \"B\";"), defect,
              "x.lib:3:48: found three_state of G/Y, expected cells that always drive");
  expect_told(with(""), "no tests: top: ", "x.lib:2:1: found no function of Y of G, expected one");
  const std::string state = "function : \"IQ\";";
  for (const char* statement : {"next_state", "clear", "preset"}) {
    const std::string next = statement == std::string("next_state") ? "" : "next_state : \"A\"; ";
    expect_told(with(state, "ff (IQ, IQN) { clocked_on : \"B\"; " + next + statement + " : \"NOPE\"; } "),
                defect,
                "x.lib:2:" + std::to_string(45 + next.size()) + ": found NOPE in the " + statement +
                    " of G, expected pins of the cell and its state");
  }
  expect_told(with(state, "ff (IQ, IQN) { clocked_on : \"A B\"; next_state : \"A\"; } "), defect,
              "x.lib:2:27: found clocked_on of G, expected one pin, or its inverse");
}

// A full adder in NANDs; lines and classes counted by hand: 9 gates, 3 inputs, stems of 1, 2 and 3 branches.
constexpr const char* kAdder = R"(
INPUT(a)
INPUT(b)
INPUT(c)
OUTPUT(sum)
OUTPUT(carry)
n1 = NAND(a, b)
n2 = NAND(a, n1)
n3 = NAND(b, n1)
n4 = NAND(n2, n3)
n5 = NAND(n4, c)
n6 = NAND(n4, n5)
n7 = NAND(c, n5)
sum = NAND(n6, n7)
carry = NAND(n5, n1)  # comment
)";

TEST(Bench, LinesAndClassesOfAFullAdder) {
  const Circuit circuit = bench_circuit(kAdder);
  // stems 12; branches of a 2, b 2, c 2, n1 3, n4 2, n5 3
  EXPECT_EQ(circuit.sites().size(), 12u + 14u);
  // of 52 faults each gate joins its inputs' stuck-at-0 and its output's stuck-at-1 (9 x 2 joins)
  EXPECT_EQ(collapse(circuit).classes.size(), 52u - 18u);
}

TEST(Bench, AByteOrderMarkSaysNothing) {
  EXPECT_EQ(bench_circuit("\xEF\xBB\xBFINPUT(a)\nOUTPUT(y)\ny = NOT(a)\n").sites().size(), 2u);
}

TEST(Bench, FlopsAreInputsAndOutputs) {
  const Circuit circuit = bench_circuit("INPUT(d)\nOUTPUT(y)\nq = DFF(n)\nn = XOR(d, q)\ny = NOT(q)\n");
  EXPECT_EQ(circuit.inputs().size(), 2u);
  EXPECT_EQ(circuit.outputs().size(), 2u);
}

TEST(Bench, DefectsNameFileAndLine) {
  EXPECT_THAT([] { bench_circuit("INPUT(a)\ny = NAN(a)\n"); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench:2:1: found gate \"NAN\"")));
  EXPECT_THAT([] { bench_circuit("INPUT(a)\nOUTPUT(y)\n"); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench:2:1: found no driver of y")));
  EXPECT_THAT([] { bench_circuit("INPUT(a)\nINPUT(a)\n"); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench:2:1: found a second driver of a")));
  EXPECT_THAT([] { bench_circuit("INPUT(a)\ny = NOT(a, a)\n"); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench:2:1: found 2 inputs of NOT")));
  EXPECT_THAT([] { bench_circuit("OUTPUT(y)\ny = AND(y, y)\n"); },
              ThrowsMessage<UserError>(HasSubstr("loop")));
  EXPECT_THAT([] { bench_circuit(""); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench: found no OUTPUT")));
  EXPECT_THAT([] { bench_circuit("INPUT(a)\n"); }, ThrowsMessage<UserError>(HasSubstr("found no OUTPUT")));
  EXPECT_THAT([] { bench_circuit("INPUT()\n"); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench:1:1: found")));
  EXPECT_THAT([] { bench_circuit("INPUT(a)\n  \x1b[31m = NAN(a)\n"); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench:2:3: found gate \"NAN\"")));
  EXPECT_THAT([] { bench_circuit("\x1b[31m\n"); },
              ThrowsMessage<UserError>(HasSubstr("found \"\\x1B[31m\"")));
  for (const char* name : {"a\x1b", "a\"", "a%"})
    EXPECT_THAT([&] { bench_circuit("OUTPUT(y)\ny = NOT(z)\n INPUT(" + std::string(name) + ")\n"); },
                ThrowsMessage<UserError>(HasSubstr("circuit.bench:3:2: found line \"a")));
  EXPECT_THAT([] { bench_circuit("rubbish\n"); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench:1:1: found \"rubbish\"")));
}

}  // namespace
}  // namespace meltstage::dft
