// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/xls_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "motion/bumps/number_formats.hpp"

namespace meltstage::motion::detail {
namespace {

template <class Number>
Number little_endian(std::string_view bytes, std::size_t at) {
  Number value = 0;
  for (std::size_t i = 0; i < sizeof(Number) && at + i < bytes.size(); ++i)
    value |= static_cast<Number>(static_cast<Number>(static_cast<unsigned char>(bytes[at + i])) << (8 * i));
  return value;
}
std::uint32_t u32(std::string_view bytes, std::size_t at) { return little_endian<std::uint32_t>(bytes, at); }
std::uint16_t u16(std::string_view bytes, std::size_t at) { return little_endian<std::uint16_t>(bytes, at); }

/// A file of files in sectors, as OLE2 has it.
class CompoundFile {
 public:
  explicit CompoundFile(std::string_view file) : file_(file) {
    const unsigned shift = u16(file_, 30);
    if (file_.size() < kHeader || shift < 9 || shift > 12) return;
    sector_ = std::size_t{1} << shift;
    for (std::size_t i = 0; i < 109; ++i) add_to_table(u32(file_, 76 + 4 * i));
    std::uint32_t more = u32(file_, 68);
    for (std::size_t count = 0; more < kLastSector && count < most_sectors(); ++count) {
      const std::string_view list = sector(more);
      for (std::size_t at = 0; at + 4 < list.size(); at += 4) add_to_table(u32(list, at));
      more = u32(list, sector_ - 4);
    }
    directory_ = chain(u32(file_, 48));
  }

  /// The content of one of its files; empty where there is none of that name.
  std::string stream(std::string_view name) const {
    std::optional<std::size_t> root, found;
    for (std::size_t at = 0; at + kEntry <= directory_.size(); at += kEntry) {
      if (directory_[at + 66] == 5) root = at;
      if (directory_[at + 66] == 2 && name_of(at) == name) found = at;
    }
    if (!root || !found) return {};
    const std::size_t size = u32(directory_, *found + 120);
    const std::uint32_t start = u32(directory_, *found + 116);
    std::string content =
        size < u32(file_, 56) ? small_chain(start, chain(u32(directory_, *root + 116))) : chain(start);
    content.resize(std::min(content.size(), size));
    return content;
  }

 private:
  static constexpr std::size_t kHeader = 512, kEntry = 128, kSmallSector = 64;
  static constexpr std::uint32_t kLastSector = 0xFFFFFFFA;  // what is above ends a chain

  std::size_t most_sectors() const { return file_.size() / sector_ + 1; }
  std::string_view sector(std::uint32_t number) const {
    const std::size_t at = (std::size_t{number} + 1) * sector_;
    return at < file_.size() ? file_.substr(at, sector_) : std::string_view{};
  }
  void add_to_table(std::uint32_t number) {
    if (number >= kLastSector || next_.size() > most_sectors()) return;
    const std::string_view table = sector(number);
    for (std::size_t at = 0; at + 4 <= table.size(); at += 4) next_.push_back(u32(table, at));
  }
  std::string chain(std::uint32_t number) const {
    std::string content;
    for (std::size_t count = 0; number < next_.size() && count < most_sectors(); ++count) {
      content += sector(number);
      number = next_[number];
    }
    return content;
  }
  std::string small_chain(std::uint32_t number, const std::string& sectors) const {
    const std::string table = chain(u32(file_, 60));
    std::string content;
    for (std::size_t count = 0; number < table.size() / 4 && count < sectors.size() / kSmallSector; ++count) {
      const std::size_t at = std::size_t{number} * kSmallSector;
      if (at < sectors.size()) content += sectors.substr(at, kSmallSector);
      number = u32(table, std::size_t{number} * 4);
    }
    return content;
  }
  std::string name_of(std::size_t entry) const {
    std::string name;
    for (std::size_t at = entry; at + 1 < entry + 64 && directory_[at] != 0; at += 2) name += directory_[at];
    return name;
  }

  std::string_view file_;
  std::size_t sector_ = kHeader;
  std::vector<std::uint32_t> next_;  // by sector
  std::string directory_;
};

std::string_view error_text(std::uint8_t code) {
  switch (code) {
    case 0x00:
      return "#NULL!";
    case 0x07:
      return "#DIV/0!";
    case 0x0F:
      return "#VALUE!";
    case 0x17:
      return "#REF!";
    case 0x1D:
      return "#NAME?";
    case 0x24:
      return "#NUM!";
    case 0x2A:
      return "#N/A";
    default:
      return "#ERROR";
  }
}

Cell truth_or_error(std::uint8_t value, bool is_error) {
  return {std::string(is_error ? error_text(value) : value != 0 ? "TRUE" : "FALSE"), std::nullopt};
}

/// The result of a formula: a number, or what its first byte says where the last two are FF.
Cell result_of(std::string_view record) {
  constexpr std::size_t kResult = 6;
  if (u16(record, kResult + 6) != 0xFFFF) {
    const auto value = std::bit_cast<double>(little_endian<std::uint64_t>(record, kResult));
    return {fmt::format("{}", value), value};
  }
  const auto what = static_cast<std::uint8_t>(record[kResult]),
             byte = static_cast<std::uint8_t>(record[kResult + 2]);
  if (what == 1 || what == 2) return truth_or_error(byte, what == 2);
  return {"=(a formula without a number)", std::nullopt};
}

/// A number in four bytes: thirty bits of a whole number or of a double, perhaps to be divided by 100.
double short_number(std::uint32_t bits) {
  const double value = (bits & 2U) != 0 ? static_cast<double>(static_cast<std::int32_t>(bits) >> 2)
                                        : std::bit_cast<double>(std::uint64_t{bits & ~3U} << 32);
  return (bits & 1U) != 0 ? value / 100.0 : value;
}

/// A character of the first of Unicode's planes.
void add_utf8(std::string& text, std::uint16_t character) {
  const auto add = [&](unsigned byte) { text += static_cast<char>(byte); };
  if (character < 0x80) return add(character);
  if (character < 0x800) {
    add(0xC0U | character >> 6);
  } else {
    add(0xE0U | character >> 12);
    add(0x80U | (character >> 6 & 0x3FU));
  }
  add(0x80U | (character & 0x3FU));
}

/// The formats of a workbook's cells, by the number of their style.
class Styles {
 public:
  void take_format(std::string_view record) {  // its number, and its code in one or two bytes a character
    const std::size_t count = u16(record, 2), width = record.size() > 4 && (record[4] & 1) != 0 ? 2 : 1;
    std::string code;
    for (std::size_t i = 0; i < count && 5 + i * width < record.size(); ++i) {
      const std::size_t at = 5 + i * width;
      add_utf8(code, width == 2 ? u16(record, at) : static_cast<unsigned char>(record[at]));
    }
    own_[u16(record, 0)] = number_format(code);
  }
  void take_style(std::string_view record) { formats_.push_back(u16(record, 2)); }

