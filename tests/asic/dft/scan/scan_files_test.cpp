// SPDX-License-Identifier: Apache-2.0
// Test files of scan designs, as written and read back: on the netlist, in Icarus, graded.
#include <gmock/gmock.h>

#include <algorithm>

#include "asic/dft/atpg/functional.hpp"
#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/files/formats.hpp"
#include "asic/dft/files/pattern_files.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/dft/scan/scan.hpp"
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

// A clock that rises with the data, and a pulse of another port, are none of a cycle's.
TEST(Scan, ClocksPulseAndNothingElseDoes) {
  const auto with = [](const std::string& signal, char state) {
    CycleStream stream = machine().stream;
    const auto s = std::find(stream.signals.begin(), stream.signals.end(), TestSignal{signal, true});
    EXPECT_TRUE(s != stream.signals.end()) << signal;
    stream.cycles[5].states[static_cast<std::size_t>(s - stream.signals.begin())] = state;
    return stream;
  };
  const std::pair<CycleStream, const char*> wrong[] = {
      {with("clk_i", '1'), "found 1 of the clock clk_i in cycle 5, expected 0 or a pulse"},
      {with("clk_i", 'N'), "found N of the clock clk_i in cycle 5"},
      {with("rst_ni", 'P'), "found a pulse of rst_ni in cycle 5, which clocks no flop"},
      {with("scan_i[0]", 'P'), "found a pulse of scan_i[0] in cycle 5"}};
  for (const auto& [stream, said] : wrong) {
    EXPECT_THAT([&] { replay(machine().free_view, stream, "scan_en_i"); },
                ThrowsMessage<UserError>(HasSubstr(said)));
    EXPECT_THAT([&] { replay_cycles(machine().free_view, stream); },
                ThrowsMessage<UserError>(HasSubstr(said)));
    EXPECT_THAT([&] { grade_functional(machine().free_view, stream, {}, 1); },
                ThrowsMessage<UserError>(HasSubstr(said)));
  }
}

TEST(Scan, FileAsWrittenRunsOnTheNetlist) {
  EXPECT_TRUE(same_cycles(machine().stream, expand(machine().test)));
  const ReplayResult whole = replay(machine().free_view, machine().stream),
                     pieces = replay(machine().free_view, machine().stream, "scan_en_i");
  EXPECT_EQ(whole.mismatches, 0u) << whole.first;
  EXPECT_EQ(pieces.mismatches, 0u) << pieces.first;
  EXPECT_GT(whole.strobes, 100u);
  EXPECT_EQ(whole.strobes, pieces.strobes);  // no strobe is lost between pieces
}

std::size_t position(const CycleStream& stream, const std::string& signal) {
  const auto found = std::find_if(stream.signals.begin(), stream.signals.end(),
                                  [&](const TestSignal& s) { return s.name == signal; });
  return static_cast<std::size_t>(found - stream.signals.begin());
}

// Strobes of the first unload, which the file masks: without a reset before, each hangs on the power-up state
// and is found by fills 0 and 1, whatever it expects; behind the reset it shows the cell's reset value.
TEST(Scan, StrobesThatHangOnThePowerUpStateAreFound) {
  const Machine& m = machine();
  const std::size_t cells = m.view.flops.size(), enable = position(m.stream, "scan_en_i");
  const auto replayed = [&](char expected, bool in_reset) {
    CycleStream stream = m.stream;
    std::string& first = stream.cycles[0].states;
    if (!in_reset) {
      first[position(stream, "rst_ni")] = '1';
      first[position(stream, "clk_i")] = '0';
    }
    for (const ScanChain& chain : stream.chains) {
      std::size_t left = chain.cells.size();
      for (auto cycle = stream.cycles.begin(); left != 0; ++cycle) {
        if (cycle->states[enable] != '1' || cycle->states.find('P') == std::string::npos) continue;
        cycle->states[position(stream, chain.out)] = expected;
        --left;
      }
    }
    return replay(m.free_view, stream, "scan_en_i");
  };
  const ReplayResult low = replayed('L', false), high = replayed('H', false);
  EXPECT_EQ(low.mismatches, cells);
  EXPECT_EQ(low.by_fill[0], 0u);
  EXPECT_EQ(low.by_fill[1], cells);
  EXPECT_EQ(high.mismatches, cells);
  EXPECT_EQ(high.by_fill[0], cells);
  EXPECT_EQ(high.by_fill[1], 0u);
  for (std::size_t fill = 2; fill < kFills; ++fill)
    EXPECT_EQ(low.by_fill[fill] + high.by_fill[fill], cells) << fill;
  EXPECT_THAT(low.first, HasSubstr("found what hangs on an unknown, expected L"));
  EXPECT_EQ(replayed('L', true).mismatches + replayed('H', true).mismatches, cells);
}

