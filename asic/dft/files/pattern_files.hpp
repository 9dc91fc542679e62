// SPDX-License-Identifier: Apache-2.0
// Patterns of other formats read back into cycles: WGL, VCD and extended VCD.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "asic/dft/core/cycles.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

/// A defect of a pattern file; what() is "file:line:column: found ..., expected ...".
class PatternFileError : public UserError {
 public:
  PatternFileError(const std::string& message, std::size_t line) : UserError(message), line_(line) {}
  std::size_t line() const { return line_; }

 private:
  std::size_t line_;
};

/// WGL: signal, timeplate, scancell, scanchain, scanstate, pattern with vector, repeat and scan. One
/// timeplate. Scan rows are shifted out into cycles, `most_cycles` in all.
CycleStream parse_wgl(std::string_view text, const std::string& name, std::size_t most_cycles = kMostCycles);

/// Direction of the signals of a plain VCD, which has none: true for inputs of the device.
using Directions = std::map<std::string, bool>;

/// Throws UserError when times don't lie within the period, or the period not between 1 ps and 1 s.
void require_timing(const TestTiming& timing, const std::string& name);

/// VCD or extended VCD ($var port) of a device's ports, sampled with `timing`: inputs change at drive_ns of a
/// cycle, a clock pulse is high from clock_rise_ns to clock_fall_ns, an output's value at strobe_ns is what
/// is expected (x, z: not compared). A change of an input anywhere else is refused. `directions` names the
/// ports of a plain VCD; what it leaves out is passed over.
CycleStream parse_dump(std::string_view text, const std::string& name, const TestTiming& timing,
                       const Directions& directions = {});

}  // namespace meltstage::dft
