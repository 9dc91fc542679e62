// SPDX-License-Identifier: Apache-2.0
#include "app/whole_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <system_error>

#include "app/job_file.hpp"

namespace meltstage::app {

void write_whole(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path partial = path.string() + fmt::format(".partial.{}", getpid());
  std::ofstream file(partial, std::ios::binary);
  file << text;
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(partial, path, error);
  if (!file || error) {
    std::filesystem::remove(partial, error);
    throw InputError(fmt::format("{}: can't be written, expected a place for a new file", path.string()));
  }
}

}  // namespace meltstage::app