// An input that the file leaves open, a port or a cell that isn't loaded: each fill is as if the file had its
// values there.
TEST(Scan, StrobesThatHangOnOpenInputsAreFound) {
  const Machine& m = machine();
  const std::size_t enable = position(m.stream, "scan_en_i");
  const auto replayed = [&](const std::string& signal, bool shifting, char value) {
    CycleStream stream = m.stream;
    for (TestCycle& cycle : stream.cycles) {
      if ((cycle.states[enable] == '1') == shifting) cycle.states[position(stream, signal)] = value;
    }
    return replay(m.free_view, stream, "scan_en_i");
  };
  for (const auto& [signal, shifting] : {std::pair{"start_i", false}, {"scan_i[0]", true}}) {
    const ReplayResult open = replayed(signal, shifting, 'N'), low = replayed(signal, shifting, '0'),
                       high = replayed(signal, shifting, '1');
    EXPECT_GT(low.mismatches, 0u) << signal;
    EXPECT_GT(high.mismatches, 0u) << signal;
    EXPECT_EQ(open.by_fill[0], low.mismatches) << signal;
    EXPECT_EQ(open.by_fill[1], high.mismatches) << signal;
    EXPECT_GT(open.mismatches, std::max(low.mismatches, high.mismatches)) << signal;
    EXPECT_NE(open.by_fill[2], open.by_fill[3]) << signal;
  }
  // where nothing hangs on it, nothing fails
  EXPECT_EQ(replayed("scan_i[0]", false, 'N').mismatches, 0u);
  EXPECT_THAT([&] { replayed("clk_i", true, 'N'); },
              ThrowsMessage<UserError>(HasSubstr("found N of the clock clk_i in cycle")));
}

// Transition tests as a file: two clocks a pattern, read back and run. Clocked once it fails.
TEST(Scan, TransitionFileAsWrittenRunsOnTheNetlist) {
  const Machine& m = machine();
  const TransitionView transitions = launch_on_capture(m.view, m.design.scan_enable);
  const TestSet set = generate_tests(transitions.circuit, transitions.faults, {});
  ASSERT_GT(set.patterns.size(), 3u);
  const ScanTest test = make_transition_test(m.design, m.view, transitions, set.patterns, "machine");
  const CycleStream stream = parse_stil(stil_text(test), "machine.stil");
  EXPECT_TRUE(same_cycles(stream, expand(test)));
  const ReplayResult good = replay(m.free_view, stream, m.design.scan_enable);
  EXPECT_GT(good.strobes, set.patterns.size() * m.view.flops.size());
  EXPECT_EQ(good.mismatches, 0u) << good.first;
  ScanTest once = test;
  for (ScanPattern& pattern : once.patterns) {
    if (pattern.action == Action::launch) pattern.action = Action::capture;
  }
  EXPECT_GT(replay(m.free_view, expand(once), m.design.scan_enable).mismatches, 0u);
}

// The machine with one flop's scan enable that falls a clock too late.
Netlist with_slow_scan_enable(const std::string& flop) {
  const Machine& m = machine();
  Netlist netlist = m.design.netlist;
  const auto it = std::find_if(netlist.instances.begin(), netlist.instances.end(),
                               [&](const Instance& instance) { return instance.name == flop; });
  const Cell& cell = m.cells.at(it->type);
  Net& enable = it->pins[cell.scan->enable];
  const Net scan_enable = enable, before = netlist.next_net++, late = netlist.next_net++;
  enable = late;
  const Net clock = it->pins.at("CK");
  netlist.instances.push_back({"enable_before", "DFF", {{"D", scan_enable}, {"CK", clock}, {"Q", before}}});
  netlist.instances.push_back({"late_enable", "OR2", {{"A", scan_enable}, {"B", before}, {"Y", late}}});
  return netlist;
}

