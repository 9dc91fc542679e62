// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/functional.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <set>

#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/places.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/grade_file.hpp"
#include "base/error.hpp"
#include "tests/asic/dft/serial.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

// So many clocks with these values at the input ports.
struct Stretch {
  std::uint64_t clocks = 1;
  std::vector<std::uint8_t> inputs;
};

// Random inputs, reset first and once more in the middle.
std::vector<Stretch> stimulus(const CaptureView& view, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Stretch> stretches;
  for (std::size_t i = 0; i < count; ++i) {
    Stretch stretch{1 + random() % 3, {}};
    for (const std::string& port : view.input_ports) {
      const bool reset = i == 0 || i == count / 2;
      stretch.inputs.push_back(port == "rst_ni" ? !reset : static_cast<std::uint8_t>(random() & 1));
    }
    stretches.push_back(stretch);
  }
  return stretches;
}

// The definition, for faults that no reset reads: one machine, every gate, clock by clock.
class OneMachine {
 public:
  OneMachine(const CaptureView& view, const Fault* fault)
      : view_(view), fault_(fault), pattern_(view.circuit.inputs().size(), 0) {}

  void set_inputs(const std::vector<std::uint8_t>& inputs) {
    std::copy(inputs.begin(), inputs.end(), pattern_.begin());
    settle();
  }
  std::vector<bool> clock() {
    for (std::size_t k = 0; k < view_.flops.size(); ++k) {
      const Node next = view_.circuit.outputs()[view_.output_ports.size() + k];
      captured_.push_back(values_[next]);
    }
    for (std::size_t k = 0; k < view_.flops.size(); ++k)
      pattern_[view_.input_ports.size() + k] = captured_[k];
    captured_.clear();
    settle();
    return outputs();
  }
  const Pattern& pattern() const { return pattern_; }
  std::vector<bool> outputs() const {
    std::vector<bool> ports;
    for (std::size_t i = 0; i < view_.output_ports.size(); ++i)
      ports.push_back(values_[view_.circuit.outputs()[i]]);
    return ports;
  }

 private:
  void settle() {
    for (bool again = true; again;) {
      again = false;
      values_ = serial_values(view_.circuit, pattern_, fault_);
      for (std::size_t k = 0; k < view_.flops.size(); ++k) {
        const ScanFlop& flop = view_.flops[k];
        std::uint8_t& state = pattern_[view_.input_ports.size() + k];
        if (!flop.has_reset || values_[view_.node_of_net.at(flop.reset)] == flop.reset_low ||
            state == (flop.reset_value ? 1 : 0))
          continue;
        state = flop.reset_value ? 1 : 0;
        again = true;
      }
    }
  }

  const CaptureView& view_;
  const Fault* fault_;
  Pattern pattern_;
  std::vector<bool> values_;
  std::vector<std::uint8_t> captured_;
};

// What one machine shows before each clock, as a stream.
CycleStream shown(const CaptureView& view, const std::vector<Stretch>& stretches) {
  CycleStream stream;
  stream.title = "machine";
  for (const std::string& port : view.input_ports) stream.signals.push_back({port, true});
  for (const std::string& port : view.output_ports) stream.signals.push_back({port, false});
  OneMachine good(view, nullptr);
  for (const Stretch& part : stretches) {
    good.set_inputs(part.inputs);
    std::string driven;
    for (std::size_t i = 0; i < part.inputs.size(); ++i)
      driven += view.clock_ports[i] != 0 ? 'P' : part.inputs[i] != 0 ? '1' : '0';
    for (std::uint64_t c = 0; c < part.clocks; ++c) {
      std::string states = driven;
      for (const bool level : good.outputs()) states += level ? 'H' : 'L';
      const Pattern before = good.pattern();
      good.clock();
      const bool still = before == good.pattern();  // and stays so
      stream.cycles.push_back({states, "", still ? part.clocks - c : 1});
      if (still) break;
    }
  }
  return stream;
}
CycleStream shown(const CaptureView& view) { return unrolled(shown(view, stimulus(view, 60, 2))); }

