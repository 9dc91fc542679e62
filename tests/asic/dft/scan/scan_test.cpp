// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/scan.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/dft/scan/scan_grade.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "asic/dft/scan/scan_ways.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "base/error.hpp"
#include "tests/asic/dft/scan_machine.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Scan, ChainsAreBalancedAndHoldEveryFlop) {
  const ScanDesign& design = machine().design;
  ASSERT_EQ(design.chains.size(), 2u);
  const std::size_t a = design.chains[0].cells.size(), b = design.chains[1].cells.size();
  EXPECT_LE(a > b ? a - b : b - a, 1u);
  EXPECT_EQ(a + b, machine().view.flops.size());
  EXPECT_EQ(design.reset, "rst_ni");
  EXPECT_EQ(design.clock, "clk_i");
  const std::map<std::string, std::string> shifted = shifted_from(machine().plain, mini_library(), {});
  for (const Instance& instance : design.netlist.instances) {
    EXPECT_TRUE(!mini_library().at(instance.type).flop || mini_library().at(instance.type).scan ||
                shifted.count(instance.name) != 0)
        << instance.name;
  }
}

// The scanned netlist without its test ports, inputs at the given values. Nets keep their numbers.
Netlist tied(Netlist netlist, bool scan_enable) {
  std::map<Net, Net> constant;
  std::vector<Port> kept;
  for (const Port& port : netlist.ports) {
    const bool test = port.name == "scan_en_i" || port.name == "test_mode_i" || port.name == "scan_i";
    for (const Net bit : port.bits) {
      if (test) constant[bit] = port.name == "scan_en_i" && scan_enable ? 1 : 0;
    }
    if (!test && port.name != "scan_o") kept.push_back(port);
  }
  netlist.ports = std::move(kept);
  for (Instance& instance : netlist.instances) {
    for (auto& [pin, net] : instance.pins) {
      if (const auto found = constant.find(net); found != constant.end()) net = found->second;
    }
  }
  return netlist;
}
// Yosys' proof, flops matched by their nets' names.
bool equivalent(Netlist gold, Netlist gate) {
  const TestFolder folder;
  gold.top = "gold";
  gate.top = "gate";
  folder.file("gold.v", verilog_text(gold) + cell_models(gold, mini_library()));
  folder.file("gate.v", verilog_text(gate) + cell_models(gate, mini_library()));
  const std::string script =
      "cd " + folder.path().string() +
      " && yosys -q -p 'read_verilog gold.v; prep -flatten -top gold; async2sync; design -stash g;"
      " read_verilog gate.v; prep -flatten -top gate; async2sync; design -stash t;"
      " design -copy-from g -as gold gold; design -copy-from t -as gate gate; equiv_make gold gate equiv; "
      "prep -top equiv;"
      " equiv_simple -undef; equiv_induct -undef; equiv_status -assert' > log.txt 2>&1";
  return std::system(script.c_str()) == 0;
}

// With scan off the netlist is what it was, proved by Yosys; with scan on it is not.
TEST(Scan, DisabledScanHasNoEffect) {
  EXPECT_TRUE(equivalent(machine().plain, tied(machine().design.netlist, false)));
  EXPECT_FALSE(equivalent(machine().plain, tied(machine().design.netlist, true)));
}

TEST(Scan, ChainsAreTracedInEveryLibrary) {
  for (const char* name : {"machine", "gated"}) {
    const ScanDesign design = insert_scan(circuit_netlist(name), mini_library(), {.chains = 2});
    EXPECT_TRUE(same_chains(trace_chains(design.netlist, mini_library()), design.chains)) << name;
  }
  const ScanDesign gates = insert_scan(circuit_netlist("machine_gates"), yosys_library(), {.chains = 3});
  EXPECT_TRUE(same_chains(trace_chains(gates.netlist, yosys_library()), gates.chains));
}

