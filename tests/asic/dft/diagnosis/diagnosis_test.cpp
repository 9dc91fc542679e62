// SPDX-License-Identifier: Apache-2.0
// The virtual tester against definitions, and defects found again from its logs.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>

#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/diagnosis/findings.hpp"
#include "asic/dft/diagnosis/tester.hpp"
#include "asic/dft/grade_file.hpp"
#include "asic/dft/scan/scan_grade.hpp"
#include "base/error.hpp"
#include "tests/asic/dft/netlist_machine.hpp"
#include "tests/asic/dft/scan_machine.hpp"
#include "tests/asic/dft/serial.hpp"
#include "tests/asic/dft/support.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::dft {
namespace {

using testing::HasSubstr;

// ---- The tester
// --------------------------------------------------------------------------------------------

// Patterns of a circuit without flops, each output compared with what it is.
CycleStream stream_of(const CaptureView& view, const std::vector<Pattern>& patterns) {
  CycleStream stream;
  stream.title = "patterns";
  for (const std::string& name : view.input_ports) stream.signals.push_back({name, true});
  for (const std::string& name : view.output_ports) stream.signals.push_back({name, false});
  for (const Pattern& pattern : patterns) {
    const std::vector<bool> values = serial_values(view.circuit, pattern, nullptr);
    TestCycle cycle;
    for (const std::uint8_t bit : pattern) cycle.states += bit != 0 ? '1' : '0';
    for (const Node output : view.circuit.outputs()) cycle.states += values[output] ? 'H' : 'L';
    stream.cycles.push_back(cycle);
  }
  return stream;
}

// The stuck line that a defect is in a cycle; none where the line has its right level.
std::optional<Fault> acting(const Circuit& circuit, const ChipDefect& defect, const std::vector<bool>& now,
                            const std::vector<bool>& before) {
  const Node line = source_of(circuit, defect.line);
  const auto stuck = [&](const Line& where, bool level) -> std::optional<Fault> {
    if (now[source_of(circuit, where)] == level) return std::nullopt;
    return Fault{where.node, where.pin, level};
  };
  switch (defect.kind) {
    case DefectKind::stuck_at_0:
      return stuck(defect.line, false);
    case DefectKind::stuck_at_1:
      return stuck(defect.line, true);
    case DefectKind::slow_to_rise:
      return stuck(defect.line, now[line] && before[line]);
    case DefectKind::slow_to_fall:
      return stuck(defect.line, now[line] || before[line]);
    case DefectKind::dominated_by:
      return stuck(defect.line, now[defect.other.node]);
    default: {
      const bool level = defect.kind == DefectKind::wired_or;
      if (now[line] == now[defect.other.node]) return std::nullopt;
      return stuck(now[line] == level ? defect.other : defect.line, level);
    }
  }
}

ChipDefect drawn_defect(const CaptureView& view, std::mt19937_64& random) {
  const Circuit& circuit = view.circuit;
  const std::vector<Line> lines = data_lines(view);
  const auto line = [&] { return lines[random() % lines.size()]; };
  const auto kind = static_cast<DefectKind>(random() % 7);
  if (!is_bridge(kind)) return {kind, line()};
  for (int tries = 0; tries < 1000; ++tries) {
    const Line a{source_of(circuit, line()), kStem}, b{source_of(circuit, line()), kStem};
    if (a.node != b.node && !leads_to(circuit, a.node, b.node) && !leads_to(circuit, b.node, a.node))
      return {kind, a, b};
  }
  return {DefectKind::stuck_at_0, line()};
}

TEST(VirtualTester, FailsWhereTheDefectsDefinitionSaysSo) {
  const std::uint64_t seed = std::random_device()();
  std::mt19937_64 random(seed);
  std::size_t failing = 0;
  for (int round = 0; round < 60; ++round) {
    SCOPED_TRACE(fmt::format("seed {}, round {}", seed, round));
    const CaptureView view = plain_view(random_circuit(random(), 6, 40));
    std::vector<Pattern> patterns(700, Pattern(view.circuit.inputs().size()));  // more than one word
    for (Pattern& pattern : patterns)
      for (std::uint8_t& bit : pattern) bit = static_cast<std::uint8_t>(random() & 1);
    const CycleStream stream = stream_of(view, patterns);
    const ChipDefect defect = drawn_defect(view, random);
    std::vector<FailedStrobe> expected;
    std::vector<bool> before(view.circuit.size(), false);
    for (std::size_t p = 0; p < patterns.size(); ++p) {
      const std::vector<bool> now = serial_values(view.circuit, patterns[p], nullptr);
      if (const auto fault = acting(view.circuit, defect, now, before)) {
        const std::vector<bool> wrong = serial_values(view.circuit, patterns[p], &*fault);
        for (std::size_t o = 0; o < view.circuit.outputs().size(); ++o)
          if (wrong[view.circuit.outputs()[o]] != now[view.circuit.outputs()[o]])
            expected.push_back({p, view.input_ports.size() + o});
      }
      before = now;
    }
    EXPECT_EQ(test_chip(view, stream, "", {{defect}}).fails, expected) << defect_name(view.circuit, defect);
    failing += expected.empty() ? 0 : 1;
  }
  EXPECT_GT(failing, 20u);
}

// Every stuck pin of a scanned netlist, with a simulator that shares nothing but the netlist: the same chips
// fail. Pins of clocks have no line.
TEST(VirtualTester, FailsTheChipsThatTheNetlistFails) {
  const Machine* m = &machine();
  std::size_t compared = 0;
  NetlistMachine good(m->design.netlist, mini_library());
  good.power_up([] { return NetlistMachine::Bits{0}; });
  ASSERT_EQ(good.run(m->stream, [] { return NetlistMachine::Bits{0}; }) & 1, 0u);
  for (const Line& line : data_lines(m->free_view)) {
    const std::string site = LineNames(m->free_view.circuit).of(line);
    for (const bool level : {false, true}) {
      NetlistMachine chip(m->design.netlist, mini_library());
      chip.stick(site, level, 1);
      chip.power_up([] { return NetlistMachine::Bits{0}; });
      const bool fails = (chip.run(m->stream, [] { return NetlistMachine::Bits{0}; }) & 1) != 0;
      const ChipDefect defect{level ? DefectKind::stuck_at_1 : DefectKind::stuck_at_0, line};
      const FailLog log = test_chip(m->free_view, m->stream, "scan_en_i", {{defect}});
      EXPECT_EQ(!log.fails.empty(), fails) << site << " stuck at " << level;
      ++compared;
    }
  }
  EXPECT_GT(compared, 100u);
  EXPECT_TRUE(test_chip(m->free_view, m->stream, "scan_en_i", {}).fails.empty());
}

TEST(VirtualTester, ChipsSideBySideFailAsOneByOne) {
  const Machine& m = machine();
  std::mt19937_64 random(7);
  std::vector<TestedChip> chips;
  for (int i = 0; i < 13; ++i) {
    TestedChip& chip = chips.emplace_back();
    for (int k = 0; k < i % 3; ++k) chip.defects.push_back(drawn_defect(m.free_view, random));
    chip.seed = random();
  }
  const std::vector<FailLog> logs = test_chips(m.free_view, m.stream, "scan_en_i", chips);
  for (std::size_t i = 0; i < chips.size(); ++i)
    EXPECT_EQ(logs[i].fails, test_chip(m.free_view, m.stream, "scan_en_i", chips[i]).fails) << i;
}

// ---- Defects and logs as text
// ------------------------------------------------------------------------------

TEST(ChipDefects, AreReadByTheNamesThatTheyArePrintedWith) {
  const CaptureView& view = machine().free_view;
  const Circuit& circuit = view.circuit;
  std::mt19937_64 random(3);
  for (int i = 0; i < 100; ++i) {
    const ChipDefect drawn = drawn_defect(view, random);
    const std::string name = defect_name(circuit, drawn);
    EXPECT_EQ(defect_name(circuit, parse_defect(circuit, name)), name);
  }
  for (const auto& [text, expected] :
       {std::pair{"nothing", "expected CELL/PIN and one of stuck-at-0"},
        {"start_i stuck-at-2", "expected CELL/PIN and one of stuck-at-0"},
        {"nosuch/Y stuck-at-0", "found nosuch/Y, expected a pin of a cell"},
        {"start_i stuck-at-0 stop_i", "expected nothing behind the kind"},
        {"start_i wired-and", "expected the bridge's other pin behind it"},
        {"start_i wired-and start_i", "found lines of which one drives the other"}})
    EXPECT_THAT(error_of([&, t = text] { parse_defect(circuit, t); }), HasSubstr(expected)) << text;
}

TEST(FailLogs, AreReadAsTheyAreWritten) {
  const Machine& m = machine();
  std::mt19937_64 random(5);
  const FailLog log = test_chip(m.free_view, m.stream, "scan_en_i",
                                {{parse_defect(m.free_view.circuit, "start_i stuck-at-0")}});
  ASSERT_GT(log.fails.size(), 2u);
  for (const FailLog& written : {log, kept_in_memory(log, log.fails.size() - 1)}) {
    const FailLog read = parse_fail_log(fail_log_text(written, m.stream), "chip.log", m.stream);
    EXPECT_EQ(read.fails, written.fails);
    EXPECT_EQ(read.truncated, written.truncated);
  }
}

TEST(FailLogs, WhatIsNoneIsRefusedWithItsPlace) {
  const CycleStream& stream = machine().stream;
  const std::string title = "fail log 1\n";
  for (const auto& [text, expected] :
       {std::pair<std::string, const char*>{"", "log:1:1: found the end of the file, expected fail log 1"},
        {"fails\n", "log:1:1: found fails, expected fail log 1"},
        {title, "log:2:1: found the end of the file, expected end, or full"},
        {title + "cycle 3\nend\n", "log:2:7: found 3, expected cycle NUMBER SIGNAL"},
        {title + "cycle x pulse_o\nend\n", "log:2:7: found x, expected a cycle of"},
        {title + "cycle 99999999 pulse_o\nend\n", "log:2:7: found 99999999, expected a cycle of"},
        {title + "cycle 3 nosuch_o\nend\n", "log:2:9: found nosuch_o, expected an output of"},
        {title + "cycle 3 start_i\nend\n", "log:2:9: found start_i, expected an output of"},
        {title + "cycle 0 pulse_o\nend\n", "log:2:9: found pulse_o, expected an output that"},
        {title + "end\ncycle 3 pulse_o\n", "log:3:1: found cycle, expected nothing behind the end"},
        {title + "full\n", "log:2:1: found full, expected failed strobes before the memory is full"},
        {title + "stop\n", "log:2:1: found stop, expected cycle NUMBER SIGNAL, end, or full"}})
    EXPECT_THAT(error_of([&, &t = text] { parse_fail_log(t, "log", stream); }), HasSubstr(expected)) << text;
}

// ---- Diagnosis
// ---------------------------------------------------------------------------------------------

ProgramOnNetlist program_of(const Machine& m) {
  return {m.stream, m.free_view, m.view, captures_of(m.view, m.stream, "scan_en_i"), "scan_en_i"};
}

bool names(const std::vector<std::string>& nets, const std::string& net) {
  return std::find(nets.begin(), nets.end(), net) != nets.end();
}

// Every stuck line of a small netlist that fails: its net is to blame first, or can't be told apart from the
// first.
TEST(Diagnosis, StuckLinesAreFoundAgain) {
  const Machine& m = machine();
  const ProgramOnNetlist program = program_of(m);
  const LogReader reader(program);
  std::size_t failing = 0, first = 0;
  for (const Line& line : data_lines(m.free_view)) {
    for (const DefectKind kind : {DefectKind::stuck_at_0, DefectKind::stuck_at_1}) {
      const ChipDefect defect{kind, line};
      const FailLog log = test_chip(m.free_view, m.stream, "scan_en_i", {{defect}});
      if (log.fails.empty()) continue;
      ++failing;
      const Findings found = reader.findings(log);
      const bool hit =
          !found.blamed.empty() && names(found.blamed[0], reader.lines_of_chip().net_of(defect.line));
      first += hit ? 1 : 0;
      if (!hit) fmt::print("not first: {}\n", defect_name(m.free_view.circuit, defect));
    }
  }
  EXPECT_GT(failing, 100u);
  EXPECT_GE(10 * first, 9 * failing) << first << " of " << failing;
}

// On circuits without flops the patterns tell a line and its behaviour.
TEST(Diagnosis, NamesHowALineBehaves) {
  const std::uint64_t seed = std::random_device()();
  std::mt19937_64 random(seed);
  std::size_t failing = 0, first = 0, behaviour = 0;
  for (int round = 0; round < 250; ++round) {
    const CaptureView view = plain_view(random_circuit(random(), 10, 60));
    std::vector<Pattern> patterns(400, Pattern(view.circuit.inputs().size()));
    for (Pattern& pattern : patterns)
      for (std::uint8_t& bit : pattern) bit = static_cast<std::uint8_t>(random() & 1);
    const CycleStream stream = stream_of(view, patterns);
    const ChipDefect defect = drawn_defect(view, random);
    const FailLog log = test_chip(view, stream, "", {{defect}});
    if (log.fails.size() < 5) continue;
    ++failing;
    const ProgramOnNetlist program{stream, view, view, captures_of_cycles(view, stream, false), ""};
    const LogReader reader(program);
    const Findings found = reader.findings(log);
    const std::string net = reader.lines().net_of(defect.line);
    const std::string other = is_bridge(defect.kind) ? reader.lines().net_of(defect.other) : net;
    ASSERT_FALSE(found.blamed.empty());
    first += names(found.blamed[0], net) || names(found.blamed[0], other) ? 1 : 0;
    for (const Suspect& s : found.captures.defects[0].suspects) {
      if (to_string(s.behaviour) != std::string(to_string(defect.kind)) ||
          s.line != stem_of(view.circuit, defect.line))
        continue;
      ++behaviour;
      break;
    }
  }
  EXPECT_GT(failing, 60u);
  EXPECT_GE(10 * first, 9 * failing) << first << " of " << failing << ", seed " << seed;
  EXPECT_GE(3 * behaviour, failing) << behaviour << " of " << failing << ", seed " << seed;
}

// A tester that keeps half of the fails: what it can't tell is not taken for passed, so the true line is not
// ruled out.
TEST(Diagnosis, AFullMemoryMisleadsNobody) {
  const Machine& m = machine();
  const ProgramOnNetlist program = program_of(m);
  const LogReader reader(program);
  std::size_t cut = 0, named = 0;
  for (const Line& line : data_lines(m.free_view)) {
    const ChipDefect defect{DefectKind::stuck_at_1, line};
    const FailLog whole = test_chip(m.free_view, m.stream, "scan_en_i", {{defect}});
    const FailLog log = kept_in_memory(whole, std::max<std::size_t>(1, whole.fails.size() / 2));
    if (!log.truncated) continue;
    ++cut;
    const std::string net = reader.lines_of_chip().net_of(line);
    const Findings found = reader.findings(log);
    named += std::any_of(found.blamed.begin(), found.blamed.end(),
                         [&](const auto& group) { return names(group, net); })
                 ? 1
                 : 0;
  }
  EXPECT_GT(cut, 20u);
  EXPECT_GE(10 * named, 9 * cut) << named << " of " << cut;
}

// The memory is full in the midst of a pattern: the strobes that fail beside the last one speak for nobody.
TEST(Diagnosis, ACutPatternStillNamesItsLine) {
  std::mt19937_64 random(11);
  std::size_t cut = 0;
  for (int round = 0; round < 200; ++round) {
    const CaptureView view = plain_view(random_circuit(random(), 8, 40));
    std::vector<Pattern> patterns(100, Pattern(view.circuit.inputs().size()));
    for (Pattern& pattern : patterns)
      for (std::uint8_t& bit : pattern) bit = static_cast<std::uint8_t>(random() & 1);
    const CycleStream stream = stream_of(view, patterns);
    const std::vector<Line> lines = data_lines(view);
    const ChipDefect defect{DefectKind::stuck_at_1, lines[random() % lines.size()]};
    const FailLog log = test_chip(view, stream, "", {{defect}});
    if (log.fails.size() < 2 || log.fails[0].cycle != log.fails[1].cycle) continue;
    ++cut;
    const ProgramOnNetlist program{stream, view, view, captures_of_cycles(view, stream, false), ""};
    const LogReader reader(program);
    const Findings found = reader.findings(kept_in_memory(log, 1));
    EXPECT_EQ(found.captures.failing_patterns, 1u);
    const std::string net = reader.lines().net_of(defect.line);
    EXPECT_TRUE(std::any_of(found.blamed.begin(), found.blamed.end(),
                            [&](const auto& group) { return names(group, net); }))
        << "round " << round;
  }
  EXPECT_GT(cut, 5u);
}

// A stuck cell breaks its chain there.
TEST(Diagnosis, ABrokenChainIsLocatedAtItsCell) {
  const Machine& m = machine();
  const ProgramOnNetlist program = program_of(m);
  const LogReader reader(program);
  for (std::size_t c = 0; c < m.stream.chains.size(); ++c) {
    const ScanChain& chain = m.stream.chains[c];
    for (std::size_t k = 0; k < chain.cells.size(); ++k) {
      for (const char* kind : {"stuck-at-0", "stuck-at-1"}) {
        const ChipDefect defect =
            parse_defect(m.free_view.circuit, fmt::format("{}/Q {}", chain.cells[k], kind));
        const FailLog log = test_chip(m.free_view, m.stream, "scan_en_i", {{defect}});
        const Findings found = reader.findings(log);
        ASSERT_EQ(found.chains.size(), 1u) << chain.cells[k];
        EXPECT_EQ(found.chains[0].chain, c) << chain.cells[k];
        EXPECT_TRUE(names(found.blamed[0], chain.cells[k] + "/Q")) << chain.cells[k];
      }
    }
  }
}

// A slow one, too, wherever the pause between two loads falls in the bits of the chain test.
TEST(Diagnosis, ASlowCellIsNamedWhereItsChainTestFails) {
  const Machine& m = machine();
  const ProgramOnNetlist program = program_of(m);
  const LogReader reader(program);
  std::size_t broken = 0, named = 0;
  for (const ScanChain& chain : m.stream.chains) {
    for (const std::string& cell : chain.cells) {
      for (const char* kind : {"slow-to-rise", "slow-to-fall"}) {
        const ChipDefect defect = parse_defect(m.free_view.circuit, fmt::format("{}/Q {}", cell, kind));
        const Findings found = reader.findings(test_chip(m.free_view, m.stream, "scan_en_i", {{defect}}));
        if (found.chains.empty()) continue;
        ++broken;
        named += names(found.blamed.at(0), cell + "/Q") ? 1 : 0;
      }
    }
  }
  EXPECT_GT(broken, 8u);
  EXPECT_EQ(named, broken);
}

TEST(VirtualTester, ALineHasOneDefectAndAClockNone) {
  const Machine& m = machine();
  const auto test = [&](std::initializer_list<const char*> defects) {
    TestedChip chip;
    for (const char* text : defects) chip.defects.push_back(parse_defect(m.free_view.circuit, text));
    return error_of([&] { test_chip(m.free_view, m.stream, "scan_en_i", chip); });
  };
  EXPECT_EQ(test({"start_i stuck-at-0", "stop_i stuck-at-1"}), "");
  EXPECT_THAT(test({"start_i stuck-at-0", "start_i stuck-at-1"}),
              HasSubstr("found another defect of the same line"));
  EXPECT_THAT(test({"clk_i stuck-at-0"}), HasSubstr("found a clock"));
}

}  // namespace
}  // namespace meltstage::dft
