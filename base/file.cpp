// SPDX-License-Identifier: Apache-2.0
#include "base/file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "base/error.hpp"
#include "base/output_name.hpp"
#include "base/place.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, std::string_view defect, std::string_view wanted) {
  throw UserError(fmt::format("{}: {}, expected {}", path.string(), defect, wanted));
}

// Only a regular file ends: a pipe may wait for ever, and a device gives bytes without end.
void require_regular(const fs::path& path, std::string_view wanted) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  switch (status.type()) {
    case fs::file_type::regular:
      return;
    case fs::file_type::not_found:
      fail(path, "no such file", wanted);
    case fs::file_type::directory:
      fail(path, "found a folder", wanted);
    case fs::file_type::none:
      fail(path, fmt::format("can't be read ({})", error.message()), wanted);
    default:
      fail(path, "found a pipe, a socket or a device",
           fmt::format("{}; save what it gives as a file and name that", wanted));
  }
}

}  // namespace

std::string read_file(const fs::path& path, std::string_view wanted, std::uint64_t most_bytes) {
  require_regular(path, wanted);
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, fmt::format("can't be opened ({})", std::generic_category().message(errno)), wanted);
  std::string text;
  // in pieces that grow: files of the kernel don't tell their size, and another program may be writing to
  // this one
  while (file) {
    const std::size_t before = text.size();
    const std::size_t piece = std::clamp(before, std::size_t{1} << 12, std::size_t{1} << 18);
    text.resize(before + piece);
    file.read(text.data() + before, static_cast<std::streamsize>(piece));
    text.resize(before + static_cast<std::size_t>(file.gcount()));
    if (text.size() > most_bytes)
      fail(path, fmt::format("found more than {} bytes", most_bytes),
           fmt::format("{} of at most so many", wanted));
  }
  if (file.bad())
    fail(path, fmt::format("can't be read to its end ({})", std::generic_category().message(errno)), wanted);
  return text;
}

std::string_view describe_content(std::string_view content) {
  struct Magic {
    std::string_view bytes, name;
  };
  using namespace std::string_view_literals;
  static constexpr Magic kKnown[] = {
      {"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1"sv, "an OLE2 file (.xls, .doc and others)"},
      {"\x89PNG"sv, "a PNG image"},
      {"PK\x03\x04"sv, "a ZIP archive (.xlsx, .ods and others)"},
      {"%PDF"sv, "a PDF document"},
      {"\xFF\xD8\xFF"sv, "a JPEG image"},
      {"GIF8"sv, "a GIF image"},
      {"\x1F\x8B"sv, "gzip data"},
      {"<!DOCTYPE html"sv, "an HTML page"},
      {"\x7F"
       "ELF"sv,
       "a program"},
      {"\xFF\xFE"sv, "UTF-16 text"},
      {"\xFE\xFF"sv, "UTF-16 text"},
  };
  for (const Magic& magic : kKnown)
    if (content.starts_with(magic.bytes)) return magic.name;
  return content.find('\0') == std::string_view::npos ? "text" : "binary data";
}

void require_other_file(const fs::path& output, const std::vector<fs::path>& inputs) {
  require_name_to_write(output);
  for (const fs::path& input : inputs) {
    std::error_code ignored;  // the output may not be there yet
    if (fs::equivalent(output, input, ignored))
      throw UserError(
          fmt::format("{}: would be written over the input {}, expected another file; choose "
                      "another name for what is written",
                      output.string(), input.string()));
  }
}

void require_other_files(const std::vector<fs::path>& outputs, const std::vector<fs::path>& inputs) {
  std::error_code ignored;  // none needs to be there
  std::vector<fs::path> wholes;
  for (const fs::path& output : outputs) {
    if (output.empty()) continue;
    require_other_file(output, inputs);
    const fs::path whole = fs::weakly_canonical(fs::absolute(output, ignored), ignored);
    if (std::find(wholes.begin(), wholes.end(), whole) != wholes.end())
      throw UserError(
          fmt::format("{}: would be written twice, expected another file each", escaped(output.string())));
    wholes.push_back(whole);
  }
}

void require_outside(const fs::path& folder, const std::vector<fs::path>& inputs) {
  require_name_to_write(folder);
  std::error_code ignored;  // neither needs to be there
  const fs::path whole = fs::weakly_canonical(folder / "", ignored);
  for (const fs::path& input : inputs) {
    const fs::path file = fs::weakly_canonical(input, ignored);
    // A path that ends with a separator has an empty last part.
    const auto [end, rest] = std::mismatch(whole.begin(), whole.end(), file.begin(), file.end());
    if (end == whole.end() || end->empty())
      throw UserError(
          fmt::format("{}: would be replaced, and the input {} lies in it; choose another folder for what "
                      "is written",
                      folder.string(), input.string()));
  }
}

}  // namespace meltstage