// Every fault that counts as detected, by simulation or by implication, makes the file fail; one called
// untestable never does.
void check_verdicts(const Machine& m) {
  const auto reported = scan_classes(m.view, m.design, m.set.faults, m.set.of_class, m.stream);
  ASSERT_EQ(m.view.circuit.sites().size(), m.free_view.circuit.sites().size());
  std::size_t implied = 0, untestable = 0;
  for (std::size_t f = 0; f < reported.size(); ++f) {
    const Site& site = m.free_view.circuit.sites()[f / 2];
    ASSERT_EQ(site.name, m.view.circuit.sites()[f / 2].name);
    ReplayFault fault;
    if (site.node != kNoNode) {
      fault.line = Fault{site.node, site.pin, f % 2 != 0};
    } else {
      for (std::size_t k = 0; k < m.free_view.flops.size(); ++k) {
        if (site.name == m.free_view.flops[k].name + "/" +
                             m.cells.at(m.design.netlist.instances[m.free_view.flops[k].instance].type)
                                 .flop->clocked_on.pin)
          fault.dead_clock = k;
      }
      for (const Instance& gate : m.design.netlist.instances) {  // a dead gate: one of the flops behind it
        const auto& pins = m.cells.at(gate.type).gate;
        if (!pins || (site.name != gate.name + "/" + pins->clock && site.name != gate.name + "/" + pins->out))
          continue;
        for (std::size_t k = 0; k < m.free_view.flops.size(); ++k) {
          if (m.free_view.flops[k].clock == gate.pins.at(pins->out)) fault.dead_clock = k;
        }
      }
      ASSERT_TRUE(fault.dead_clock) << site.name;
    }
    if (site.name == "clk_i") continue;  // every flop at once; its pins are looked at one by one
    const auto by_fill = replay(m.free_view, m.stream, "", 3, fault).by_fill;
    const auto is_zero = [](std::size_t mismatches) { return mismatches == 0; };
    const bool fails = std::none_of(by_fill.begin(), by_fill.end(), is_zero),
               passes = std::all_of(by_fill.begin(), by_fill.end(), is_zero);
    const FaultClass c = reported[f];
    const bool detected = c == FaultClass::DS || c == FaultClass::DI;
    const bool none = c == FaultClass::UR || c == FaultClass::UT;
    EXPECT_TRUE(fails || !detected) << fault_name(m.view.circuit, f) << " " << to_string(c);
    EXPECT_TRUE(passes || !none) << fault_name(m.view.circuit, f);
    implied += c == FaultClass::DI ? 1 : 0;
    untestable += c == FaultClass::UR || c == FaultClass::UT || c == FaultClass::AU ? 1 : 0;
  }
  EXPECT_GT(implied, 20u);
  const Coverage result = coverage(m.set.faults, reported);
  EXPECT_EQ(m.set.aborted, 0u);
  EXPECT_GE(result.test_coverage(), 0.95);
}

TEST(Scan, EveryVerdictHoldsOnTheTester) { check_verdicts(machine()); }
TEST(Scan, EveryVerdictHoldsWithoutScanFlops) { check_verdicts(Machine("machine_gates", yosys_library())); }

TEST(Scan, EveryVerdictHoldsBehindClockGates) {
  check_verdicts(gated());
  const TestFolder folder;
  const ReplayResult result =
      replay_in_icarus(gated().design.netlist, mini_library(), gated().stream, folder.path());
  EXPECT_EQ(result.mismatches, 0u) << result.first;
  EXPECT_GT(result.strobes, 100u);
}

// A gate that stays closed in shift breaks the chain; one that is always open captures where it should hold.
TEST(Scan, ClockGatesMustOpenInShiftAlone) {
  for (const Net test : {Net{0}, Net{1}}) {
    Netlist wrong = gated().design.netlist;
    for (Instance& instance : wrong.instances) {
      if (instance.type == "CKGT") instance.pins["TE"] = test;
    }
    EXPECT_GT(replay(capture_view(wrong, mini_library()), gated().stream).mismatches, 0u) << test;
  }
}

std::size_t scan_cells(const ScanDesign& design, const CellLibrary& library) {
  return static_cast<std::size_t>(
      std::count_if(design.netlist.instances.begin(), design.netlist.instances.end(),
                    [&](const Instance& instance) { return library.at(instance.type).scan.has_value(); }));
}

// A flop that takes over another's state while shifting follows it in the chain as it is; of two behind one
// flop the first, of a ring all but one, and none behind an inverter or at a chain's beginning. Each verdict
// on a fault holds in the netlist with the fault, those that the chain test is to show among them.
TEST(Scan, FlopsThatShiftAnywayGetNoMultiplexer) {
  const Machine m("steered", mini_library());
  constexpr std::size_t kFlops = 14, kCopies = 4;
  ASSERT_EQ(m.view.flops.size(), kFlops);
  EXPECT_EQ(scan_cells(insert_scan(m.plain, m.cells, {.chains = 1}), m.cells), kFlops - kCopies - 2);
  EXPECT_EQ(scan_cells(insert_scan(m.plain, m.cells, {.chains = kFlops}), m.cells), kFlops);
  EXPECT_TRUE(same_chains(trace_chains(m.design.netlist, m.cells), m.design.chains));
  check_verdicts(m);
  Netlist unsteered = m.plain;  // the copy keeps its state while shifting
  for (Port& port : unsteered.ports) {
    if (port.name == "scan_en_i") port.name = "other_i";
  }
  EXPECT_EQ(scan_cells(insert_scan(unsteered, m.cells, {.chains = 1}), m.cells), kFlops - 2);
}