std::uint64_t first_failure(const CaptureView& view, const CycleStream& stream, const Fault& fault) {
  OneMachine bad(view, &fault);
  const std::size_t inputs = view.input_ports.size();
  std::uint64_t number = 0;
  for (const TestCycle& cycle : stream.cycles) {
    std::vector<std::uint8_t> driven;
    for (std::size_t i = 0; i < inputs; ++i) driven.push_back(cycle.states[i] == '1' ? 1 : 0);
    bad.set_inputs(driven);
    for (std::uint64_t c = 0; c < cycle.count; ++c, ++number) {
      const std::vector<bool> levels = bad.outputs();
      for (std::size_t i = 0; i < levels.size(); ++i) {
        if (cycle.states[inputs + i] == (levels[i] ? 'L' : 'H')) return number;
      }
      if (cycle.states.find('P') != std::string::npos) bad.clock();
    }
  }
  return FunctionalGrade::kUndetected;
}

bool reads_reset(const CaptureView& view, const Fault& fault) {
  if (fault.pin == kStem) return false;
  const Node line = view.circuit.fanin(fault.node)[static_cast<std::size_t>(fault.pin)];
  return std::any_of(view.flops.begin(), view.flops.end(), [&](const ScanFlop& flop) {
    return flop.has_reset && view.node_of_net.at(flop.reset) == line;
  });
}

TEST(Functional, AgreesWithOneMachineAtATime) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  std::vector<Fault> faults;
  for (const Fault& fault : collapse(view.circuit).classes) {
    if (!reads_reset(view, fault)) faults.push_back(fault);
  }
  const CycleStream stream = shown(view, stimulus(view, 60, 1));
  const FunctionalGrade grade = grade_functional(view, stream, faults, 2);
  for (std::size_t i = 0; i < faults.size(); ++i)
    EXPECT_EQ(grade.first_cycle[i], first_failure(view, stream, faults[i]))
        << view.circuit.name(faults[i].node) << " pin " << faults[i].pin << " stuck at " << faults[i].stuck;
  EXPECT_GT(grade.detected(), faults.size() / 2);
  EXPECT_LT(grade.detected(), faults.size());
}

// The same with most strobes masked and some cycles without a clock: what the file doesn't compare shows
// nothing.
TEST(Functional, OnlyStrobesOfTheFileDetect) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  std::vector<Fault> faults;
  for (const Fault& fault : collapse(view.circuit).classes) {
    if (!reads_reset(view, fault)) faults.push_back(fault);
  }
  CycleStream stream;
  {
    std::mt19937_64 random(5);
    std::vector<Stretch> stretches = stimulus(view, 60, 1);
    for (Stretch& stretch : stretches) stretch.clocks = 1;
    stream = shown(view, stretches);
    std::vector<TestCycle> with_rests;
    for (const TestCycle& cycle : stream.cycles) {
      TestCycle rest = cycle;  // the same before its clock
      std::replace(rest.states.begin(), rest.states.end(), 'P', '0');
      if (random() % 2 == 0) with_rests.push_back(rest);
      with_rests.push_back(cycle);
    }
    stream.cycles = std::move(with_rests);
    for (TestCycle& cycle : stream.cycles) {
      for (std::size_t s = view.input_ports.size(); s < cycle.states.size(); ++s) {
        if (random() % 8 != 0) cycle.states[s] = 'X';
      }
    }
  }
  const FunctionalGrade grade = grade_functional(view, stream, faults, 2);
  EXPECT_EQ(grade.wrong, "");
  std::size_t detected = 0;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    EXPECT_EQ(grade.first_cycle[i], first_failure(view, stream, faults[i])) << i;
    detected += grade.first_cycle[i] != FunctionalGrade::kUndetected ? 1 : 0;
  }
  EXPECT_GT(detected, 0u);
  CycleStream masked = stream;
  for (TestCycle& cycle : masked.cycles)
    std::fill(cycle.states.begin() + static_cast<std::ptrdiff_t>(view.input_ports.size()), cycle.states.end(),
              'X');
  EXPECT_EQ(grade_functional(view, masked, faults, 2).detected(), 0u);
  CycleStream turned = stream;
  std::size_t at = 0;
  while (turned.cycles[at].states.find('H') == std::string::npos) ++at;
  turned.cycles[at].states[turned.cycles[at].states.find('H')] = 'L';
  EXPECT_EQ(grade_functional(view, turned, faults, 2).wrong.substr(0, 6), "cycle ");
}

