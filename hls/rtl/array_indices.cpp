// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/array_indices.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <map>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

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
      if (line.starts_with("module ")) words_.clear();
      if (line.starts_with("  memory ")) take_array(line);
      if (line.starts_with("  wire ") && line.ends_with("_ADDR")) take_index(line);
      if (line.starts_with("  cell $memrd ")) read_port_ = access_of(line.substr(line.rfind("$memrd$") + 7));
      if (line.starts_with("    parameter \\ABITS ") && !read_port_.first.empty()) {
        require(read_port_, number_behind(line, "ABITS ", 0));
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
    if (at != std::string::npos) indices_[access_of(line.substr(at + 8))] = number_behind(line, " width ", 1);
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
};

}  // namespace

bool has_arrays_of_flops(const std::string& netlist) { return netlist.find(kMadeFlops) != std::string::npos; }

void require_narrow_indices(const std::string& netlist, const std::string& arrays) {
  Arrays(accesses_of_flops(netlist)).read(arrays);
}

}  // namespace meltstage::hls