// Scan enables that are slow to fall let the launching clock shift: what is called detected fails in the
// file.
TEST(Scan, SlowScanEnablesAreFoundByTheFile) {
  const Machine& m = machine();
  const TransitionView transitions = launch_on_capture(m.view, m.design.scan_enable);
  const TestSet set = generate_tests(transitions.circuit, transitions.faults, {});
  const ScanTest test = make_transition_test(m.design, m.view, transitions, set.patterns, "machine");
  const CycleStream stream = parse_stil(stil_text(test), "machine.stil");
  const auto reported = reported_transitions(m.view, transitions, set.of_class);
  std::size_t found = 0;
  for (std::size_t fault = 0; fault < reported.size(); ++fault) {
    const std::string name = transition_name(m.view.circuit, fault);
    const std::size_t end = name.find("/SE slow-to-fall");
    if (end == std::string::npos) continue;
    const TestFolder folder;
    const ReplayResult slow =
        replay_in_icarus(with_slow_scan_enable(name.substr(0, end)), mini_library(), stream, folder.path());
    EXPECT_EQ(slow.mismatches > 0, reported[fault] == FaultClass::DS) << name;
    found += slow.mismatches > 0 ? 1 : 0;
  }
  EXPECT_GT(found, m.view.flops.size() / 2);
  const TestFolder folder;
  EXPECT_EQ(replay_in_icarus(m.design.netlist, mini_library(), stream, folder.path()).mismatches, 0u);
}

// What a stream's captures load, drive and compare, by which faults are graded.
struct Graded {
  explicit Graded(const CycleStream& stream) : Graded(captures_of(machine().view, stream, "scan_en_i")) {}
  explicit Graded(const Captures& captures)
      : compared(captures.compared),
        patterns(captures.patterns),
        first_pattern(grade(machine().view.circuit,
                            blocks_of(patterns, machine().view.circuit.inputs().size(), compared),
                            collapse(machine().view.circuit).classes, 1)
                          .first_pattern) {}
  std::vector<Pattern> compared, patterns;
  std::vector<std::uint32_t> first_pattern;
  friend bool operator==(const Graded&, const Graded&) = default;
};

// Scan cells, chains and states in WGL: the same cycles, strobes and faults as in STIL, whatever the lengths
// of the chains.
TEST(Scan, WglFileIsReplayedAndGradedAsTheStilFile) {
  for (const std::size_t chains : {1, 2, 3}) {
    const Machine& m = machine();
    const ScanDesign design = insert_scan(m.plain, m.cells, {.chains = chains});
    const ScanTest test = make_scan_test(design, scan_view(design, m.cells), m.set.patterns, "machine");
    const std::string text = wgl_text(test);
    const CycleStream read = parse_wgl(text, "machine.wgl");
    EXPECT_TRUE(same_cycles(read, expand(test))) << chains;
    EXPECT_TRUE(same_chains(read.chains, design.chains));
    EXPECT_EQ(read.cycles[2].label, "chain test");
    if (chains != 2) continue;
    EXPECT_TRUE(Graded(read) == Graded(m.stream));
    const ReplayResult wgl = replay(m.free_view, read, "scan_en_i"),
                       stil = replay(m.free_view, m.stream, "scan_en_i");
    EXPECT_EQ(wgl.mismatches, 0u) << wgl.first;
    EXPECT_EQ(wgl.strobes, stil.strobes);
    // One expected bit turned, one loaded bit turned, two loads exchanged: each fails.
    for (const char* what : {"chain1_unload5\" := \"chain1\"(", "chain0_load5\" := \"chain0\"("}) {
      std::string wrong = text;
      char& bit = wrong[wrong.find(what) + std::string(what).size()];
      bit = bit == '0' ? '1' : '0';
      EXPECT_GT(replay(m.free_view, parse_wgl(wrong, "x"), "scan_en_i").mismatches, 0u) << what;
    }
    // A cell that the file leaves open.
    std::string open = text;
    const std::string load = "chain0_load5\" := \"chain0\"(";
    open[open.find(load) + load.size()] = 'X';
    EXPECT_THAT(replay(m.free_view, parse_wgl(open, "x"), "scan_en_i").first,
                HasSubstr("found what hangs on an unknown"));
    std::string swapped = text;
    const std::string list = "\"chain0\":\"chain0_load4\"";
    swapped.replace(swapped.find(list), list.size(), "\"chain0\":\"chain0_load5\"");
    EXPECT_GT(replay(m.free_view, parse_wgl(swapped, "x"), "scan_en_i").mismatches, 0u);
  }
}