// A flop whose reset pin is stuck inactive keeps what it had.
TEST(Functional, AStuckResetPinIsSeen) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  std::vector<Fault> faults;
  for (const Site& site : view.circuit.sites()) {
    const Fault fault{site.node, site.pin, true};
    if (site.node != kNoNode && reads_reset(view, fault)) faults.push_back(fault);
  }
  ASSERT_FALSE(faults.empty());
  std::size_t detected = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    detected = std::max(detected,
                        grade_functional(view, shown(view, stimulus(view, 400, seed)), faults, 2).detected());
  EXPECT_GT(detected, 0u);
}

// Undetected machines move on in fewer batches: three copies of each fault fare as the one by itself does.
TEST(Functional, MachinesThatMoveOnStayTheSame) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  const std::vector<Fault> once = collapse(view.circuit).classes;
  std::vector<Fault> many;
  while (many.size() < 1100) many.insert(many.end(), once.begin(), once.end());
  std::vector<Stretch> stretches = stimulus(view, 20, 1);  // a few fall, then nothing moves for long
  stretches.back().clocks = 150'000;
  const auto rest = stimulus(view, 400, 2);
  stretches.insert(stretches.end(), rest.begin() + 1, rest.end());
  const CycleStream stream = shown(view, stretches);
  const FunctionalGrade alone = grade_functional(view, stream, once, 1),
                        together = grade_functional(view, stream, many, 2);
  std::size_t early = 0, late = 0;
  for (std::size_t i = 0; i < many.size(); ++i) {
    const std::uint64_t first = alone.first_cycle[i % once.size()];
    EXPECT_EQ(together.first_cycle[i], first);
    (first < 60 ? early : late) += first == FunctionalGrade::kUndetected ? 0 : 1;
  }
  EXPECT_GT(early, many.size() / 3);
  EXPECT_GT(late, 0u);
  EXPECT_EQ(together.toggle.toggled, alone.toggle.toggled);
  EXPECT_EQ(together.set_aside, 0u);
}

TEST(Functional, LinesAreToldByTheirFlops) {
  const Netlist netlist = circuit_netlist("machine");
  const CaptureView view = capture_view(netlist, mini_library());
  const std::vector<std::string> places = places_of(netlist, view);
  std::set<std::string> known(view.output_ports.begin(), view.output_ports.end());
  for (std::size_t k = 0; k < view.flops.size(); ++k)
    known.insert(places[view.circuit.inputs()[view.input_ports.size() + k]]);
  EXPECT_EQ(known.count(""), 0u);
  EXPECT_EQ(known.size(), view.output_ports.size() + view.flops.size());
  for (const Site& site : view.circuit.sites()) {
    if (site.node == kNoNode) continue;
    const bool leads_nowhere = view.circuit.fanout(site.node).empty() && site.pin == kStem;  // the clock port
    EXPECT_EQ(known.count(places[site.node]), leads_nowhere ? 0u : 1u) << site.name;
  }
  EXPECT_EQ(module_of("u_guard.wd_q[3]"), "u_guard");
  EXPECT_EQ(module_of("u_uartc.u_frame.words_q[14][3]"), "u_uartc.u_frame");
  EXPECT_EQ(module_of("heater_o"), "(top)");
}

