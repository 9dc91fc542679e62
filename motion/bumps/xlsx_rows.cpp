// SPDX-License-Identifier: Apache-2.0
// Rows of a workbook (.xlsx, ECMA-376): a ZIP archive through libzip, its XML parts through pugixml.
#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <memory>
#include <pugixml.hpp>
#include <string_view>

#include "base/file.hpp"
#include "base/number.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/number_formats.hpp"

namespace meltstage::motion::detail {
namespace {

// Unpacked; two million rows take less. A few kilobytes of archive may hold any of it.
constexpr zip_uint64_t kLargestPart = 1ULL << 29;  // bytes
constexpr std::ptrdiff_t kMostMarks = 40'000'000;  // tags and attributes, each of which takes memory
constexpr std::size_t kMostRows = 1U << 24U;       // Excel has fewer, LibreOffice as many
constexpr std::size_t kLongestText = 32767;        // bytes of a cell; Excel allows as many characters

/// Some libraries write <x:row> for <row>. With the root's prefix taken off, all names are the plain ones.
void strip_prefix(pugi::xml_document& document) {
  const std::string root = document.document_element().name();
  const auto colon = root.find(':');
  if (colon == std::string::npos) return;
  struct Stripper : pugi::xml_tree_walker {
    explicit Stripper(std::string prefix) : prefix_(std::move(prefix)) {}
    bool for_each(pugi::xml_node& node) override {
      const std::string name = node.name();
      if (name.starts_with(prefix_)) node.set_name(name.c_str() + prefix_.size());
      return true;
    }
    std::string prefix_;
  } stripper(root.substr(0, colon + 1));
  document.traverse(stripper);
}

class Archive {
 public:
  Archive(const std::filesystem::path& path, std::string_view content) : path_(path) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(content.data(), content.size(), 0, &error);
    zip_t* archive = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
    const std::string reason = zip_error_strerror(&error);
    zip_error_fini(&error);
    if (archive == nullptr) {
      if (source != nullptr) zip_source_free(source);
      fail(path, fmt::format("not a readable ZIP archive ({}), expected an Excel workbook (.xlsx); it may be "
                             "damaged or cut off",
                             reason));
    }
    archive_.reset(archive);
  }

  bool has(const std::string& part) const { return zip_name_locate(archive_.get(), part.c_str(), 0) >= 0; }

  pugi::xml_document xml(const std::string& part) const {
    zip_stat_t info;
    zip_stat_init(&info);
    if (zip_stat(archive_.get(), part.c_str(), 0, &info) != 0)
      fail(path_, fmt::format("found no part {} in the archive, expected an Excel workbook (.xlsx)",
                              in_quotes(part)));
    if ((info.valid & ZIP_STAT_SIZE) == 0 || info.size > kLargestPart)
      fail(path_, fmt::format("part {} holds more than {} MiB, expected less", in_quotes(part),
                              kLargestPart >> 20U));
    std::string text(info.size, '\0');
    const std::unique_ptr<zip_file_t, CloseFile> file(zip_fopen(archive_.get(), part.c_str(), 0));
    char behind = 0;  // the checksum is compared by the read that finds the end
    if (!file || zip_fread(file.get(), text.data(), text.size()) != static_cast<zip_int64_t>(text.size()) ||
        zip_fread(file.get(), &behind, 1) != 0)
      fail(path_, fmt::format("part {} can't be unpacked, expected an undamaged workbook without a password",
                              in_quotes(part)));
    if (std::count_if(text.begin(), text.end(), [](char c) { return c == '<' || c == '='; }) > kMostMarks)
      fail(path_, fmt::format("part {} holds more than {} tags and attributes, expected less",
                              in_quotes(part), kMostMarks));
    pugi::xml_document document;
    const auto result = document.load_buffer(text.data(), text.size());
    if (!result)
      fail(path_, fmt::format("part {}, byte {}: {}, expected XML", in_quotes(part), result.offset,
                              result.description()));
    strip_prefix(document);
    return document;
  }

