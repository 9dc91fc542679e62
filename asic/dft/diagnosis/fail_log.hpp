// SPDX-License-Identifier: Apache-2.0
// What a tester tells of a chip that failed: the strobes that were not met.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "asic/dft/core/cycles.hpp"

namespace meltstage::dft {

/// A strobe that failed: cycle of the stream from 0, and the output signal's number in it.
struct FailedStrobe {
  std::uint64_t cycle = 0;
  std::size_t signal = 0;
  friend bool operator==(const FailedStrobe&, const FailedStrobe&) = default;
  friend auto operator<=>(const FailedStrobe&, const FailedStrobe&) = default;
};

struct FailLog {
  std::vector<FailedStrobe> fails;  ///< by cycle, then signal; none twice
  /// The tester's memory was full: what failed behind the last one's cycle is unknown, and in that cycle,
  /// too.
  bool truncated = false;
};

/// Our own text (docs/make/diagnosis.md): a line a failed strobe, and what ended it.
std::string fail_log_text(const FailLog& log, const CycleStream& stream);
/// Reads it. Throws UserError with file, line and column for what is no fail log of this stream: an unknown
/// signal, an input, a cycle that the stream has not or that compares nothing there.
FailLog parse_fail_log(std::string_view text, const std::string& name, const CycleStream& stream);
FailLog read_fail_log(const std::filesystem::path& path, const CycleStream& stream);

}  // namespace meltstage::dft