  NumberFormat format_of(std::size_t style) const {
    if (style >= formats_.size()) return {};
    const auto own = own_.find(formats_[style]);
    return own != own_.end() ? own->second : built_in_format(formats_[style]);
  }

 private:
  std::map<unsigned, NumberFormat> own_;
  std::vector<unsigned> formats_;
};

/// A BoundSheet8 record: place, state, kind, and the name in one or two bytes a character.
bool is_shown_sheet(std::string_view record) {
  return record.size() > 8 && (record[4] & 3) == 0 && record[5] == 0;
}

std::string name_of_sheet(std::string_view record) {
  const std::size_t count = static_cast<unsigned char>(record[6]), width = (record[7] & 1) != 0 ? 2 : 1;
  std::string name;
  for (std::size_t i = 0; i < count && 8 + (i + 1) * width <= record.size(); ++i) {
    const std::size_t at = 8 + i * width;
    add_utf8(name, width == 2 ? u16(record, at) : static_cast<unsigned char>(record[at]));
  }
  return name;
}

constexpr std::uint16_t kSheet = 0x0085;

using Cells = std::map<std::pair<std::size_t, std::size_t>, Cell>;

/// Keeps a number only where its format makes something else of it.
void take_number(Cells& cells, std::pair<std::size_t, std::size_t> place, double value,
                 const NumberFormat& format) {
  if (format.kind == NumberFormat::Kind::number && format.unit.empty()) return;
  cells[place] = as_shown({fmt::format("{}", value), value}, format);
}

}  // namespace

std::string first_shown_sheet(std::string_view file) {
  const std::string book = CompoundFile(file).stream("Workbook");
  for (std::size_t at = 0; at + 4 <= book.size(); at += 4 + u16(book, at + 2)) {
    const std::string_view record = std::string_view(book).substr(at + 4, u16(book, at + 2));
    if (u16(book, at) == kSheet && is_shown_sheet(record)) return name_of_sheet(record);
  }
  return {};
}

Cells cells_read_apart(std::string_view file) {
  constexpr std::uint16_t kFormula = 0x0006, kEnd = 0x000A, kBoolErr = 0x0205, kBegin = 0x0809,
                          kFormat = 0x041E, kStyle = 0x00E0, kNumber = 0x0203, kShort = 0x027E,
                          kShorts = 0x00BD;
  Cells cells;
  Styles styles;
  const std::string book = CompoundFile(file).stream("Workbook");
  std::size_t at = 0, depth = 0;
  bool in_sheet = false;
  while (at + 4 <= book.size()) {
    const std::uint16_t kind = u16(book, at);
    const std::string_view record = std::string_view(book).substr(at + 4, u16(book, at + 2));
    at += 4 + u16(book, at + 2);
    if (!in_sheet) {
      if (kind == kFormat) styles.take_format(record);
      if (kind == kStyle) styles.take_style(record);
      if (kind != kSheet || !is_shown_sheet(record)) continue;
      at = u32(record, 0);
      in_sheet = true;
      continue;
    }
    if (kind == kBegin) ++depth;  // charts lie within
    if (kind == kEnd && (depth == 0 || --depth == 0)) break;
    const std::pair<std::size_t, std::size_t> place{u16(record, 0), u16(record, 2)};
    const NumberFormat format = styles.format_of(u16(record, 4));
    if (kind == kFormula && record.size() >= 14) {
      cells[place] = result_of(record);
      if (cells[place].number) cells[place] = as_shown(cells[place], format);
    }
    if (kind == kBoolErr && record.size() >= 8)
      cells[place] = truth_or_error(static_cast<std::uint8_t>(record[6]), record[7] != 0);
    if (kind == kNumber && record.size() >= 14)
      take_number(cells, place, std::bit_cast<double>(little_endian<std::uint64_t>(record, 6)), format);
    if (kind == kShort && record.size() >= 10)
      take_number(cells, place, short_number(u32(record, 6)), format);
    if (kind == kShorts)
      for (std::size_t i = 0; 4 + 6 * (i + 1) <= record.size() - 2; ++i)
        take_number(cells, {place.first, place.second + i}, short_number(u32(record, 4 + 6 * i + 2)),
                    styles.format_of(u16(record, 4 + 6 * i)));
  }
  return cells;
}

}  // namespace meltstage::motion::detail