// A dump has no chains: with those of the netlist it is graded and replayed as the STIL file.
TEST(Scan, DumpsWithChainsAreGradedAsTheStilFile) {
  const Machine& m = machine();
  const CycleStream cycles = expand(m.test);
  Directions directions;
  for (const TestSignal& signal : cycles.signals) directions[signal.name] = signal.is_input;
  const std::vector<ScanChain> chains = trace_chains(m.design.netlist, m.cells);
  EXPECT_TRUE(same_chains(chains, m.design.chains));
  for (const bool extended : {true, false}) {
    CycleStream read = extended ? parse_dump(evcd_text(cycles), "machine.evcd", {})
                                : parse_dump(vcd_text(cycles), "machine.vcd", {}, directions);
    attach_chains(read, chains, "scan_en_i");
    EXPECT_TRUE(Graded(read) == Graded(m.stream));
    const ReplayResult result = replay(m.free_view, read, "scan_en_i");
    EXPECT_EQ(result.mismatches, 0u) << result.first;
    EXPECT_EQ(result.strobes, replay(m.free_view, m.stream, "scan_en_i").strobes);
    // Cells exchanged in the chain: other faults.
    std::vector<ScanChain> wrong = chains;
    std::swap(wrong[0].cells[0], wrong[0].cells[1]);
    attach_chains(read, wrong, "scan_en_i");
    EXPECT_FALSE(Graded(read) == Graded(m.stream));
  }
}

// The machine with an inverter in its first chain, before the cell of this number or before the output.
Netlist with_inverter(std::size_t before) {
  const Machine& m = machine();
  const ScanChain& chain = m.design.chains[0];
  Netlist netlist = m.design.netlist;
  for (std::size_t i = 0; i < netlist.instances.size(); ++i) {
    Instance& instance = netlist.instances[i];
    if (before < chain.cells.size() && instance.name == chain.cells[before]) {
      Net& in = instance.pins[m.cells.at(instance.type).scan->in];
      const Net inverted = netlist.next_net++, from = std::exchange(in, inverted);
      netlist.instances.push_back({"inverter", "INV", {{"A", from}, {"Y", inverted}}});
      return netlist;
    }
    const auto port = std::find_if(netlist.ports.begin(), netlist.ports.end(),
                                   [](const Port& p) { return p.name == "scan_o"; });
    if (before == chain.cells.size() && instance.type == "BUF" && instance.pins.at("Y") == port->bits[0]) {
      instance.type = "INV";
      return netlist;
    }
  }
  ADD_FAILURE() << "no place for an inverter";
  return netlist;
}

// The machine's test, the first chain's output compared in unloads alone: an inverter before it shows.
ScanTest unloads_of_first_chain() {
  const Machine& m = machine();
  ScanTest test = m.test;
  const std::size_t out = position(m.stream, m.design.chains[0].out) - test.input_count();
  for (ScanPattern& pattern : test.patterns) pattern.outputs[out] = 'X';
  return test;
}

