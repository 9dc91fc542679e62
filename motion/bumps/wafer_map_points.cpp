// SPDX-License-Identifier: Apache-2.0
// Dies out of a wafer map in XML, SEMI G85: one bump a die whose bin is a good one, in its middle.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/count.hpp"
#include "base/number.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

constexpr std::ptrdiff_t kMostTags = 4'000'000;
constexpr double kMostDies = 1e6;  // in a row or a column

/// A name without its namespace: semi:Map is a Map.
std::string_view local_name(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') + 1);
}

std::vector<pugi::xml_node> children(const pugi::xml_node& parent, std::string_view name) {
  std::vector<pugi::xml_node> list;
  for (const pugi::xml_node& child : parent.children())
    if (local_name(child) == name) list.push_back(child);
  return list;
}

/// Bytes of the first characters of a text in UTF-8.
std::size_t bytes_of(std::string_view text, std::size_t characters) {
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
  std::size_t bytes = 0;
  for (; characters > 0 && bytes < text.size(); --characters) do
      ++bytes;
    while (bytes < text.size() && continues(text[bytes]));
  return bytes;
}

/// Attributes that say nothing of where a die lies or whether it passes.
constexpr std::string_view kOfNoMatter[] = {
    "SubstrateId", "SubstrateType", "SubstrateNumber", "WaferId",        "FormatRevision", "ProductId",
    "LotId",       "WaferSize",     "CreateDate",      "LastModified",   "SupplierName",   "Status",
    "MapName",     "MapVersion",    "Version",         "BinDescription", "ProductCode",    "RecipeName",
    "ToolType",    "CarrierType",   "CarrierId",       "SlotNumber",     "DeviceSizeX",    "DeviceSizeY",
    "Rows",        "Columns",       "Orientation",     "OriginLocation", "BinType",        "NullBin",
    "MapType",     "BinCode",       "BinCount",        "BinQuality",     "schemaLocation"};

/// A bin, and whether its dies are good ones; nothing where the map doesn't say.
struct Bin {
  std::optional<bool> good;
  std::optional<std::size_t> count;  // by its own word
  std::size_t dies = 0;
};

class WaferMap {
 public:
  WaferMap(const std::filesystem::path& path, std::string_view content) : path_(path), content_(content) {
    if (std::count(content.begin(), content.end(), '<') > kMostTags)
      fail(path, fmt::format("found more than {} tags, expected a wafer map", kMostTags));
    if (content.find("<!ENTITY") != content.npos)
      fail(path, "found entities of its own (<!ENTITY), expected a map without");
    const pugi::xml_parse_result parsed =
        document_.load_buffer(content.data(), content.size(), pugi::parse_default | pugi::parse_ws_pcdata);
    if (!parsed)
      fail(path, fmt::format("row {}: found no sound XML ({}), expected a wafer map (SEMI G85)",
                             row_of(parsed.offset), parsed.description()));
  }

  RawPoints read() {
    const pugi::xml_node map = only_map();
    const pugi::xml_node device = only(map, "Device");
    for (const pugi::xml_node& node : {map, device}) look_at_attributes(node);
    read_device(device);
    for (const pugi::xml_node& bin : children(device, "Bin")) {
      look_at_attributes(bin);
      read_bin(bin);
    }
    const pugi::xml_node data = only(device, "Data");
    look_at_attributes(data);
    const std::vector<pugi::xml_node> rows = children(data, "Row");
    if (rows.size() != rows_)
      fail(path_, fmt::format("row {}: found {}, expected {} as Rows says", row_of(device),
                              counted(rows.size(), "Row"), rows_));
    for (std::size_t i = 0; i < rows.size(); ++i) read_row(rows[i], i);
    tell();
    return std::move(result_);
  }

 private:
  std::size_t row_of(std::ptrdiff_t offset) const {
    const auto end = std::clamp<std::ptrdiff_t>(offset, 0, static_cast<std::ptrdiff_t>(content_.size()));
    return 1 + static_cast<std::size_t>(std::count(content_.begin(), content_.begin() + end, '\n'));
  }
  std::size_t row_of(const pugi::xml_node& node) const { return row_of(node.offset_debug()); }

  /// The same, of places that come in their order: the text is gone through once.
  std::size_t next_row(std::ptrdiff_t offset) {
    counted_row_ +=
        static_cast<std::size_t>(std::count(content_.begin() + counted_to_, content_.begin() + offset, '\n'));
    counted_to_ = offset;
    return counted_row_;
  }

  [[noreturn]] void refuse(const pugi::xml_node& node, std::string_view what) const {
    fail(path_, fmt::format("row {}: {}: {}", row_of(node), local_name(node), what));
  }

