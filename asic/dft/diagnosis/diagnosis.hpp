// SPDX-License-Identifier: Apache-2.0
// From a tester's fail log back to the spot in the netlist.
//
// A line of the netlist explains a failing pattern when a wrong level on it, and nothing else, makes exactly
// those strobes fail that did (single location at a time, Bartenstein et al., "Diagnosing combinational logic
// designs using the single location at-a-time (SLAT) paradigm", ITC 2001). So no fault model is needed to
// find a line; afterwards the patterns that it explains, and those in which it would have shown and nothing
// failed, tell how the line behaves.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/circuit.hpp"
#include "asic/dft/core/patterns.hpp"
#include "asic/dft/diagnosis/defect.hpp"
#include "asic/dft/diagnosis/fail_log.hpp"
#include "asic/dft/scan/scan_test.hpp"

namespace meltstage::dft {

/// How a line behaves, the plainest first.
enum class Behaviour : std::uint8_t {
  stuck_at_0,
  stuck_at_1,
  slow_to_rise,  ///< 0 where it was 0 in the cycle before
  slow_to_fall,
  dominated_by,   ///< it has the level of another line: a bridge
  wired_and,      ///< 0 where another line is 0
  wired_or,       ///< 1 where another line is 1
  cell_internal,  ///< wrong for some levels at its cell's inputs, always then
  falls_to_0,     ///< wrong at 1 alone, and not always
  rises_to_1,     ///< wrong at 0 alone, and not always
  unsteady        ///< wrong at both levels, by no rule that was tried
};
const char* to_string(Behaviour behaviour);

/// A line that explains failing patterns.
struct Suspect {
  Line line;
  Behaviour behaviour = Behaviour::unsteady;
  std::vector<Node> others = {};  ///< of a bridge: lines that may be the other one; at most kMostOthers
  std::size_t explained = 0;      ///< failing patterns that the line explains
  std::size_t contradicted = 0;   ///< passing patterns in which the behaviour would have shown
  friend bool operator==(const Suspect&, const Suspect&) = default;
};
inline constexpr std::size_t kMostOthers = 8;
inline constexpr std::size_t kMostDefects = 4;

/// Whether b ranks behind a. Of two suspects of which neither does, these patterns can't tell which it is.
bool ranks_before(const Suspect& a, const Suspect& b);

/// Suspects for one defect, best first. `explained` counts what no defect before it explains.
struct DefectFound {
  std::vector<Suspect> suspects;
};

struct Diagnosis {
  std::size_t failing_patterns = 0, passing_patterns = 0;
  std::size_t unexplained_patterns = 0;  ///< failing, by no single line of those found
  std::size_t elsewhere = 0;             ///< failed strobes outside captures: of chain and reset tests
  std::vector<DefectFound> defects;      ///< the one that explains most first; at most kMostDefects
};

class Diagnoser {
 public:
  /// `captures`: of the stream that the logs are of. Lines are the circuit's sites. Other lines of a bridge
  /// are looked for among `neighbours` (by node), or, where that is empty, all.
  Diagnoser(const Circuit& circuit, Captures captures, std::vector<std::vector<Node>> neighbours = {});
  Diagnosis diagnose(const FailLog& log) const;

 private:
  friend class Case;
  const Circuit& circuit_;
  Captures captures_;
  std::vector<std::vector<Node>> neighbours_;
  std::vector<PatternBlock> blocks_;
  std::vector<std::vector<Word>> good_;         // by block, by node
  std::vector<std::vector<Word>> before_;       // likewise in the cycle before the capture
  std::vector<Line> lines_;                     // one for each site that no other line stands for
  std::vector<std::vector<Node>> cell_inputs_;  // by line: what drives the inputs of the cell that drives it
  std::vector<Node> nets_;                      // that a bridge may join
};

}  // namespace meltstage::dft
