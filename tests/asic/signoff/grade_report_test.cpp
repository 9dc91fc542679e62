// SPDX-License-Identifier: Apache-2.0
// Reasons for what functional vectors cannot reach: read from a file, derived, and counted.
#include "asic/signoff/grade_report.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "asic/dft/core/machines.hpp"
#include "asic/signoff/functional_vectors.hpp"
#include "base/error.hpp"
#include "cmodel/math.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::app {
namespace {

using namespace dft;

std::string refusal(const std::string& text) {
  const TestFolder folder;
  try {
    read_unreached(folder.file("unreached.toml", text));
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

TEST(Unreached, IsReadWithItsKeys) {
  const TestFolder folder;
  const auto rules = read_unreached(folder.file("unreached.toml", R"([[unreached]]
flops = ["a[", "b"]
unseen = ["c"]
reason = "one"
[[unreached]]
near = ["d"]
reason = "two"
[[unreached]]
words = ["m["]
parities = [[0, 1], [2]]
reason = "three"
)"));
  ASSERT_EQ(rules.size(), 3u);
  EXPECT_EQ(rules[2].words, std::vector<std::string>{"m["});
  EXPECT_EQ(rules[2].parities, (std::vector<std::vector<unsigned>>{{0, 1}, {2}}));
  EXPECT_EQ(rules[0].flops, (std::vector<std::string>{"a[", "b"}));
  EXPECT_EQ(rules[0].unseen, std::vector<std::string>{"c"});
  EXPECT_EQ(rules[1].near, std::vector<std::string>{"d"});
  EXPECT_EQ(rules[1].reason, "two");
}

TEST(Unreached, MistakesAreNamedWithTheirPlace) {
  const auto expect = [](const std::string& text, const std::string& said) {
    EXPECT_NE(refusal(text).find("unreached.toml:" + said), std::string::npos) << refusal(text);
  };
  EXPECT_EQ(refusal("[[unreached]]\nreason = \"a\"\nflops = [\"a\"]\n"), "");
  expect("a = 1\n", "1:5: a: found an unknown key, expected one of: unreached");
  expect("[unreached]\n", "1:1: unreached: found a section, expected sections [[unreached]]");
  expect("[[unreached]\n", "1:13: not TOML");
  const std::string rule = "\n[[unreached]]\nreason = \"a\"\n";
  expect("\n[[unreached]]\nflops = [\"a\"]\n", "2:1: unreached.reason: found nothing");
  expect(rule, "2:1: unreached.flops: found nothing, nor near, unseen, words");
  expect(rule + "flop = [\"a\"]\n", "4:8: unreached.flop: found an unknown key");
  expect(rule + "flops = [1]\n", "4:10: unreached.flops: found 1, expected a text");
  expect(rule + "words = [\"a[\"]\n", "2:1: unreached.parities: found nothing, expected both words and");
  expect(rule + "words = [\"a[\"]\nparities = [[-1]]\n",
         "5:14: unreached.parities: found -1, expected whole");
}

// The chip's rows of MEM: their sums as the file says them are even in each that the model stores.
TEST(Unreached, ParitiesOfTheChipsWordsAreThoseOfItsCode) {
  std::set<std::string> whole;  // rows of which each check bit is said
  for (const Unreached& rule : read_unreached(UNREACHED)) {
    if (rule.words.empty()) continue;
    if (rule.parities.size() == 6) whole.insert(rule.words.begin(), rule.words.end());
    for (std::uint32_t data = 0; data <= 0xFFFF; ++data) {
      for (const bool corrected : {true, false}) {
        if (!corrected && rule.parities.size() == 6) continue;
        const std::uint32_t row = chip::mem_row(corrected, static_cast<std::uint16_t>(data));
        for (const std::vector<unsigned>& parity : rule.parities) {
          unsigned sum = 0;
          for (const unsigned bit : parity) sum ^= row >> bit & 1U;
          ASSERT_EQ(sum, 0u) << data;
        }
      }
    }
  }
  std::set<std::string> corrected;
  for (unsigned i = 0; i < chip::spec::kHoldingCount; ++i)
    if (chip::spec::kHolding[i].corrected) corrected.insert("u_mem.active_q[" + std::to_string(i) + "][");
  EXPECT_EQ(whole, corrected);
}

struct Graded {
  Netlist netlist;
  CaptureView view;
  std::vector<Fault> faults;
  FunctionalGrade grade;

  GradeReport report(const std::vector<FaultClass>& verdicts, const std::vector<Unreached>& rules) const {
    return grade_report(netlist, view, {}, faults, verdicts, grade, rules);
  }
};
// Every strobe expects what the netlist shows without a fault.
void expect_what_is_shown(const CaptureView& view, CycleStream& stream) {
  Machines machine(view, {});
  machine.start();
  Word one;
  one.set(0, true);
  for (TestCycle& cycle : stream.cycles) {
    std::vector<std::uint8_t> inputs;
    for (std::size_t i = 0; i < view.input_ports.size(); ++i)
      inputs.push_back(cycle.states[i] == '1' ? 1 : 0);
    machine.set_inputs(inputs);
    for (std::size_t o = 0; o < view.output_ports.size(); ++o)
      cycle.states[view.input_ports.size() + o] = machine.unlike(o, true, one).any() ? 'L' : 'H';
    machine.clock();
  }
}
// The machine with random vectors; start_i stays at 0 unless it `starts`.
Graded graded(bool starts) {
  Netlist netlist = circuit_netlist("machine");
  CaptureView view = capture_view(netlist, mini_library());
  std::mt19937_64 random(1);
  CycleStream stream;
  for (const std::string& port : view.input_ports) stream.signals.push_back({port, true});
  for (const std::string& port : view.output_ports) stream.signals.push_back({port, false});
  for (std::size_t i = 0; i < 2000; ++i) {
    std::string states;
    for (std::size_t p = 0; p < view.input_ports.size(); ++p) {
      const std::string& port = view.input_ports[p];
      const bool drawn = (random() & 1) != 0;
      const bool level = port == "rst_ni" ? i > 3 : port == "start_i" ? drawn && starts : drawn;
      states += view.clock_ports[p] != 0 ? 'P' : level ? '1' : '0';
    }
    stream.cycles.push_back({states + std::string(view.output_ports.size(), 'X'), ""});
  }
  expect_what_is_shown(view, stream);
  std::vector<Fault> faults = collapse(view.circuit).classes;
  FunctionalGrade grade = grade_functional(view, stream, faults, 1);
  return {std::move(netlist), std::move(view), std::move(faults), std::move(grade)};
}
const std::vector<Unreached> kNeverStarted{{{"start_i"}, {}, {}, {}, {}, "never started"}};

// What is derived from a true statement no vector finds.
TEST(Unreached, AFaultWithATrueReasonIsNotDetected) {
  const Graded idle = graded(false);
  std::vector<FaultClass> verdicts;
  for (const std::uint64_t first : idle.grade.first_cycle)
    verdicts.push_back(first == FunctionalGrade::kUndetected ? FaultClass::NO : FaultClass::DS);
  const std::vector<FaultClass> none(verdicts.size(), FaultClass::NO);
  const GradeReport open = idle.report(verdicts, kNeverStarted), claimed = idle.report(none, kNeverStarted);
  EXPECT_GT(claimed.hidden, 10u);
  EXPECT_EQ(open.hidden, claimed.hidden);
  EXPECT_GT(open.unreached, idle.report(verdicts, {}).unreached);
  EXPECT_NE(open.text.find(": never started"), std::string::npos);
}

TEST(Unreached, WordsThatAreNotThereAreRefused) {
  const Graded idle = graded(false);
  const std::vector<FaultClass> none(idle.faults.size(), FaultClass::NO);
  EXPECT_THROW(idle.report(none, {{{}, {}, {}, {"u_nowhere["}, {{0, 1}}, "a code"}}), UserError);
}

TEST(Unreached, AFalseReasonIsRefused) {
  const Graded busy = graded(true);
  const std::vector<FaultClass> none(busy.faults.size(), FaultClass::NO);
  EXPECT_NO_THROW(busy.report(none, {}));
  EXPECT_THROW(busy.report(none, kNeverStarted), UserError);
}

// The set records: every answer, trip and limit in it is as it is said to be. Test mode changes in reset
// alone.
TEST(FunctionalSet, RecordsWithTestModeSteadyOutOfReset) {
  const FunctionalSet set = functional_set(FunctionalLength::quick);
  EXPECT_GT(set.pieces.size(), 20u);
  EXPECT_LE(set.stream.final_cycle(), 64'000'000u);
  recording::Cursor cursor(set.stream);
  std::uint64_t mode = 0;
  bool both = false;
  for (bool more = true; more; more = cursor.next_event()) {
    if (cursor.values()[tb::kPinTestMode] == mode) continue;
    mode = cursor.values()[tb::kPinTestMode];
    both = true;
    EXPECT_EQ(cursor.values()[tb::kPinRstN], 0u) << cursor.cycle();
  }
  EXPECT_TRUE(both);
}

}  // namespace
}  // namespace meltstage::app
