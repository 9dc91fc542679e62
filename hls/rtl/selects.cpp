// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/selects.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::hls {
namespace {

// Text of the files that were asked for, without line comments.
class Sources {
 public:
  const std::string& of(const std::string& file) {
    const auto [known, is_new] = texts_.try_emplace(file);
    if (is_new)
      known->second = std::regex_replace(read_file(file, "a file of the RTL"), std::regex("//[^\n]*"), "");
    return known->second;
  }
  std::string line(const std::string& file, std::size_t number) {
    std::istringstream lines(of(file));
    std::string line;
    while (number-- > 0 && std::getline(lines, line)) continue;
    return line;
  }

 private:
  std::map<std::string, std::string> texts_;
};

[[noreturn]] void refuse_member(const std::string& place, const std::string& of) {
  throw UserError(fmt::format(
      "{}: found a bit of a struct's member chosen by an index, {}, expected the member in a net of its own "
      "and a bit of that: Yosys would take a bit of the next member for an index beyond",
      place, of));
}

// What is behind a kind such as $shiftx$ in a name FILE:LINE$NUMBER.
std::string place_behind(const std::string& line, std::string_view kind) {
  const std::size_t begin = line.rfind(kind);
  if (begin == std::string::npos) return "";
  const std::size_t place = begin + kind.size();
  return line.substr(place, line.find('$', place) - place);
}

// A member with an index that no number is: NAME.MEMBER[i], NAME[0].MEMBER[i+1].
std::regex member_with_index(const std::string& name) {
  return std::regex("\\b" + name + "(\\s*\\[[^\\]]*\\])?(\\s*\\.\\s*\\w+)+\\s*\\[\\s*[^0-9\\s][^\\]]*\\]");
}

// A write to bits that an index chooses.
void check_write(const std::string& place, const std::string& text) {
  static const std::regex kMember = member_with_index("\\w+"),
                          kDownwards("\\w+\\s*\\[[^;=]*-:[^;=]*\\]\\s*<?=[^=]");
  std::smatch found;
  if (std::regex_search(text, found, kMember)) refuse_member(place, found.str());
  if (std::regex_search(text, found, kDownwards))
    throw UserError(fmt::format(
        "{}: found a slice written downwards from an index, {}, expected +: or single bits: Yosys "
        "would write nothing of one that ends below bit 0",
        place, found.str()));
}

// Names of a module.
struct Names {
  std::string module;
  std::set<std::string> arrays, short_signed, files;
};

// Of each module of RTLIL. One with parameters is called $paramod$...\NAME.
std::vector<Names> names_of(const std::string& modules) {
  static const std::regex kArray("  memory .*\\\\(\\w+)$"), kOfFlops("\\$mem2reg_\\w+\\$\\\\(\\w+)\\$"),
      kSigned("  wire (width (\\d+) )?.*signed .*\\\\(\\w+)$"), kFile("attribute .src \"([^:\"|]+):[1-9]"),
      kModule("module .*\\\\(\\w+)[^\\\\]*$");
  std::vector<Names> all;
  std::istringstream lines(modules);
  std::set<std::string> files;  // of the attributes before a module
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (line.starts_with("module ") && std::regex_search(line, found, kModule))
      all.push_back({found[1], {}, {}, std::exchange(files, {})});
    if (line.find("attribute \\src") != std::string::npos && std::regex_search(line, found, kFile))
      (line.starts_with(' ') && !all.empty() ? all.back().files : files).insert(found[1]);
    if (all.empty()) continue;
    if (line.starts_with("  memory ") && std::regex_search(line, found, kArray))
      all.back().arrays.insert(found[1]);
    if (line.starts_with("  wire ") && std::regex_search(line, found, kOfFlops))
      all.back().arrays.insert(found[1]);
    if (line.starts_with("  wire ") && line.find(" signed ") != std::string::npos &&
        std::regex_search(line, found, kSigned) && found[2].str() != "32")
      all.back().short_signed.insert(found[3]);
  }
  return all;
}

// From its name to its end; empty where the file does not have it.
std::string text_of_module(const std::string& text, const std::string& name) {
  std::smatch begin;
  if (!std::regex_search(text, begin, std::regex("\\bmodule\\s+" + name + "\\b"))) return "";
  const auto at = static_cast<std::size_t>(begin.position());
  return text.substr(at, text.find("endmodule", at) - at);
}

void check_signed_indices(const std::string& modules, Sources& sources) {
  for (const Names& names : names_of(modules)) {
    if (names.arrays.empty() || names.short_signed.empty()) continue;
    const std::regex index(fmt::format("\\b({})\\s*\\[\\s*({})\\b[^\\]]*\\]", fmt::join(names.arrays, "|"),
                                       fmt::join(names.short_signed, "|")));
    for (const std::string& file : names.files) {
      std::smatch found;
      const std::string text = text_of_module(sources.of(file), names.module);
      if (std::regex_search(text, found, index))
        throw UserError(fmt::format(
            "{}: found a signed index of a memory in {}, {}, expected one without a sign: Yosys would take "
            "another word for one below 0",
            file, names.module, found.str()));
    }
  }
}

}  // namespace

void require_plain_selects(const std::string& rtl, const std::string& modules) {
  Sources sources;
  check_signed_indices(modules, sources);
  std::istringstream lines(rtl);
  for (std::string line; std::getline(lines, line);) {
    // a write: its line is known
    if (line.starts_with("  wire ") && line.find("$bitselwrite$mask$") != std::string::npos) {
      const std::string place = place_behind(line, "$bitselwrite$mask$");
      const std::size_t colon = place.rfind(':');
      check_write(place,
                  sources.line(place.substr(0, colon), std::strtoul(place.c_str() + colon + 1, nullptr, 10)));
    }
    // a read: of which net is known, but no line
    if (!line.starts_with("  cell $shiftx ")) continue;
    const std::string place = place_behind(line, "$shiftx$");
    if (!place.ends_with(":0")) continue;
    while (std::getline(lines, line) && !line.starts_with("    connect \\A ") && line != "  end") continue;
    const std::size_t name = line.find_last_of("\\.");
    if (line == "  end" || name == std::string::npos) continue;
    const std::string net = line.substr(name + 1);
    const bool is_whole = !net.empty() && net.find_first_not_of(
                                              "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                              "0123456789_") == std::string::npos;
    const std::string file = place.substr(0, place.size() - 2);
    std::smatch found;
    if (is_whole && std::regex_search(sources.of(file), found, member_with_index(net)))
      refuse_member(file, found.str());
  }
}

}  // namespace meltstage::hls