// Scan enable holds a line at 0 while chains shift, and the flop that the line reaches takes the chain then:
// stuck at 1 it disturbs nothing, and its capture counts whatever the rest of the file holds. Stuck so that
// the chain itself stands still it has to show in the file.
TEST(Scan, AFaultBehindMultiplexersThatShiftDisturbsNothing) {
  enum : Net { clock = 2, reset, enable, data, keep, shifts, take, next, state, end };
  Netlist plain;
  plain.file = "kept.json";
  plain.top = "kept";
  plain.ports = {{"clk_i", true, {clock}}, {"rst_ni", true, {reset}}, {"scan_en_i", true, {enable}},
                 {"data_i", true, {data}}, {"keep_i", true, {keep}},  {"state_o", false, {state}}};
  plain.instances = {{"not", "INV", {{"A", enable}, {"Y", shifts}}},
                     {"take", "AND2", {{"A", keep}, {"B", shifts}, {"Y", take}}},
                     {"next", "AND2", {{"A", data}, {"B", take}, {"Y", next}}},
                     {"state", "DFFR", {{"CK", clock}, {"D", next}, {"Q", state}, {"RN", reset}}}};
  plain.next_net = end;
  const ScanDesign design = insert_scan(plain, mini_library(), {.chains = 1});
  const CaptureView view = scan_view(design, mini_library());
  const FaultList list = collapse(view.circuit);
  const std::vector<FaultClass> captured(list.classes.size(), FaultClass::DS);
  CycleStream stream = expand(make_scan_test(design, view, {}, "kept"));
  for (TestCycle& cycle : stream.cycles) {
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      if (!stream.signals[s].is_input) cycle.states[s] = 'X';  // nothing shows anything
    }
  }
  const std::vector<FaultClass> reported = scan_classes(view, design, list, captured, stream);
  const auto class_of = [&](const std::string& name) {
    for (std::size_t f = 0; f < reported.size(); ++f) {
      if (fault_name(view.circuit, f) == name) return reported[f];
    }
    ADD_FAILURE() << name;
    return FaultClass::UT;
  };
  EXPECT_EQ(class_of("take/Y stuck-at-1"), FaultClass::DS);
  EXPECT_EQ(class_of("take/B stuck-at-1"), FaultClass::DS);
  EXPECT_EQ(class_of("next/B stuck-at-1"), FaultClass::DS);
  EXPECT_EQ(class_of("scan_en_i stuck-at-0"), FaultClass::NO);
  EXPECT_EQ(class_of("state/SI stuck-at-1"), FaultClass::NO);
  EXPECT_EQ(class_of("state/Q stuck-at-1"), FaultClass::NO);
}

TEST(Scan, PortsAndBypassOfTheNetlistAreUsed) {
  const ScanDesign& design = gated().design;
  EXPECT_EQ(design.netlist.ports.size(), gated().plain.ports.size());
  EXPECT_EQ(design.reset, "rst_ni");
  ASSERT_EQ(design.chains.size(), 2u);
  EXPECT_EQ(design.chains[1].in, "scan_i[1]");
  EXPECT_EQ(design.chains[1].out, "scan_o[1]");
  for (const Instance& instance : design.netlist.instances)
    EXPECT_EQ(instance.name.find("dft_reset"), std::string::npos) << instance.name;
  // without the RTL's bypass there is one
  Netlist without = gated().plain;
  for (Port& port : without.ports) {
    if (port.name == "test_mode_i") port.name = "other_i";
  }
  const Netlist bypassed = insert_scan(without, mini_library()).netlist;
  EXPECT_TRUE(std::any_of(bypassed.instances.begin(), bypassed.instances.end(),
                          [](const Instance& i) { return i.name == "dft_reset_bypass0"; }));
  Netlist driven = gated().plain;
  for (Port& port : driven.ports) {
    if (port.name != "scan_o") continue;
    for (const Instance& instance : driven.instances) {
      if (instance.type == "DFFR") port.bits[0] = instance.pins.at("Q");
    }
  }
  EXPECT_THAT([&] { insert_scan(driven, mini_library()); },
              ThrowsMessage<UserError>(HasSubstr("found logic that drives scan_o[0]")));
  // synthesis puts a buffer behind a constant output
  Netlist buffered = gated().plain;
  constexpr Net kBuffered = 999999;
  for (Port& port : buffered.ports) {
    if (port.name == "scan_o") port.bits[0] = kBuffered;
  }
  buffered.instances.push_back({"constant_output", "BUF", {{"A", 0}, {"Y", kBuffered}}});
  EXPECT_EQ(insert_scan(buffered, mini_library()).chains.size(), 2u);
  Netlist narrow = gated().plain;
  for (Port& port : narrow.ports) {
    if (port.name == "scan_o") port.bits.pop_back();
  }
  EXPECT_THAT(
      [&] { insert_scan(narrow, mini_library()); },
      ThrowsMessage<UserError>(HasSubstr("found scan_i of 2 bits and scan_o of 1, expected one width")));
}