// That test for the netlist with the inverter: what moves through it is turned.
ScanTest turned(std::size_t before) {
  ScanTest test = unloads_of_first_chain();
  const std::size_t length = test.chains[0].cells.size();
  const auto turn = [](char& bit) {
    constexpr std::string_view kBits = "01LHX", kTurned = "10HLX";
    bit = kTurned[kBits.find(bit)];
  };
  for (ScanPattern& pattern : test.patterns) {
    std::string &load = pattern.load[0], &unload = pattern.unload[0];
    for (std::size_t cell = before; cell < length; ++cell) turn(load[load.size() - 1 - cell]);
    for (std::size_t cell = 0; cell < std::min(before, length); ++cell) turn(unload[length - 1 - cell]);
  }
  return test;
}

// What is loaded behind the last pattern is 0 in the file's own terms, cells or shifted bits.
bool same_but_for_the_last_unload(CycleStream a, CycleStream b) {
  const std::size_t length = machine().test.chain_length();
  a.cycles.resize(a.cycles.size() - length);
  b.cycles.resize(b.cycles.size() - length);
  return same_cycles(a, b);
}

std::string with_mark(std::string text, const std::string& list, const std::string& name,
                      const std::string& mark) {
  const std::size_t at = text.find(name, text.find(list));
  EXPECT_NE(at, std::string::npos);
  return text.insert(at, mark);
}

// Marks of inversions: in WGL the states are what cells hold, in STIL what is shifted. A chain that inverts
// is replayed and graded as the one that doesn't; a mark in the wrong place is seen.
TEST(Scan, ChainsThatInvertAreReplayedAndGraded) {
  const Machine& m = machine();
  const ScanChain& chain = m.design.chains[0];
  const auto name = [&](std::size_t cell) {
    return '"' + (cell < chain.cells.size() ? chain.cells[cell] : chain.out) + '"';
  };
  const std::string wgl = wgl_text(unloads_of_first_chain());
  const Graded plain(expand(unloads_of_first_chain()));
  for (const std::size_t before : {std::size_t{0}, chain.cells.size() / 2, chain.cells.size()}) {
    const Netlist netlist = with_inverter(before);
    const CaptureView inverted = capture_view(netlist, m.cells);
    EXPECT_THAT(trace_chains(netlist, m.cells)[0].inversions, testing::ElementsAre(before));
    EXPECT_THAT(trace_chains(netlist, m.cells)[1].inversions, testing::IsEmpty());
    EXPECT_GT(replay(inverted, m.stream, "scan_en_i").mismatches, 0u) << before;

    const CycleStream from_wgl =
        parse_wgl(with_mark(wgl, "scanchain\n  \"chain0\"", name(before), "!, "), "machine.wgl");
    EXPECT_THAT(from_wgl.chains[0].inversions, testing::ElementsAre(before));
    EXPECT_TRUE(same_but_for_the_last_unload(from_wgl, expand(turned(before)))) << before;
    EXPECT_EQ(replay(inverted, from_wgl, "scan_en_i").mismatches, 0u) << before;
    EXPECT_TRUE(Graded(from_wgl) == plain) << before;
    const std::size_t wrong = before == 0 ? 1 : before - 1;
    const CycleStream misplaced =
        parse_wgl(with_mark(wgl, "scanchain\n  \"chain0\"", name(wrong), "!, "), "machine.wgl");
    EXPECT_GT(replay(inverted, misplaced, "scan_en_i").mismatches, 0u) << before;

    std::string stil = stil_text(turned(before));
    stil.replace(stil.find("ScanInversion 0"), 15, "ScanInversion 1");
    const std::string next = before < chain.cells.size() ? name(before) : ";";
    const CycleStream from_stil = parse_stil(with_mark(stil, "ScanCells", next, "! "), "machine.stil");
    EXPECT_THAT(from_stil.chains[0].inversions, testing::ElementsAre(before));
    EXPECT_TRUE(same_but_for_the_last_unload(from_stil, from_wgl)) << before;
    EXPECT_EQ(replay(inverted, from_stil, "scan_en_i").mismatches, 0u) << before;
    EXPECT_TRUE(Graded(from_stil) == plain) << before;
    EXPECT_FALSE(Graded(parse_stil(with_mark(stil, "ScanCells", name(wrong), "! "), "x")) == plain) << before;
  }
}

