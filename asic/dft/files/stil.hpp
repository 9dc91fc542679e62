// SPDX-License-Identifier: Apache-2.0
// STIL (IEEE 1450.0-1999): writing in the shape that TetraMAX gives it or flat (a V statement a cycle), and
// reading.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "asic/dft/core/cycles.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

/// Signals, timing, chains, procedures load_unload, multiclock_capture and reset_pulse, and a Call for each
/// load and capture. @throws UserError for a name that STIL can't hold.
std::string stil_text(const ScanTest& test);
/// Flat: one V statement a cycle, no procedures; equal cycles are a Loop.
std::string flat_stil_text(const CycleStream& stream);

/// A defect of a STIL file; what() is "file:line:column: found ..., expected ...".
class StilError : public UserError {
 public:
  StilError(const std::string& message, std::size_t line) : UserError(message), line_(line) {}
  std::size_t line() const { return line_; }

 private:
  std::size_t line_;
};

/// Reads what docs/make/formats/stil.md lists and expands it into cycles. Every name must be defined, data
/// must have the length of its signals or chain. A Loop of one V becomes one counted cycle; there may be
/// `most_cycles` others. An Include is looked for beside the file; a text that is no file can have none.
/// Throws StilError.
CycleStream parse_stil(std::string_view text, const std::string& name, std::size_t most_cycles = kMostCycles);
CycleStream read_stil(const std::filesystem::path& path);

}  // namespace meltstage::dft