  pugi::xml_node only_map() const {
    const pugi::xml_node root = document_.document_element();
    if (local_name(root) == "Map") return root;
    if (local_name(root) != "Maps")
      fail(path_, fmt::format("row {}: found {}, expected Maps or Map, as a wafer map (SEMI G85) begins",
                              row_of(root), in_quotes(root.name())));
    return only(root, "Map");
  }

  pugi::xml_node only(const pugi::xml_node& parent, std::string_view name) const {
    const std::vector<pugi::xml_node> found = children(parent, name);
    if (found.size() != 1) refuse(parent, fmt::format("found {} of {}, expected one", found.size(), name));
    return found.front();
  }

  double number(const pugi::xml_node& node, const char* name, double least, double most) const {
    const std::string_view text = node.attribute(name).value();
    const auto value = number_in(text, least, most);
    if (!value)
      refuse(node, fmt::format("{}: found {}, expected a number from {:g} to {:g}", name, in_quotes(text),
                               least, most));
    return *value;
  }

  std::size_t whole_number(const pugi::xml_node& node, const char* name) const {
    const double value = number(node, name, 1.0, kMostDies);
    if (value != std::floor(value))
      refuse(node, fmt::format("{}: found {}, expected a whole number", name, value));
    return static_cast<std::size_t>(value);
  }

  /// Each attribute once; the names of those that might matter and aren't known.
  void look_at_attributes(const pugi::xml_node& node) {
    std::set<std::string_view> seen;
    for (const pugi::xml_attribute& attribute : node.attributes()) {
      const std::string_view whole = attribute.name();
      const std::string_view name = whole.substr(whole.find(':') + 1);
      if (!seen.insert(whole).second)
        refuse(node, fmt::format("found {} twice, expected it once", in_quotes(whole)));
      if (!whole.starts_with("xmlns") &&
          std::find(std::begin(kOfNoMatter), std::end(kOfNoMatter), name) == std::end(kOfNoMatter))
        unknown_.insert(std::string(name));
    }
  }

  void read_device(const pugi::xml_node& device) {
    rows_ = whole_number(device, "Rows");
    columns_ = whole_number(device, "Columns");
    bin_type_ = device.attribute("BinType").value();
    null_bin_ = device.attribute("NullBin").value();
    if (!device.attribute("NullBin"))
      refuse(device, "found no NullBin, expected the code of places without a die");
    // In other corners the order of the rows in the file is read in two ways.
    if (const std::string_view origin = device.attribute("OriginLocation").value(); origin != "2")
      refuse(device, fmt::format("OriginLocation: found {}, expected 2 (upper left); turn the map",
                                 in_quotes(origin)));
    if (const std::string_view type = device.attribute("MapType").value(); !type.empty() && type != "Array")
      refuse(device, fmt::format("MapType: found {}, expected Array", in_quotes(type)));
    const bool sized = device.attribute("DeviceSizeX") || device.attribute("DeviceSizeY");
    if (!sized) return;
    constexpr double kLeast_um = 1.0, kMost_um = 1e6;
    width_ = number(device, "DeviceSizeX", kLeast_um, kMost_um) / 1000.0;
    height_ = number(device, "DeviceSizeY", kLeast_um, kMost_um) / 1000.0;
    result_.has_unit = true;
    if (const std::string_view notch = device.attribute("Orientation").value(); !notch.empty())
      result_.notes.push_back(fmt::format(
          "the map's flat or notch is at {} degrees; bumps lie as the map shows them", shown(notch)));
  }

  void read_bin(const pugi::xml_node& node) {
    const std::string code = node.attribute("BinCode").value();
    if (code.empty()) refuse(node, "found no BinCode, expected one");
    const std::string_view told = node.attribute("BinQuality").value();
    const std::string quality = in_small_letters(told);
    Bin bin;
    if (quality == "pass" || quality == "fail")
      bin.good = quality == "pass";
    else if (!quality.empty() && quality != "null")
      refuse(node, fmt::format("BinQuality: found {}, expected Pass or Fail", in_quotes(told)));
    if (node.attribute("BinCount"))
      bin.count = static_cast<std::size_t>(number(node, "BinCount", 0.0, kMostDies * kMostDies));
    if (!bins_.emplace(code, bin).second)
      refuse(node, fmt::format("found bin {} twice, expected it once", in_quotes(code)));
  }

  /// Characters of a code; 0 where blanks part them.
  std::size_t code_width(const pugi::xml_node& row) const {
    const std::string type = in_small_letters(bin_type_);
    if (type == "ascii") return 1;
    if (type == "hexadecimal") return 2;
    if (type == "integer2") return 4;
    if (type == "decimal") return 0;
    refuse(row, fmt::format("BinType: found {}, expected Ascii, Decimal, Hexadecimal or Integer2",
                            in_quotes(bin_type_)));
  }