 private:
  struct Discard {
    void operator()(zip_t* archive) const { zip_discard(archive); }
  };
  struct CloseFile {
    void operator()(zip_file_t* file) const { zip_fclose(file); }
  };
  const std::filesystem::path& path_;
  std::unique_ptr<zip_t, Discard> archive_;
};

/// The "r:id" of a sheet, whatever the prefix is in this file.
std::string relation_of(const pugi::xml_node& sheet) {
  const auto id = sheet.find_attribute([](const pugi::xml_attribute& attribute) {
    return std::string_view(attribute.name()).ends_with(":id");
  });
  return id.as_string();
}

/// A sheet, and the part that holds it; one of no cells, such as a chart, may have none.
struct SheetPart {
  std::string name, part;
  bool hidden = false;
};

std::vector<SheetPart> sheet_parts(const Archive& archive) {
  const auto book = archive.xml("xl/workbook.xml"), relations = archive.xml("xl/_rels/workbook.xml.rels");
  std::vector<SheetPart> sheets;
  for (const auto& sheet : book.child("workbook").child("sheets").children("sheet")) {
    const std::string id = relation_of(sheet);
    sheets.push_back({sheet.attribute("name").as_string(),
                      {},
                      std::string_view(sheet.attribute("state").as_string("visible")) != "visible"});
    for (const auto& relation : relations.child("Relationships").children("Relationship")) {
      if (id.empty() || relation.attribute("Id").as_string() != id) continue;
      const std::string target = relation.attribute("Target").as_string();
      sheets.back().part = target.starts_with('/') ? target.substr(1) : "xl/" + target;
    }
  }
  return sheets;
}

/// The first one that the workbook shows.
const SheetPart& first_sheet(const std::filesystem::path& path, const std::vector<SheetPart>& sheets) {
  const auto first = std::find_if(sheets.begin(), sheets.end(), [](const SheetPart& s) { return !s.hidden; });
  if (first == sheets.end()) fail(path, "there is no sheet that the workbook shows, expected one");
  if (first->part.empty())
    fail(path, fmt::format("the part of the first sheet ({}) is missing, expected an undamaged workbook",
                           in_quotes(first->name)));
  return *first;
}

bool holds_cells(const Archive& archive, const SheetPart& sheet) {
  if (sheet.part.empty()) return false;
  const auto document = archive.xml(sheet.part);
  const auto rows = document.child("worksheet").child("sheetData").children("row");
  return std::any_of(rows.begin(), rows.end(), [](const pugi::xml_node& row) {
    const auto cells = row.children("c");
    return std::any_of(cells.begin(), cells.end(),
                       [](const pugi::xml_node& c) { return !c.first_child().empty(); });
  });
}

/// All text of an element, whether plain or in runs with a format of their own; readings (ruby) left out.
std::string text_of(const std::filesystem::path& path, const pugi::xml_node& element) {
  std::string text = element.child("t").text().as_string();
  for (const auto& run : element.children("r")) text += run.child("t").text().as_string();
  // A short reference in each of many cells may stand for it.
  if (text.size() > kLongestText)
    fail(path, fmt::format("found a text of {} bytes that begins {}, expected at most {}", text.size(),
                           in_quotes(text), kLongestText));
  return text;
}

std::vector<std::string> shared_strings(const std::filesystem::path& path, const Archive& archive) {
  std::vector<std::string> strings;
  constexpr auto kPart = "xl/sharedStrings.xml";
  if (!archive.has(kPart)) return strings;
  const auto document = archive.xml(kPart);
  for (const auto& item : document.child("sst").children("si")) strings.push_back(text_of(path, item));
  return strings;
}

/// Column of a cell reference such as "AB12", from 0; nothing if it isn't one of this row.
std::optional<std::size_t> column_of(std::string_view reference, std::size_t row) {
  constexpr std::size_t kMostColumns = 16384;
  std::size_t column = 0, letters = 0;
  for (; letters < reference.size() && reference[letters] >= 'A' && reference[letters] <= 'Z'; ++letters) {
    column = column * 26 + static_cast<std::size_t>(reference[letters] - 'A') + 1;
    if (column > kMostColumns) return std::nullopt;
  }
  if (letters == 0 || number_in<std::size_t>(reference.substr(letters), 0, kMostRows) != row)
    return std::nullopt;
  return column - 1;
}

/// A formula that sums up a range of cells and does nothing else: "SUM(B2:B9)", "ROUND(AVERAGE(B2:B9),2)".
bool sums_up(std::string_view formula) {
  constexpr std::array<std::string_view, 9> kFunctions = {
      "SUM(", "SUBTOTAL(", "AVERAGE(", "COUNT(", "COUNTA(", "MIN(", "MAX(", "MEDIAN(", "STDEV"};
  constexpr std::string_view kRound = "ROUND(";
  if (formula.starts_with(kRound)) formula.remove_prefix(kRound.size());
  return formula.find(':') != std::string_view::npos && formula.ends_with(')') &&
         formula.find_first_of("+*/&") == std::string_view::npos &&
         std::any_of(kFunctions.begin(), kFunctions.end(),
                     [&](std::string_view name) { return formula.starts_with(name); });
}

/// Of each style that a cell may name.
std::vector<NumberFormat> number_formats(const Archive& archive) {
  std::vector<NumberFormat> formats;
  constexpr auto kPart = "xl/styles.xml";
  if (!archive.has(kPart)) return formats;
  const auto document = archive.xml(kPart);
  const auto styles = document.child("styleSheet");
  std::map<unsigned, NumberFormat> own;
  for (const auto& format : styles.child("numFmts").children("numFmt"))
    own[format.attribute("numFmtId").as_uint()] = number_format(format.attribute("formatCode").as_string());
  for (const auto& style : styles.child("cellXfs").children("xf")) {
    const unsigned id = style.attribute("numFmtId").as_uint();
    const auto found = own.find(id);
    formats.push_back(found != own.end() ? found->second : built_in_format(id));
  }
  return formats;
}

class Sheet {
 public:
  Sheet(const std::filesystem::path& path, std::vector<std::string> strings,
        std::vector<NumberFormat> formats)
      : path_(path), strings_(std::move(strings)), formats_(std::move(formats)) {}

