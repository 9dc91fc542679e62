// SPDX-License-Identifier: Apache-2.0
// The masking report: each strobe that is not made stands in it once, with its reason.
#include "asic/dft/scan/masks.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/files/formats.hpp"
#include "asic/dft/files/pattern_files.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

using testing::HasSubstr;

std::string until_space(const std::string& text) { return text.substr(0, text.find(' ')); }

// Cycle and output of every X of a stream.
std::multiset<std::pair<std::uint64_t, std::string>> open_strobes(const CycleStream& counted) {
  std::multiset<std::pair<std::uint64_t, std::string>> open;
  const CycleStream stream = unrolled(counted);
  for (std::size_t i = 0; i < stream.cycles.size(); ++i) {
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      if (!stream.signals[s].is_input && stream.cycles[i].states[s] == 'X')
        open.emplace(i, stream.signals[s].name);
    }
  }
  return open;
}
std::multiset<std::pair<std::uint64_t, std::string>> reported(const std::vector<MaskedStrobes>& masked) {
  std::multiset<std::pair<std::uint64_t, std::string>> told;
  for (const MaskedStrobes& entry : masked) {
    for (std::uint64_t c = 0; c < entry.cycles; ++c) {
      for (const std::string& output : entry.outputs)
        told.emplace(entry.first_cycle + c, until_space(output));
    }
  }
  return told;
}

struct Machine {
  ScanDesign design = insert_scan(circuit_netlist("machine"), mini_library(), {.chains = 5});
  CaptureView view = scan_view(design, mini_library());
  ScanTest stuck = make_scan_test(design, view, generate_tests(view.circuit).patterns, "machine");
  TransitionView transitions = launch_on_capture(view);
  ScanTest speed =
      make_transition_test(design, view, transitions,
                           generate_tests(transitions.circuit, transitions.faults, {}).patterns, "machine");
};
const Machine& machine() {
  static const Machine the_machine;
  return the_machine;
}

TEST(Masks, EveryOpenStrobeIsToldOnce) {
  for (const ScanTest* test : {&machine().stuck, &machine().speed}) {
    const CycleStream stream = expand(*test);
    const auto masked = masked_strobes(stream, "scan_en_i");
    EXPECT_TRUE(reported(masked) == open_strobes(stream));
    EXPECT_EQ(summary(masked).masked, open_strobes(stream).size());
    // The same from every file; the STIL file doesn't name the macro of the first cycles.
    const auto stil = masked_strobes(parse_stil(stil_text(*test), "x"), "scan_en_i");
    EXPECT_TRUE(reported(stil) == reported(masked));
    EXPECT_EQ(summary(stil).reasons, summary(masked).reasons);
    EXPECT_TRUE(mask_text(masked_strobes(parse_wgl(wgl_text(*test), "x"), "scan_en_i")) == mask_text(masked));
  }
}

TEST(Masks, ReasonsFollowFromTheStream) {
  const ScanTest& test = machine().stuck;
  const auto masked = masked_strobes(expand(test), "scan_en_i");
  const auto stuck = summary(masked).reasons;
  const std::size_t outputs = test.signals.size() - test.input_count(), length = test.chain_length(),
                    loads = test.patterns.size() + 1;
  std::size_t shorter = 0;
  for (const ScanChain& chain : test.chains) shorter += length - chain.cells.size();
  ASSERT_GT(shorter, 0u);
  const auto count = [](const auto& reasons, const std::string& begin) {
    const auto found = reasons.lower_bound(begin);
    return found == reasons.end() || found->first.rfind(begin, 0) != 0 ? 0 : found->second;
  };
  EXPECT_EQ(count(stuck, "power-up: no load"), 2 * outputs);  // reset on, reset off
  EXPECT_EQ(count(stuck, "power-up: the chain"), test.chains.size() * length);
  EXPECT_EQ(count(stuck, "shift"), loads * (outputs + length * (outputs - test.chains.size())));
  EXPECT_EQ(count(stuck, "unload: all cells"), (loads - 1) * shorter);
  EXPECT_EQ(count(stuck, "between"), 2 * outputs);  // reset test
  EXPECT_EQ(stuck.size(), 5u);
  EXPECT_THAT(mask_text(masked), HasSubstr("(chain test): "));

  const auto launches = static_cast<std::size_t>(
      std::count_if(machine().speed.patterns.begin(), machine().speed.patterns.end(),
                    [](const ScanPattern& pattern) { return pattern.action == Action::launch; }));
  const auto speed = summary(masked_strobes(expand(machine().speed), "scan_en_i")).reasons;
  EXPECT_EQ(count(speed, "launch"), launches * outputs);
  EXPECT_EQ(count(speed, "capture at speed"), count(speed, "launch"));
}

// One more X is one more strobe in the report, by name.
TEST(Masks, AStrobeTakenOutIsNamed) {
  CycleStream stream = expand(machine().stuck);
  const auto before = summary(masked_strobes(stream, "scan_en_i"));
  const auto signal = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find_if(stream.signals.begin(), stream.signals.end(),
                                                 [&](const TestSignal& s) { return s.name == name; }) -
                                    stream.signals.begin());
  };
  const std::size_t enable = signal("scan_en_i"), port = signal("busy_o"), chain = signal("scan_o[1]");
  std::size_t at = stream.cycles.size() / 2;
  while (stream.cycles[at].states[enable] == '1') ++at;  // a capture, then its unload
  ASSERT_NE(stream.cycles[at].states[port], 'X');
  ASSERT_NE(stream.cycles[at + 3].states[chain], 'X');
  stream.cycles[at].states[port] = 'X';
  stream.cycles[at + 3].states[chain] = 'X';
  const auto masked = masked_strobes(stream, "scan_en_i");
  EXPECT_EQ(summary(masked).masked, before.masked + 2);
  const auto& cells = machine().design.chains[1].cells;
  EXPECT_THAT(mask_text(masked), HasSubstr(": busy_o: capture: the file expects no value here\n"));
  EXPECT_THAT(mask_text(masked),
              HasSubstr("scan_o[1] (" + cells[cells.size() - 2] + "): unload: the file expects"));
}

TEST(Masks, WithoutChainsNothingIsClaimed) {
  CycleStream stream;
  stream.signals = {{"clk", true}, {"q", false}, {"r", false}};
  stream.cycles = {{"PXX", "reset", 3}, {"PHX", "work"}, {"PHL", ""}, {"0XL", "", 2}};
  const auto masked = masked_strobes(stream, "scan_en_i");
  EXPECT_EQ(mask_text(masked),
            "cycles 0 to 2 (reset): q r: the file expects no value here\n"
            "cycle 3 (work): r: the file expects no value here\n"
            "cycles 5 to 6 (work): q: the file expects no value here\n");
  EXPECT_EQ(summary(masked).masked, 9u);
}

}  // namespace
}  // namespace meltstage::dft