TEST(Scan, ChainsThatDontFitAreRefused) {
  const Machine& m = machine();
  const CycleStream good = expand(m.test);
  const auto refuse = [&](CycleStream stream, std::vector<ScanChain> chains, const char* enable,
                          const char* reason) {
    EXPECT_THAT([&] { attach_chains(stream, chains, enable); }, ThrowsMessage<UserError>(HasSubstr(reason)));
  };
  const std::vector<ScanChain>& chains = m.design.chains;
  refuse(good, {}, "scan_en_i", "found no chains");
  refuse(good, chains, "se", "found no input signal se");
  std::vector<ScanChain> wrong = chains;
  wrong[1].out = "so";
  refuse(good, wrong, "scan_en_i", "found no output signal so");
  wrong = chains;
  wrong[1].cells.resize(wrong[1].cells.size() + 3, "more");
  refuse(good, wrong, "scan_en_i", "the cells of the longest chain");
  refuse(good, chains, "start_i", "clocks with start_i at 1");
  CycleStream cut = good;
  cut.cycles.pop_back();
  refuse(cut, chains, "scan_en_i", "the cells of the longest chain");
  cut.cycles.resize(1);
  refuse(cut, chains, "scan_en_i", "found no cycle with scan_en_i at 1");

  EXPECT_THAT([&] { trace_chains(m.plain, m.cells); },
              ThrowsMessage<UserError>(HasSubstr("no output port scan_o")));
  Netlist broken = m.design.netlist;  // the second cell of a chain doesn't shift any more
  for (Instance& instance : broken.instances) {
    if (instance.name != chains[0].cells[1]) continue;
    instance.pins[m.cells.at(instance.type).scan->enable] = 0;  // captures always
  }
  EXPECT_THAT([&] { trace_chains(broken, m.cells); },
              ThrowsMessage<UserError>(HasSubstr(chains[0].cells[1])));
}

TEST(Scan, SeededDefectsOfWglScanDataAreRefusedWithLineAndReason) {
  const std::string good = wgl_text(machine().test);
  const auto& cells = machine().design.chains[0].cells;
  struct Defect {
    std::string find, put, reason;
  };
  const Defect defects[] = {
      {"scancell\n  \"" + cells[0] + "\";\n", "scancell\n", "scan cell \"" + cells[0] + "\""},
      {"[\"scan_i[0]\", ", "[\"scan_i[9]\", ", "signal \"scan_i[9]\""},
      {"[\"scan_i[0]\", ", "[\"scan_o[0]\", ", "an input first and an output last"},
      {"[\"scan_i[0]\", ", "[\"scan_i[0]\", \"!\", ", "scan cell \"!\""},
      {"\"chain1\" [", "\"chain0\" [", "chain \"chain0\" again"},
      {":= \"chain0\"(", ":= \"chain9\"(", "chain \"chain9\""},
      {":= \"chain0\"(", ":= \"chain0\"(0", "bits in state \"chain0_load0\""},
      {":= \"chain0\"(0", ":= \"chain0\"(2", "2 to load"},
      {"\"chain0_unload3\" :=", "\"chain0_unload2\" :=", "state \"chain0_unload2\" again"},
      {"\"chain0\":\"chain0_load2\"", "\"chain0\":\"chain0_load\"", "scan state \"chain0_load\""},
      {"\"chain0\":\"chain0_load2\"", "\"chain0\":\"chain1_load2\"", "one of chain \"chain0\""},
      {"\"chain0\":\"chain0_load2\"", "\"chain1\":\"chain1_load2\"", "\"scan_i[1]\" again"},
      {"scan(tp) := [ ", "scan(tp) := [ 0 ", "values"},
      {"scan(tp) := [ ", "repeat 2 scan(tp) := [ ", "a scan row repeated"},
      {"    input [", "    inputs [", "expected input or output"},
      {"scanstate\n", "scanstates\n", "\"scanstates\""},
  };
  for (const Defect& defect : defects) {
    std::string text = good;
    const std::size_t at = text.find(defect.find);
    ASSERT_NE(at, std::string::npos) << defect.find;
    text.replace(at, defect.find.size(), defect.put);
    try {
      parse_wgl(text, "bad.wgl");
      ADD_FAILURE() << defect.put << " was taken";
    } catch (const PatternFileError& error) {
      EXPECT_THAT(error.what(), HasSubstr(defect.reason)) << defect.put;
      EXPECT_THAT(error.what(), HasSubstr("bad.wgl:" + std::to_string(error.line()) + ":"));
    }
  }
}