  Cell cell(std::size_t row, const pugi::xml_node& node) const {
    const std::string_view type = node.attribute("t").as_string("n");
    const std::string value = node.child("v").text().as_string();
    if (type == "inlineStr") return {text_of(path_, node.child("is")), std::nullopt};
    if (type == "s") {
      const auto index = parse_number(value);
      if (!index || *index < 0.0 || *index >= static_cast<double>(strings_.size()))
        fail(path_,
             fmt::format("row {}: found text number {}, expected one below {}; the workbook is damaged", row,
                         in_quotes(value), strings_.size()));
      return {strings_[static_cast<std::size_t>(*index)], std::nullopt};
    }
    if (type == "b") return {value == "0" ? "FALSE" : "TRUE", std::nullopt};
    // Only a program that calculates stores the value of a formula; its text keeps the cell from being blank.
    // An empty value that is a text is one: IF(A4="","",1).
    const bool no_value = type == "n" || (type == "str" && !node.child("v"));
    if (no_value && value.empty() && node.child("f"))
      return {fmt::format("={}", node.child("f").text().as_string()), std::nullopt};
    if (type == "n" && !value.empty()) {
      const std::size_t style = node.attribute("s").as_ullong();
      return as_shown({value, parse_number(value), sums_up(node.child("f").text().as_string())},
                      style < formats_.size() ? formats_[style] : NumberFormat{});
    }
    return {value, std::nullopt};
  }

 private:
  const std::filesystem::path& path_;
  std::vector<std::string> strings_;
  std::vector<NumberFormat> formats_;
};

}  // namespace

std::vector<std::string> read_xlsx_rows(const std::filesystem::path& path, std::string_view content,
                                        const RowHandler& handle) {
  if (const auto kind = describe_content(content); !kind.starts_with("a ZIP"))
    fail(path, fmt::format("found {}, expected an Excel workbook (.xlsx) without a password", kind));
  const Archive archive(path, content);
  const std::vector<SheetPart> sheets = sheet_parts(archive);
  const SheetPart& first = first_sheet(path, sheets);
  const Sheet sheet(path, shared_strings(path, archive), number_formats(archive));
  const auto document = archive.xml(first.part);
  TableRow row;
  for (const auto& node : document.child("worksheet").child("sheetData").children("row")) {
    // Rows and cells that hold nothing may be left out, and so may the numbers of those that follow at once.
    if (const auto number = node.attribute("r")) {
      const auto stated = number_in<std::size_t>(number.as_string(), row.row + 1, kMostRows);
      if (!stated)
        fail(path,
             fmt::format("row {}: found a row of number {} behind it, expected rows in order and at most "
                         "{}; the workbook is damaged",
                         row.row, in_quotes(number.as_string()), kMostRows));
      row.row = *stated;
    } else {
      ++row.row;
    }
    const auto height = node.attribute("ht");
    row.hidden = node.attribute("hidden").as_bool() || (height && height.as_double() == 0.0);
    row.cells.clear();
    for (const auto& c : node.children("c")) {
      const auto reference = c.attribute("r");
      const auto column =
          reference ? column_of(reference.as_string(), row.row) : std::optional(row.cells.size());
      if (!column || *column < row.cells.size())
        fail(path, fmt::format(
                       "row {}: found cell {}, expected cells of this row in order; the workbook is damaged",
                       row.row, in_quotes(reference.as_string())));
      row.cells.resize(*column);
      row.cells.push_back(sheet.cell(row.row, c));
    }
    handle(row);
  }
  std::vector<std::string> others;
  for (const SheetPart& other : sheets)
    if (&other != &first && holds_cells(archive, other))
      others.push_back(other.hidden ? other.name + " (hidden)" : other.name);
  return others;
}

}  // namespace meltstage::motion::detail
