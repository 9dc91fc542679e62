// SPDX-License-Identifier: Apache-2.0
// Runs that are kept: a folder with a CSV file for each start of the server.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "app/live/reading.hpp"

namespace meltstage::app::live {

/// The file of the run that goes on, named by its date. Lines are whole: each is handed to the system at
/// once, and a part of one that didn't fit is taken back.
class RunFile {
 public:
  /// A new file in that folder, which is made where it is missing. Throws UserError.
  explicit RunFile(const std::filesystem::path& folder);
  ~RunFile();
  RunFile(const RunFile&) = delete;
  RunFile& operator=(const RunFile&) = delete;

  const std::string& name() const { return name_; }
  /// Returns why the sample can't be kept (a full disk), empty when it is.
  std::string add(const Sample& sample);

 private:
  std::string append(std::string_view line);

  std::string name_;
  int file_ = -1;
  std::int64_t size_ = 0;  // of whole lines
};

/// What a run's name looks like, as a regular expression (ECMAScript) without groups: no other file is read.
inline constexpr std::string_view kRunName = R"(run_\d{4}-\d\d-\d\d_\d{6}(?:_\d+)?\.csv)";

/// JSON: [{"name": ..., "bytes": ...}, ...], the newest first, 1000 at most.
std::string runs_json(const std::filesystem::path& folder);

/// JSON as Samples::json(), of some 2000 rows at most, evenly taken. Lines that are none of ours are left
/// out. Throws UserError for a file that isn't there or no regular one.
std::string run_json(const std::filesystem::path& folder, const std::string& name);

}  // namespace meltstage::app::live
