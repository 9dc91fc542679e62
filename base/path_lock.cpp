// SPDX-License-Identifier: Apache-2.0
#include "base/path_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace meltstage::detail {

int lock_of(const std::filesystem::path& path, int kind) {
  const int file = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC | kind);
  if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  if (file >= 0) close(file);
  return -1;
}

}  // namespace meltstage::detail
