// SPDX-License-Identifier: Apache-2.0
// The folder that `meltstage print` writes.
#pragma once

#include <filesystem>
#include <optional>

#include "base/output_file.hpp"

namespace meltstage::app {

/// Gets its name only when it is complete. It takes the place of an empty folder or of an earlier print, and
/// of nothing else: throws UserError for a folder that holds one file more than a print writes, or the
/// summary of another program.
class PrintFolder {
 public:
  explicit PrintFolder(std::filesystem::path target);

  std::filesystem::path file(const char* name) const { return partial_->path() / name; }
  void publish();

 private:
  std::filesystem::path target_;
  std::optional<PartialFolder> partial_;
};

}  // namespace meltstage::app
