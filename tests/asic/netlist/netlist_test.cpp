// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/netlist.hpp"

#include <gmock/gmock.h>

#include "asic/dft/core/faults.hpp"
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
  for (const char* bit :
       {"1", "-2", "2.5", "1e9", "100000001", "99999999999999999999", "\"2\"", "[2]", "{}", "null"})
    refuses(json("\n\"a\": {\"direction\": \"input\", \"bits\": [" + std::string(bit) + "]}", ""),
            "n.json:2:");
  refuses(R"({"modules": {"m": {"attributes": {"blackbox": "1"}}}})", "found black boxes alone");
  refuses(R"({"modules": )" + std::string(100000, '['),
          "found objects and lists 65 deep, expected at most 64");
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "{\"a\":";
  refuses(deep, "found objects and lists 65 deep");
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
  EXPECT_THAT([] { bench_circuit("rubbish\n"); },
              ThrowsMessage<UserError>(HasSubstr("circuit.bench:1:1: found \"rubbish\"")));
}

}  // namespace
}  // namespace meltstage::dft