TEST(Scan, FileAsWrittenRunsInIcarus) {
  const TestFolder folder;
  const ReplayResult result =
      replay_in_icarus(machine().design.netlist, mini_library(), machine().stream, folder.path());
  EXPECT_EQ(result.mismatches, 0u) << result.first;
  EXPECT_EQ(result.strobes, replay(machine().free_view, machine().stream).strobes);
  CycleStream wrong = machine().stream;
  for (TestCycle& cycle : wrong.cycles) {
    const std::size_t at = cycle.states.find('H');
    if (at == std::string::npos) continue;
    cycle.states[at] = 'L';
    break;
  }
  const TestFolder other;
  EXPECT_EQ(replay_in_icarus(machine().design.netlist, mini_library(), wrong, other.path()).mismatches, 1u);
  CycleStream open = machine().stream;  // what is left open is unknown there, too
  for (TestCycle& cycle : open.cycles) cycle.states[position(open, "start_i")] = 'N';
  const TestFolder third;
  const ReplayResult unknown = replay_in_icarus(machine().design.netlist, mini_library(), open, third.path());
  EXPECT_GE(unknown.mismatches, replay(machine().free_view, open, "scan_en_i").mismatches);
  EXPECT_THAT(unknown.first, HasSubstr("found x, expected"));
}

// A layout has a port for each bit: scan_i[0] of the file is scan_i_0 there.
TEST(Scan, FileAsWrittenRunsOnSplitPorts) {
  const Machine& m = machine();
  Netlist split = m.design.netlist;
  split.ports.clear();
  for (const Port& port : m.design.netlist.ports) {
    for (std::size_t i = 0; i < port.bits.size(); ++i) {
      const std::string name = port.bits.size() == 1 ? port.name : port.name + "_" + std::to_string(i);
      split.ports.push_back({name, port.is_input, {port.bits[i]}});
    }
  }
  CycleStream stream = m.stream;
  const TestFolder folder;
  EXPECT_THAT([&] { replay_in_icarus(split, mini_library(), stream, folder.path()); },
              ThrowsMessage<UserError>(HasSubstr("found no signal width_i_0, expected every port")));
  name_as_ports(stream, split);
  EXPECT_EQ(stream.chains[1].out, "scan_o_1");
  for (const ReplayResult& result : {replay(capture_view(split, mini_library()), stream, "scan_en_i"),
                                     replay_in_icarus(split, mini_library(), stream, folder.path())}) {
    EXPECT_EQ(result.mismatches, 0u) << result.first;
    EXPECT_EQ(result.strobes, replay(m.free_view, m.stream).strobes);
  }
  CycleStream whole = m.stream;  // names that are ports stay
  name_as_ports(whole, m.design.netlist);
  EXPECT_EQ(whole.signals, m.stream.signals);
}

// What the stream loads and compares, taken from it again, grades as it did.
TEST(Scan, GradingTheFileFindsTheSameFaults) {
  const Machine& m = machine();
  const auto [patterns, before, compared, compared_in, compared_at] =
      captures_of(m.view, m.stream, "scan_en_i");
  ASSERT_EQ(patterns.size(), m.set.patterns.size());
  const std::size_t inputs = m.view.circuit.inputs().size();
  const Grade again = grade(m.view.circuit, blocks_of(patterns, inputs, compared), m.set.faults.classes, 1);
  const Grade first = grade(m.view.circuit, blocks_of(m.set.patterns, inputs), m.set.faults.classes, 1);
  EXPECT_EQ(again.first_pattern, first.first_pattern);
}

}  // namespace
}  // namespace meltstage::dft
