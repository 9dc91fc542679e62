// SPDX-License-Identifier: Apache-2.0
// A short run that has everything in it that a window border could cut through, and where that is.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "cmodel/chip.hpp"
#include "recording/stream.hpp"

namespace meltstage::tb {

struct Recording {
  recording::Stream pins;                          // the chip's, cycle 0 in reset
  std::map<std::string, std::uint64_t> landmarks;  // first cycle of what the name says
  chip::Chip end;                                  // behind the last clock
};

// 240 ms: settings and commit over the serial line, heating, polls, telemetry, reset in mid-frame, inhibit.
// Made once.
const Recording& lively_recording();

// A folder that goes away with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

std::string text_of(const std::filesystem::path& path);
void set_text(const std::filesystem::path& path, const std::string& text);
// A state file with its last line made to fit its content again.
std::string sealed_state(std::string text);

}  // namespace meltstage::tb