// What is called still never moves; with all flops held nothing behind them does.
TEST(Functional, StillLinesDontMove) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  const std::vector<std::int8_t> still = still_after_reset(view),
                                 held = still_after_reset(
                                     view, std::vector<std::uint8_t>(view.circuit.inputs().size(), 1));
  const FunctionalGrade grade = grade_functional(view, shown(view, stimulus(view, 400, 1)), {}, 1);
  for (const Node node : grade.toggle.moving) EXPECT_EQ(still[node], -1);
  std::size_t of_flops = 0;
  for (std::size_t k = 0; k < view.flops.size(); ++k) {
    const Node state = view.circuit.inputs()[view.input_ports.size() + k];
    if (!view.flops[k].has_reset) continue;
    EXPECT_EQ(held[state], view.flops[k].reset_value ? 1 : 0);
    ++of_flops;
  }
  EXPECT_GT(of_flops, 0u);
}

// A fault of a line that leads to one flop alone changes nothing but that flop's next state.
TEST(Functional, LinesThatLeadToOneFlopChangeNoOther) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  const std::size_t ports = view.output_ports.size();
  std::size_t found = 0;
  for (std::size_t k = 0; k < view.flops.size(); ++k) {
    std::vector<std::uint8_t> unseen(view.circuit.outputs().size(), 0);
    unseen[ports + k] = 1;
    const std::vector<std::uint8_t> only = leads_only_to(view, unseen);
    std::mt19937_64 random(k);
    for (const Site& site : view.circuit.sites()) {
      if (site.node == kNoNode || site.pin != kStem || only[site.node] == 0 ||
          view.circuit.fanout(site.node).empty())
        continue;
      ++found;
      for (unsigned i = 0; i < 20; ++i) {
        std::vector<std::uint8_t> pattern(view.circuit.inputs().size());
        for (std::uint8_t& level : pattern) level = static_cast<std::uint8_t>(random() & 1);
        const Fault fault{site.node, kStem, (random() & 1) != 0};
        const auto good = serial_values(view.circuit, pattern, nullptr),
                   bad = serial_values(view.circuit, pattern, &fault);
        for (std::size_t o = 0; o < unseen.size(); ++o) {
          if (unseen[o] != 0) continue;
          EXPECT_EQ(good[view.circuit.outputs()[o]], bad[view.circuit.outputs()[o]]);
        }
      }
    }
  }
  EXPECT_GT(found, 0u);
}

TEST(Functional, VectorsThatDoNothingDetectAndToggleLittle) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  const std::vector<Fault> faults = collapse(view.circuit).classes;
  const CycleStream idle = shown(view, {{100, std::vector<std::uint8_t>(view.input_ports.size(), 0)}});
  const CycleStream busy = shown(view, stimulus(view, 400, 1));
  const FunctionalGrade little = grade_functional(view, idle, faults, 2),
                        much = grade_functional(view, busy, faults, 2);
  EXPECT_LT(2 * little.detected(), much.detected());
  const ToggleCoverage &none = little.toggle, &most = much.toggle;
  EXPECT_EQ(most.lines, none.lines);
  EXPECT_EQ(most.lines, most.toggled + most.idle.size());
  EXPECT_LT(none.toggled, most.toggled);
  EXPECT_EQ(grade_functional(view, busy, {}, 2).toggle.toggled,
            most.toggled);  // no fault touches the good machine
}

// One turned bit is one mismatch, however many power-up states show it.
TEST(Functional, ReplayComparesEveryClock) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  CycleStream stream = shown(view);
  const ReplayResult right = replay_cycles(view, stream, 10);
  EXPECT_EQ(right.cycles, stream.cycles.size());
  EXPECT_EQ(right.strobes, stream.cycles.size() * view.output_ports.size());
  EXPECT_EQ(right.mismatches, 0u) << right.first;
  char& state = stream.cycles[17].states[view.input_ports.size() + 1];
  state = state == 'H' ? 'L' : 'H';
  const ReplayResult wrong = replay_cycles(view, stream, 10);
  EXPECT_EQ(wrong.mismatches, 1u);
  EXPECT_EQ(wrong.first.substr(0, 9), "cycle 17:");
}

