// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/array_indices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <map>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.hpp"

namespace meltstage::hls {
namespace {

constexpr std::string_view kMadeFlops = "$mem2reg_";

// An array, and FILE:LINE of an access.
using Access = std::pair<std::string, std::string>;

// Of $memwr$\ARRAY$FILE:LINE$NUMBER, from the backslash on; JSON doubles it.
Access access_of(std::string_view name) {
  name.remove_prefix(std::min(name.find_first_not_of('\\'), name.size()));
  const std::size_t array = name.find('$');
  if (array == std::string_view::npos) return {};
  const std::size_t place = name.find('$', array + 1);
  if (place == std::string_view::npos) return {};
  return {std::string(name.substr(0, array)), std::string(name.substr(array + 1, place - array - 1))};
}

std::set<Access> accesses_of_flops(std::string_view netlist) {
  std::set<Access> result;
  for (std::size_t at = 0; (at = netlist.find(kMadeFlops, at)) != std::string_view::npos; ++at) {
    const std::string_view rest = netlist.substr(at, netlist.find('"', at) - at);
    if (const std::size_t name = rest.find('\\'); name != std::string_view::npos)
      result.insert(access_of(rest.substr(name)));
  }
  return result;
}

unsigned number_behind(const std::string& line, const std::string& word, unsigned otherwise) {
  const std::size_t at = line.find(word);
  if (at == std::string::npos) return otherwise;
  unsigned number = otherwise;
  std::from_chars(line.data() + at + word.size(), line.data() + line.size(), number);
  return number;
}

// Lines of RTLIL: memories of a module, and how wide the addresses of their ports are.
class Arrays {
 public:
  explicit Arrays(std::set<Access> of_flops) : of_flops_(std::move(of_flops)) {}

  void read(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("module ")) {
        words_.clear();
        indices_.clear();
      }
      if (line.starts_with("  memory ")) take_array(line);
      if (line.starts_with("  wire ") && line.ends_with("_ADDR")) take_index(line);
      if (line.starts_with("  cell $memrd ")) read_port_ = access_of(line.substr(line.rfind("$memrd$") + 7));
      if (line.starts_with("    parameter \\ABITS ")) read_bits_ = number_behind(line, "ABITS ", 0);
      if (line.starts_with("    connect \\ADDR ") && !read_port_.first.empty()) {
        const bool is_constant = std::isdigit(static_cast<unsigned char>(line[18])) != 0;
        if (!is_constant) require(read_port_, read_bits_);
        read_port_ = {};
      }
    }
    // wires stand before the memories of their module
  }

 private:
  void take_array(const std::string& line) {
    const std::string name = line.substr(line.rfind('\\') + 1);
    words_[name] = number_behind(line, " size ", 1) + number_behind(line, " offset ", 0);
    for (const auto& [access, bits] : indices_)
      if (access.first == name) require(access, bits);
  }

  void take_index(const std::string& line) {
    const std::size_t at = line.find(" $memwr$\\");
    if (at == std::string::npos) return;
    unsigned& widest = indices_[access_of(line.substr(at + 8))];  // several may stand in one line of RTL
    widest = std::max(widest, number_behind(line, " width ", 1));
  }

  void require(const Access& access, unsigned bits) const {
    if (!of_flops_.contains(access)) return;
    const unsigned words = words_.at(access.first);
    unsigned needed = 1;
    while (needed < 32 && (std::uint64_t{1} << needed) < words) ++needed;
    if (bits > needed)
      throw UserError(
          fmt::format("{}: found an index of {} bits of {}, which has {} words and a reset, expected {} "
                      "bits: tools differ "
                      "in what a word beyond it is",
                      access.second, bits, access.first, words, needed));
  }

  std::set<Access> of_flops_;
  std::map<std::string, unsigned> words_;
  std::map<Access, unsigned> indices_;
  Access read_port_;
  unsigned read_bits_ = 0;
};

}  // namespace

namespace {

// A cell of RTLIL that Yosys made of indices: it stands in line 0 of its file.
struct IndexCell {
  std::string file;
  std::map<std::string, std::string> words;  // parameters and connections
};

// FILE of "  cell $add PREFIX$add$FILE:0$NUMBER"; empty for other cells.
std::string file_of_index_cell(const std::string& line, const std::string& kind) {
  constexpr std::string_view kLine = ":0$";
  const std::size_t name = line.rfind(kind), place = line.rfind(kLine);
  if (!line.starts_with(fmt::format("  cell {} ", kind)) || place == std::string::npos || place < name)
    return "";
  return line.substr(name + kind.size() + 1, place - name - kind.size() - 1);
}

// What stands behind "    parameter \\" or "    connect \\", by its first word.
void take_word(const std::string& line, std::map<std::string, std::string>& words) {
  const std::size_t name = line.find('\\');
  const std::size_t blank = line.find(' ', name);
  if (name != std::string::npos && blank != std::string::npos)
    words[line.substr(name + 1, blank - name - 1)] = line.substr(blank + 1);
}

}  // namespace

void require_narrow_dimensions(const std::string& rtl) {
  std::vector<IndexCell> sums;
  std::map<std::string, std::string> dimension_of;  // by the product's output
  std::istringstream lines(rtl);
  for (std::string line; std::getline(lines, line);) {
    const std::string sum = file_of_index_cell(line, "$add"), product = file_of_index_cell(line, "$mul");
    if (sum.empty() && product.empty()) continue;
    IndexCell cell{sum + product, {}};
    while (std::getline(lines, line) && line != "  end") take_word(line, cell.words);
    if (sum.empty())
      dimension_of[cell.words["Y"]] = cell.words["B"];
    else
      sums.push_back(std::move(cell));
  }
  for (const IndexCell& cell : sums) {
    const auto words = dimension_of.find(cell.words.at("A"));
    if (words == dimension_of.end()) continue;
    const unsigned dimension = number_behind(words->second, "", 0),
                   bits = number_behind(cell.words.at("B_WIDTH"), "", 0);
    const std::string& index = cell.words.at("B");
    const bool is_constant = index.find_first_not_of("0123456789'") == std::string::npos;
    if (!is_constant && (std::uint64_t{1} << std::min(bits, 63U)) > dimension)
      throw UserError(
          fmt::format("{}: found an index of {} bits in a dimension of {} words, of an array of several "
                      "dimensions, expected no "
                      "word beyond it: Yosys would take one of the next row",
                      cell.file, bits, dimension));
  }
}

bool has_arrays_of_flops(const std::string& netlist) { return netlist.find(kMadeFlops) != std::string::npos; }

void require_narrow_indices(const std::string& netlist, const std::string& arrays) {
  Arrays(accesses_of_flops(netlist)).read(arrays);
}

}  // namespace meltstage::hls
