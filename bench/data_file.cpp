// SPDX-License-Identifier: Apache-2.0
#include "bench/data_file.hpp"

#include <fmt/format.h>

#include "base/error.hpp"

namespace meltstage::app {

namespace fs = std::filesystem;

namespace {
fs::path folder_of_program() { return fs::read_symlink("/proc/self/exe").parent_path(); }
}  // namespace

fs::path data_file(const std::string& name, const std::string& remedy) {
  const fs::path here = folder_of_program();
  const fs::path beside = here / "data" / name, installed = here.parent_path() / "share/meltstage" / name;
  for (const fs::path& path : {beside, installed})
    if (fs::exists(path)) return path;
  throw UserError(fmt::format("{}: isn't there, nor is {}; {}", beside.string(), installed.string(), remedy));
}

fs::path checkout_with(const fs::path& part) {
  for (const fs::path& from : {folder_of_program(), fs::current_path()}) {
    for (fs::path folder = from;; folder = folder.parent_path()) {
      if (fs::exists(folder / part)) return folder;
      if (folder == folder.parent_path()) break;
    }
  }
  throw UserError(
      fmt::format("{}: found in no folder above {} or {}, expected the project's sources; "
                  "change into a checkout of the project",
                  part.string(), folder_of_program().string(), fs::current_path().string()));
}

}  // namespace meltstage::app