// y = q | e with e open: all 0 would have passed.
TEST(Functional, AStrobeThatHangsOnAnOpenInputIsAMismatch) {
  const CaptureView view =
      plain_view(bench_circuit("INPUT(a)\nINPUT(b)\nOUTPUT(y)\nOUTPUT(z)\ny = OR(a, b)\nz = AND(a, b)\n"));
  const auto patterns = [](const std::string& vectors) {
    return parse_stil(
        "STIL 1.0; Signals { a In; b In; y Out; z Out; }\nTiming { WaveformTable t { Period '100ns'; "
        "Waveforms { a { 01N { '0ns' D/U/Z; } } b { 01N { '0ns' D/U/Z; } }\n"
        "y { LHX { '40ns' L/H/X; } } z { LHX { '40ns' L/H/X; } } } } }\n"
        "PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }\nPattern main { W t; " +
            vectors + " }",
        "a.stil");
  };
  EXPECT_EQ(
      replay_cycles(view, patterns("V { a=1; b=N; y=H; z=X; } V { a=0; b=N; y=X; z=L; }"), 10).mismatches,
      0u);
  EXPECT_EQ(replay_cycles(view, patterns("V { a=0; b=N; y=L; z=X; }"), 10).mismatches, 1u);
  EXPECT_EQ(replay_cycles(view, patterns("V { a=N; b=N; y=X; z=L; }"), 10).mismatches, 1u);
  EXPECT_EQ(replay_cycles(view, patterns("Loop 20 { V { a=1; b=N; y=X; z=H; } }"), 10).mismatches, 20u);
}

