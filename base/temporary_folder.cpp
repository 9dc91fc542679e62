// SPDX-License-Identifier: Apache-2.0
#include "base/temporary_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <regex>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/path_lock.hpp"
#include "base/place.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "meltstage.";  // then the process, a dot and what makes it unique
constexpr std::string_view kTakenByNoTool = " \t\r\n\"'`$;#&|<>*?[]{}()!\\";

bool is_of_a_dead_process(const fs::path& folder) {
  static const std::regex kName(
      "meltstage\\.([0-9]+)\\.[A-Za-z0-9]{6}");  // kPrefix, and what mkdtemp() makes
  std::smatch part;
  const std::string name = folder.filename().string();
  if (!std::regex_match(name, part, kName)) return false;
  const auto process = number_in<pid_t>(part[1].str(), 1, std::numeric_limits<pid_t>::max());
  return process && kill(*process, 0) != 0 && errno == ESRCH;
}

// What a process that was killed has left: this user's, and locked by nobody, since on another machine that
// shares the folder the process may live.
void remove_left_behind(const fs::path& parent) {
  std::error_code ignored;
  for (fs::directory_iterator entry(parent, ignored), end; !ignored && entry != end;
       entry.increment(ignored)) {
    if (!is_of_a_dead_process(entry->path())) continue;
    const int lock = detail::lock_of(entry->path(), O_DIRECTORY);
    if (lock < 0) continue;
    struct stat owner {};
    if (std::error_code kept; fstat(lock, &owner) == 0 && owner.st_uid == geteuid())
      fs::remove_all(entry->path(), kept);
    close(lock);
  }
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::error_code problem;
  const fs::path named = fs::temp_directory_path(problem);
  if (problem) throw UserError(fmt::format("TMPDIR: {}, expected a folder", problem.message()));
  const fs::path parent = fs::absolute(named);  // tools work in it from elsewhere
  if (parent.string().find_first_of(kTakenByNoTool) != std::string::npos)
    throw UserError(
        fmt::format("TMPDIR: {}: found blanks or signs that tools at work there don't take, expected a "
                    "path of letters, digits and ._-+/; give another one",
                    escaped(parent.string())));
  remove_left_behind(parent);
  std::string name = (parent / fmt::format("{}{}.XXXXXX", kPrefix, getpid())).string();
  if (mkdtemp(name.data()) == nullptr)
    throw UserError(
        fmt::format("{}: {}, expected room for temporary files", parent.string(), std::strerror(errno)));
  path_ = name;
  lock_ = detail::lock_of(path_, O_DIRECTORY);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  if (lock_ >= 0) close(lock_);
}

}  // namespace meltstage
