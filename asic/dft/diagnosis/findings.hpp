// SPDX-License-Identifier: Apache-2.0
// All that a fail log tells of a chip: broken chains, else lines behind wrong captures, else lost resets.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "asic/dft/diagnosis/chain_diagnosis.hpp"
#include "asic/dft/diagnosis/diagnosis.hpp"
#include "asic/dft/diagnosis/fail_log.hpp"
#include "asic/dft/diagnosis/program_on_netlist.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

/// Names of a circuit's lines.
class LineNames {
 public:
  explicit LineNames(const Circuit& circuit);
  /// The site: "CELL/PIN" or a port.
  std::string of(const Line& line) const;
  /// The output that drives the line: one name for all lines of a net.
  std::string net_of(const Line& line) const;

 private:
  const Circuit& circuit_;
  std::map<Line, std::string> names_;
};

/// A defect of a chain or reset whose log is less alike the chip's is not to blame.
inline constexpr double kLeastAgreement = 0.5;

struct Findings {
  std::vector<BrokenChain> chains;  ///< where there are some, nothing else is looked for
  Diagnosis captures;
  std::vector<ChainSuspect> resets;  ///< looked for where no capture is wrong
  /// Nets to blame, best first; those that the log can't tell apart are one entry.
  std::vector<std::vector<std::string>> blamed;
};

/// One program's logs. The program must outlive it.
class LogReader {
 public:
  explicit LogReader(const ProgramOnNetlist& program);
  Findings findings(const FailLog& log, const Progress& progress = {}) const;
  const LineNames& lines() const { return lines_; }            ///< of captures
  const LineNames& lines_of_chip() const { return of_chip_; }  ///< of chains and resets

 private:
  const ProgramOnNetlist& program_;
  Diagnoser diagnoser_;
  LineNames lines_, of_chip_;
};

}  // namespace meltstage::dft
