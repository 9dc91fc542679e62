// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace meltstage {

/// A folder for this process alone for as long as the object lives, among those that ask for it. The lock
/// ends with the process, however that ends. A file system without locks (some network ones) grants it
/// always.
class FolderLock {
 public:
  /// @throws UserError when another process has it.
  explicit FolderLock(const std::filesystem::path& folder);
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();

 private:
  int folder_;  // open, locked
};

}  // namespace meltstage