// Twenty defects in the netlist, another cell or crossed wires: the file fails on each that changes what scan
// can see.
TEST(Scan, SeededNetlistDefectsAreCaught) {
  const std::map<std::string, std::string> other = {
      {"AND2", "OR2"},    {"OR2", "AND2"},    {"NAND2", "NOR2"}, {"NOR2", "NAND2"},
      {"XOR2", "XNOR2"},  {"XNOR2", "XOR2"},  {"INV", "BUF"},    {"AOI21", "OAI21"},
      {"OAI21", "AOI21"}, {"SDFFR", "SDFFS"}, {"SDFFS", "SDFFR"}};
  std::size_t seeded = 0;
  for (std::size_t i = 0; i < machine().design.netlist.instances.size(); ++i) {
    Netlist wrong = machine().design.netlist;
    Instance& instance = wrong.instances[i];
    const auto change = other.find(instance.type);
    if (change == other.end()) continue;
    instance.type = change->second;
    if (instance.pins.count("RN") != 0 && change->second == "SDFFS")
      instance.pins["SN"] = instance.pins["RN"], instance.pins.erase("RN");
    if (instance.pins.count("SN") != 0 && change->second == "SDFFR")
      instance.pins["RN"] = instance.pins["SN"], instance.pins.erase("SN");
    const CaptureView view = capture_view(wrong, mini_library());
    EXPECT_NE(replay(view, machine().stream).mismatches, 0u) << instance.name << " became " << instance.type;
    ++seeded;
  }
  EXPECT_GE(seeded, 20u);
}

TEST(Scan, RulesNameTheOffender) {
  const auto rules_of = [](Netlist netlist) {
    std::string all;
    for (const RuleViolation& v : check_rules(netlist, mini_library()))
      all += v.rule + ":" + v.offender + "; ";
    return all;
  };
  const Netlist good = machine().design.netlist;
  EXPECT_EQ(rules_of(good).find("clock"), std::string::npos);

  Netlist open_port = good;
  open_port.ports.push_back({"nowhere_o", false, {kUnknownNet}});
  EXPECT_NE(rules_of(open_port).find("X source:port nowhere_o; "), std::string::npos);

  const auto flop = [](Netlist& netlist) -> Instance& {
    for (Instance& instance : netlist.instances) {
      if (mini_library().at(instance.type).flop) return instance;
    }
    throw std::logic_error("no flop");
  };
  const auto gate_output = [](const Netlist& netlist) {
    for (const Instance& instance : netlist.instances) {
      if (instance.type == "NAND2" || instance.type == "NOR2" || instance.type == "MUX2")
        return instance.pins.at("Y");
    }
    throw std::logic_error("no gate");
  };
  Netlist clock = good;
  flop(clock).pins["CK"] = gate_output(clock);
  EXPECT_THAT(rules_of(clock), HasSubstr("uncontrollable clock:" + flop(clock).name));
  EXPECT_THAT([&] { capture_view(clock, mini_library()); },
              ThrowsMessage<UserError>(HasSubstr("driven by logic")));
  Netlist plain_clock = machine().plain;
  flop(plain_clock).pins["CK"] = gate_output(plain_clock);
  EXPECT_THAT(
      [&] { insert_scan(plain_clock, mini_library()); },
      ThrowsMessage<UserError>(HasSubstr("cell " + flop(plain_clock).name + ": found a clock from logic")));
  EXPECT_THAT(rules_of(machine().plain), HasSubstr("uncontrollable reset:"));
  Netlist no_reset = machine().plain;
  flop(no_reset).pins.erase(flop(no_reset).pins.count("RN") != 0 ? "RN" : "SN");
  flop(no_reset).type = "DFF";
  EXPECT_THAT(rules_of(no_reset), HasSubstr("no reset:" + flop(no_reset).name));
  Netlist open = machine().plain;
  flop(open).pins["D"] = 999999;
  EXPECT_THAT(rules_of(open), HasSubstr("X source:" + flop(open).name + "/D"));
  Netlist odd = machine().plain;
  flop(odd).type = "NONE";
  EXPECT_THAT(rules_of(odd), HasSubstr("unknown cell:"));
  EXPECT_EQ(rules_of(gated().design.netlist), "");
  EXPECT_THAT(rules_of(gated().plain), HasSubstr("closed clock gate:u_sum"));
  EXPECT_EQ(rules_of(gated().plain).find("reset"), std::string::npos);
  Netlist two = machine().plain;
  two.ports.push_back({"clk2_i", true, {two.next_net}});
  flop(two).pins["CK"] = two.next_net++;
  EXPECT_THAT(rules_of(two), HasSubstr("several clocks:"));
}

}  // namespace
}  // namespace meltstage::dft
