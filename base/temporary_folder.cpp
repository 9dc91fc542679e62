// SPDX-License-Identifier: Apache-2.0
#include "base/temporary_folder.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "base/number.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "meltstage.";  // then the process, a dot and what makes it unique

bool is_of_a_dead_process(const fs::path& folder) {
  std::string name = folder.filename().string();
  if (!name.starts_with(kPrefix)) return false;
  name.erase(0, kPrefix.size());
  const auto process = number_in<pid_t>(name.substr(0, name.find('.')), 1, std::numeric_limits<pid_t>::max());
  return process && name.find('.') != std::string::npos && kill(*process, 0) != 0 && errno == ESRCH;
}

// Other people's folders can't be removed, and needn't be.
void remove_left_behind(const fs::path& parent) {
  std::error_code ignored;
  for (fs::directory_iterator entry(parent, ignored), end; !ignored && entry != end; entry.increment(ignored))
    if (std::error_code kept; is_of_a_dead_process(entry->path())) fs::remove_all(entry->path(), kept);
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::error_code problem;
  const fs::path parent = fs::temp_directory_path(problem);
  if (problem) throw UserError(fmt::format("TMPDIR: {}, expected a folder", problem.message()));
  remove_left_behind(parent);
  std::string name = (parent / fmt::format("{}{}.XXXXXX", kPrefix, getpid())).string();
  if (mkdtemp(name.data()) == nullptr)
    throw UserError(
        fmt::format("{}: {}, expected room for temporary files", parent.string(), std::strerror(errno)));
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace meltstage
