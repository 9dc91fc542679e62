// SPDX-License-Identifier: Apache-2.0
#include "base/file.hpp"

#include <fmt/format.h>

#include <fstream>

#include "base/error.hpp"

namespace meltstage {

std::string read_file(const std::filesystem::path& path, std::string_view wanted, std::uint64_t most_bytes) {
  std::error_code ignored;
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path, ignored))
    throw UserError(fmt::format("{}: can't be read, expected {}", path.string(), wanted));
  std::string text;
  constexpr std::size_t kPiece = 1 << 20;
  // in pieces: a device or a pipe doesn't tell its size
  while (file) {
    const std::size_t before = text.size();
    text.resize(before + kPiece);
    file.read(text.data() + before, kPiece);
    text.resize(before + static_cast<std::size_t>(file.gcount()));
    if (text.size() > most_bytes)
      throw UserError(fmt::format("{}: found more than {} bytes, expected {} of at most so many",
                                  path.string(), most_bytes, wanted));
  }
  if (file.bad()) throw UserError(fmt::format("{}: can't be read, expected {}", path.string(), wanted));
  return text;
}

}  // namespace meltstage