// Without flops every power-up state is the same one, and fails with every other.
TEST(Functional, AStrobeThatFailsIsOneMismatch) {
  const CaptureView view = plain_view(bench_circuit("INPUT(a)\nINPUT(b)\nOUTPUT(y)\ny = AND(a, b)\n"));
  const CycleStream stream = parse_stil(R"(STIL 1.0; Signals { a In; b In; y Out; }
Timing { WaveformTable t { Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } b { 01 { '0ns' D/U; } }
  y { LHX { '40ns' L/H/X; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Pattern main { W t; V { a=1; b=1; y=H; } V { a=1; b=0; y=H; } })",
                                        "a.stil");
  const ReplayResult result = replay_cycles(view, stream, 10);
  EXPECT_EQ(result.strobes, 2u);
  EXPECT_EQ(result.mismatches, 1u);
  EXPECT_THAT(result.first, testing::StartsWith("cycle 1: y: found 0, expected H"));
}

TEST(Functional, CountedCyclesAreTheSame) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  CycleStream stream = shown(view);
  stream.cycles.resize(40);
  CycleStream counted = stream;
  counted.cycles.clear();
  for (const TestCycle& cycle : stream.cycles) {
    if (!counted.cycles.empty() && counted.cycles.back().states == cycle.states)
      ++counted.cycles.back().count;
    else
      counted.cycles.push_back(cycle);
  }
  ASSERT_LT(counted.cycles.size(), stream.cycles.size());
  EXPECT_TRUE(same_cycles(stream, counted));
  EXPECT_TRUE(same_cycles(counted, unrolled(counted)));
  EXPECT_EQ(replay_cycles(view, counted).strobes, replay_cycles(view, stream).strobes);
  EXPECT_EQ(replay_cycles(view, counted).mismatches, 0u);
  counted.cycles.back().states[0] ^= 1;
  EXPECT_FALSE(same_cycles(stream, counted));
}

// Every path of every gate takes so long; as OpenSTA writes it, least and longest alone.
void write_delays(const Netlist& netlist, const CellLibrary& library, double ns,
                  const std::filesystem::path& folder) {
  std::string sdf = "(DELAYFILE (SDFVERSION \"3.0\") (TIMESCALE 1ns)\n",
              models = cell_models(netlist, library);
  std::set<std::string> known;
  for (const Instance& instance : netlist.instances) {
    const Cell& cell = library.at(instance.type);
    if (cell.flop) continue;
    std::string paths, delays;
    for (const CellPin& out : cell.pins) {
      for (const CellPin& in : cell.pins) {
        if (!out.is_output || in.is_output) continue;
        paths += fmt::format("    ({} => {}) = 0;\n", in.name, out.name);
        delays += fmt::format(" (IOPATH {} {} ({}::{}) ({}::{}))", in.name, out.name, ns, ns, ns, ns);
      }
    }
    std::string name;
    for (const char c : instance.name)
      name += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' ? std::string(1, c)
                                                                           : std::string("\\") + c;
    sdf += fmt::format("(CELL (CELLTYPE \"{}\") (INSTANCE {}) (DELAY (ABSOLUTE{})))\n", instance.type, name,
                       delays);
    if (!known.insert(instance.type).second) continue;
    const std::size_t module = models.find("module \\" + instance.type + " ");
    ASSERT_NE(module, std::string::npos);
    models.insert(models.find("endmodule", module), "  specify\n" + paths + "  endspecify\n");
  }
  std::ofstream(folder / "delays.sdf") << sdf << ")\n";
  std::ofstream(folder / "delayed_cells.v") << models;
}

// With delays in Icarus the strobes hold as long as the longest path ends before them.
TEST(Functional, DelaysDecideInIcarus) {
  const Netlist netlist = circuit_netlist("machine");
  const CaptureView view = capture_view(netlist, mini_library());
  const CycleStream stream = shown(view);
  const std::filesystem::path work = std::filesystem::path(testing::TempDir()) / "delays";
  std::filesystem::create_directories(work);
  const auto replayed = [&](double ns) {
    write_delays(netlist, mini_library(), ns, work);
    return replay_in_icarus(netlist, mini_library(), stream, work,
                            {work / "delayed_cells.v", work / "delays.sdf"});
  };
  const ReplayResult fast = replayed(0.1);
  EXPECT_EQ(fast.strobes, stream.cycles.size() * view.output_ports.size());
  EXPECT_EQ(fast.mismatches, 0u) << fast.first;
  EXPECT_NE(replayed(45).mismatches, 0u);
  std::ofstream(work / "delays.sdf", std::ios::app)
      << "(CELL (INSTANCE)\n (DELAY (ABSOLUTE\n  (INTERCONNECT a b/A (1::1) (1::1)))))\n";
  EXPECT_THAT(
      [&] {
        replay_in_icarus(netlist, mini_library(), stream, work,
                         {work / "delayed_cells.v", work / "delays.sdf"});
      },
      testing::ThrowsMessage<UserError>(testing::HasSubstr("found INTERCONNECT")));
}

// A net at two pins of a cell: Icarus would know one delay path for both.
TEST(Functional, DelaysOfANetAtTwoPinsAreFound) {
  Netlist netlist = circuit_netlist("machine");
  const auto gate = std::find_if(
      netlist.instances.begin(), netlist.instances.end(),
      [](const Instance& each) { return each.pins.count("A") != 0 && each.pins.count("B") != 0; });
  ASSERT_NE(gate, netlist.instances.end());
  gate->pins["B"] = gate->pins["A"];
  const CaptureView view = capture_view(netlist, mini_library());
  const std::filesystem::path work = std::filesystem::path(testing::TempDir()) / "two_pins";
  std::filesystem::create_directories(work);
  write_delays(netlist, mini_library(), 0.1, work);
  const CycleStream stream = shown(view);
  const ReplayResult result = replay_in_icarus(netlist, mini_library(), stream, work,
                                               {work / "delayed_cells.v", work / "delays.sdf"});
  EXPECT_EQ(result.strobes, stream.cycles.size() * view.output_ports.size());
  EXPECT_EQ(result.mismatches, 0u) << result.first;
}

// Without its reset the machine's first strobes hang on the power-up state.
TEST(Functional, StrobesOfUnknownStatesAreFound) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  CycleStream stream = shown(view);
  const auto reset = static_cast<std::size_t>(
      std::find(view.input_ports.begin(), view.input_ports.end(), "rst_ni") - view.input_ports.begin());
  for (TestCycle& cycle : stream.cycles) cycle.states[reset] = '1';
  EXPECT_NE(replay_cycles(view, stream, 10).mismatches, 0u);
}

}  // namespace
}  // namespace meltstage::dft
