// SPDX-License-Identifier: Apache-2.0
// What functional vectors show of a netlist, told by module, by piece and line by line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "asic/dft/atpg/functional.hpp"
#include "asic/dft/core/cycles.hpp"

namespace meltstage::app {

// Lines that function cannot move or show, and why. Names of flops and ports; with [ or a dot at their end
// the beginnings of names. `flops` are said to keep their reset value, input ports among them to stay at 0:
// what cannot move then, by three-valued simulation from reset, has this reason. `near` are lines that have
// it because of where they are: the flop or port that they reach first. `unseen` are flops and ports whose
// values function cannot show: lines that lead to no others. `words` are flops NAME index][bit] (NAME ends in
// [) that hold words of a code: in each word the sum modulo 2 of the bits of each of `parities` is always
// that after reset. Lines that have one level then, whatever else is free, have the reason: proved by
// CaDiCaL.
struct Unreached {
  std::vector<std::string> flops, near, unseen, words;
  std::vector<std::vector<unsigned>> parities;
  std::string reason;
};
// [[unreached]] tables with these keys. Throws UserError.
std::vector<Unreached> read_unreached(const std::filesystem::path& path);

struct ModuleGrade {
  std::size_t faults = 0, detected = 0, hidden = 0;
  std::size_t outputs = 0, toggled = 0, unreached = 0;  // of cells
};
struct GradeReport {
  std::map<std::string, ModuleGrade> modules;
  std::size_t unreached = 0;  // cell outputs that don't toggle, with a reason
  std::size_t hidden = 0;     // faults that are not detected, with a reason
  std::map<std::string, std::pair<std::size_t, std::size_t>> reasons;  // how many outputs, faults each
  std::string text;  // a line a module, a piece, a fault, an output that doesn't toggle

  // 0..1, of the outputs that have no reason
  double toggle_of_reachable(const dft::ToggleCoverage& toggle) const {
    return static_cast<double>(toggle.toggled) / static_cast<double>(toggle.lines - unreached);
  }
  // 0..1, of the faults that have no reason
  double coverage_of_visible(std::size_t detected, std::size_t faults) const {
    return static_cast<double>(detected) / static_cast<double>(faults - hidden);
  }
};
// `verdicts`: of each fault of `sample`. Throws UserError when a line moves that is said to stand
// still.
GradeReport grade_report(const dft::Netlist& netlist, const dft::CaptureView& view,
                         const dft::CycleStream& stream, const std::vector<dft::Fault>& sample,
                         const std::vector<dft::FaultClass>& verdicts, const dft::FunctionalGrade& grade,
                         const std::vector<Unreached>& unreached);

}  // namespace meltstage::app