  /// The text of a row, without the blanks around it, unless a blank is a code.
  std::string text_of(const pugi::xml_node& row) const {
    std::string text;
    for (const pugi::xml_node& part : row.children()) {
      if (part.type() == pugi::node_element)
        refuse(row, fmt::format("found {} in it, expected codes alone", in_quotes(part.name())));
      if (part.type() != pugi::node_comment) text += part.value();
    }
    const bool blank_is_code = null_bin_.find(' ') != std::string::npos ||
                               std::any_of(bins_.begin(), bins_.end(), [](const auto& bin) {
                                 return bin.first.find(' ') != std::string::npos;
                               });
    const char* around = blank_is_code ? "\t\r\n" : " \t\r\n";
    const std::size_t begin = std::min(text.find_first_not_of(around), text.size());
    return text.substr(begin, text.find_last_not_of(around) + 1 - begin);
  }

  std::vector<std::string> codes_of(const pugi::xml_node& row) const {
    const std::string text = text_of(row);
    std::vector<std::string> codes;
    std::string_view left = text;
    const std::size_t width = code_width(row);
    while (!left.empty() && codes.size() <= columns_) {
      const std::size_t length =
          width == 0 ? std::min(left.find_first_of(" \t\r\n"), left.size()) : bytes_of(left, width);
      codes.emplace_back(left.substr(0, length));
      left.remove_prefix(length);
      if (width == 0) left = trimmed(left);
    }
    return codes;
  }

  void read_row(const pugi::xml_node& row, std::size_t line) {
    look_at_attributes(row);
    const std::vector<std::string> codes = codes_of(row);
    if (codes.size() != columns_)
      refuse(row, fmt::format("found {} {}, expected {} as Columns says",
                              codes.size() > columns_ ? "more than" : "only",
                              counted(std::min(codes.size(), columns_), "die"), columns_));
    const std::size_t text_row = next_row(row.offset_debug());
    for (std::size_t column = 0; column < columns_; ++column) {
      const std::string& code = codes[column];
      if (code == null_bin_) continue;
      const auto bin = bins_.find(code);
      if (bin == bins_.end())
        refuse(row, fmt::format("column {}: found bin {}, expected NullBin or one that a Bin names",
                                column + 1, in_quotes(code)));
      ++bin->second.dies;
      if (bin->second.good == false) continue;
      const auto group = static_cast<std::uint32_t>(std::distance(bins_.begin(), bin));
      result_.groups[group] = code;
      result_.points.push_back({static_cast<double>(column) * width_, -static_cast<double>(line) * height_,
                                text_row, std::nullopt, group});
      check_point_count(path_, result_.points.size());
    }
  }

  void tell() {
    std::size_t failing = 0;
    result_.notes.emplace_back("(0, 0) is the middle of the die in the map's first row and column");
    for (const auto& [code, bin] : bins_) {
      if (bin.count && *bin.count != bin.dies)
        result_.notes.push_back(fmt::format("BinCount of bin {} is {}, and the rows hold {} of it",
                                            in_quotes(code), *bin.count, counted(bin.dies, "die")));
      if (bin.dies == 0) continue;
      if (bin.good == false) {
        failing += bin.dies;
        result_.notes.push_back(fmt::format("{} of bin {}, which fails, make no bump",
                                            counted(bin.dies, "die"), in_quotes(code)));
      }
      if (!bin.good)
        result_.notes.push_back(
            fmt::format("{} of bin {}, of which the map doesn't say whether it passes, make bumps",
                        counted(bin.dies, "die"), in_quotes(code)));
    }
    if (result_.points.empty())
      fail(path_, fmt::format("found no die that passes, and {} of bins that fail, expected one at least",
                              counted(failing, "die")));
    for (const std::string& name : unknown_)
      result_.notes.push_back(fmt::format("the map's {} is not read", in_quotes(name)));
  }

  const std::filesystem::path& path_;
  std::string_view content_;
  pugi::xml_document document_;
  RawPoints result_{};
  std::ptrdiff_t counted_to_ = 0;
  std::size_t counted_row_ = 1;
  std::size_t rows_ = 0, columns_ = 0;
  std::string bin_type_, null_bin_;
  double width_ = 1.0, height_ = 1.0;  // of a die: mm, or a step of the job's pitch
  std::map<std::string, Bin> bins_;
  std::set<std::string> unknown_;  // attributes
};

}  // namespace

RawPoints read_wafer_map(const std::filesystem::path& path, std::string_view content) {
  return WaferMap(path, content).read();
}

}  // namespace meltstage::motion::detail
