// SPDX-License-Identifier: Apache-2.0
// Component positions out of KiCad's placement file (.pos): one bump at the place of every footprint.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/file.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

std::vector<std::string_view> words_of(const std::filesystem::path& path, std::size_t row,
                                       std::string_view line) {
  constexpr std::size_t kMostWords = 1000;
  std::vector<std::string_view> words;
  for (line = trimmed(line); !line.empty(); line = trimmed(line)) {
    if (words.size() == kMostWords)
      fail(path, fmt::format("row {}: found more than {} words, expected Ref Val Package PosX PosY Rot Side",
                             row, kMostWords));
    const auto end = line.find_first_of(" \t");
    words.push_back(line.substr(0, end));
    line.remove_prefix(words.back().size());
  }
  return words;
}

class PosFile {
 public:
  explicit PosFile(const std::filesystem::path& path) : path_(path) { result_.has_unit = true; }

  void add(const Line& line) {
    const std::string_view text = trimmed(line.text);
    if (text.empty()) return;
    if (ended_row_ != 0 && !text.starts_with('#'))
      fail(path_, fmt::format("row {}: found {}, expected nothing behind '## End' in row {}", line.number,
                              in_quotes(text), ended_row_));
    if (text.starts_with('#')) {
      read_comment(line.number, text);
      return;
    }
    if (unit_mm_ == 0.0)
      fail(path_,
           fmt::format(
               "row {}: found {} before a line '## Unit = mm, ...', expected a placement file of KiCad",
               line.number, in_quotes(text)));
    // Ref Val Package PosX PosY Rot Side; counted from the end, as a value may hold blanks.
    constexpr std::size_t kBehindX = 4, kFewest = 6;
    const auto words = words_of(path_, line.number, text);
    if (words.size() < kFewest)
      fail(path_, fmt::format("row {}: found {} words, expected Ref Val Package PosX PosY Rot Side",
                              line.number, words.size()));
    const std::size_t x = words.size() - kBehindX;
    sides_.check(path_, fmt::format("row {}", line.number), words.back());
    result_.points.push_back({number(line.number, words[x], "PosX") * unit_mm_,
                              number(line.number, words[x + 1], "PosY") * unit_mm_, line.number});
    check_point_count(path_, result_.points.size());
  }

  RawPoints finish() && {
    if (ended_row_ == 0)
      fail(path_, "the file ends without its last line '## End', expected it; the file may be cut off");
    result_.bottom = sides_.is_bottom();
    return std::move(result_);
  }

 private:
  void read_comment(std::size_t row, std::string_view text) {
    const auto words = words_of(path_, row, text);
    if (words.size() >= 2 && words[1] == "End" && ended_row_ == 0) ended_row_ = row;
    if (words.size() < 4 || words[1] != "Unit") return;
    std::string_view unit = words[3];
    if (unit.ends_with(',')) unit.remove_suffix(1);
    if (unit == "mm")
      unit_mm_ = 1.0;
    else if (unit == "inches" || unit == "in")
      unit_mm_ = kInch_mm;
    else
      fail(path_, fmt::format("row {}: found unit {}, expected mm or inches", row, in_quotes(unit)));
  }

  double number(std::size_t row, std::string_view word, std::string_view name) const {
    const auto value = parse_number(word);
    if (!value || !std::isfinite(*value))
      fail(path_,
           fmt::format("row {} ({}): found {}, expected a number such as 12.5", row, name, in_quotes(word)));
    return *value;
  }

  const std::filesystem::path& path_;
  RawPoints result_;
  double unit_mm_ = 0.0;
  std::size_t ended_row_ = 0;
  OneSide sides_;
};

}  // namespace

RawPoints read_pos_points(const std::filesystem::path& path, std::string_view content) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected a placement file of KiCad (.pos)", kind));
  PosFile file(path);
  for_lines(without_byte_order_mark(content), [&](const Line& line) { file.add(line); });
  return std::move(file).finish();
}

}  // namespace meltstage::motion::detail
