// SPDX-License-Identifier: Apache-2.0
// Patterns of a scan design as a tester applies them: load, capture, unload.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "asic/dft/core/cycles.hpp"
#include "asic/dft/core/patterns.hpp"
#include "asic/dft/core/transition.hpp"
#include "asic/dft/scan/scan.hpp"

namespace meltstage::dft {

/// What a pattern does between its load and the unload that goes with the next load.
enum class Action {
  none,
  capture,
  launch,  ///< two clocks in a row, the second of which captures what the first launched
  reset
};

struct ScanPattern {
  Action action = Action::capture;
  std::vector<std::string> load;    ///< by chain, the bit shifted in first comes first
  std::vector<std::string> unload;  ///< by chain, L H X, the bit shifted out first comes first
  std::string inputs;               ///< by input signal in capture: 0 1 P
  std::string outputs;              ///< by output signal in capture: L H X
  std::string label;
};

struct ScanTest {
  std::string title;
  std::vector<TestSignal> signals;  ///< inputs, then outputs
  TestTiming timing;
  std::vector<ScanChain> chains;
  std::string clock, reset, scan_enable;  ///< names; reset may be empty
  bool reset_low = true;
  std::string idle_inputs;  ///< by input signal while shifting, but for scan enable, scan-in and clock
  std::vector<ScanPattern> patterns;

  std::size_t chain_length() const;  ///< of the longest
  std::size_t input_count() const;
};

/// Chain test (0011 through every chain), reset test (every flop away from its reset value, then reset
/// without a clock), and the patterns of `view` (the capture view of design.netlist with capture_holds) with
/// their expected values.
ScanTest make_scan_test(const ScanDesign& design, const CaptureView& view,
                        const std::vector<Pattern>& patterns, const std::string& title);

/// The same with patterns of transition faults (generate_tests() on transitions.circuit): each is clocked
/// twice, ports are not compared. The test speed is that of the stream's cycles.
ScanTest make_transition_test(const ScanDesign& design, const CaptureView& view,
                              const TransitionView& transitions, const std::vector<Pattern>& patterns,
                              const std::string& title);

/// What a tester does next: one cycle, or as many as the longest chain has cells, with a bit of `load` and of
/// `unload` in each at the chains' ports.
struct ScanStep {
  std::string states;  ///< by signal; at the chains' ports 0 and X where they are shifted
  std::string label;   ///< of the pattern that begins here
  const std::vector<std::string>* load = nullptr;    ///< null: one cycle. By chain, as in ScanPattern
  const std::vector<std::string>* unload = nullptr;  ///< null with a load: nothing is compared
};

/// All steps: reset, then load/capture of each pattern with the unload of the one before, then the last
/// unload. Shorter chains are loaded with leading zeros.
void for_each_step(const ScanTest& test, const std::function<void(const ScanStep&)>& take);
/// The same, cycle by cycle.
CycleStream expand(const ScanTest& test);

/// Gives chains to a stream that has none, as a dump: from then on its shifts are loads and unloads. Each
/// load gets a label. Throws UserError when ports are missing, nothing is shifted, or a load has fewer
/// clocks than the longest chain has cells.
void attach_chains(CycleStream& stream, std::vector<ScanChain> chains, const std::string& scan_enable);

/// Captures of a stream: clocks with scan enable off right behind a load.
struct Captures {
  std::vector<Pattern> patterns;  ///< by input of the view
  /// By input of the view, what it is in the cycle before, the last of the load. A cell at the end of a
  /// chain, whose level comes from before the load, is taken not to have moved.
  std::vector<Pattern> before;
  std::vector<Pattern> compared;  ///< by output of the view: 1 where the stream compares it
  /// By output of the view, the cycle in which it is compared; kNotCompared where it is not.
  std::vector<std::vector<std::uint32_t>> compared_in;
  static constexpr std::uint32_t kNotCompared = ~std::uint32_t{0};
  std::vector<std::size_t> compared_at;  ///< by output of the view: the signal that shows it
};

/// The other way: what the chains of a stream load, its ports drive, and its strobes compare. Throws
/// UserError when chains or ports are not those of the netlist.
Captures captures_of(const CaptureView& view, const CycleStream& stream, const std::string& scan_enable);

}  // namespace meltstage::dft
