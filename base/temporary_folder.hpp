// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace meltstage {

/// A folder of this process's own among the system's temporary files, removed with all that is in it. Those
/// that killed processes left behind are removed when a new one is made.
class TemporaryFolder {
 public:
  /// @throws UserError when it can't be made.
  TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder();

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

}  // namespace meltstage
