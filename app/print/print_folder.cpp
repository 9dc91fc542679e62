// SPDX-License-Identifier: Apache-2.0
#include "app/print/print_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "app/print/report/report.hpp"
#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 4> kFiles = {"report.html", "summary.json", "pins.mvec", "pins.vcd"};

bool is_own(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  if (!entry.is_regular_file() || entry.is_symlink()) return false;
  if (std::find(kFiles.begin(), kFiles.end(), name) == kFiles.end()) return false;
  return name != "summary.json" || is_summary(read_file(entry.path(), "a summary"));
}

void require_replaceable(const fs::path& folder) {
  if (!fs::exists(fs::symlink_status(folder))) return;
  if (!fs::is_directory(folder))
    throw UserError(
        fmt::format("{}: found what is no folder, expected the name of a folder to write; choose "
                    "another --out",
                    folder.string()));
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (!is_own(entry))
      throw UserError(
          fmt::format("{}: was not written by `meltstage print`, and its folder would be replaced; choose "
                      "another --out, or move it away",
                      entry.path().string()));
}

}  // namespace

PrintFolder::PrintFolder(fs::path target) : target_(std::move(target)) {
  require_replaceable(target_);
  partial_.emplace(target_);
}

void PrintFolder::publish() {
  require_replaceable(target_);  // a print takes minutes, in which somebody may have put a file there
  partial_->publish();
}

}  // namespace meltstage::app
