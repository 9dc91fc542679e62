// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/other_readings.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <map>
#include <regex>
#include <sstream>
#include <string_view>

#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::hls {
namespace {

void refuse_undeclared(const std::string& said) {
  static const std::regex kImplicit(
      "([^\\n]+:\\d+): Warning: Identifier `\\\\([^']+)' is implicitly declared");
  std::smatch found;
  if (std::regex_search(said, found, kImplicit))
    throw UserError(
        fmt::format("{}: found {} without a declaration, expected one", found[1].str(), found[2].str()));
}

// FILE:LINE of an attribute such as \src "a.sv:3.15-3.28|b.sv:1.1-1.2".
struct Place {
  std::string file;
  std::size_t line = 0, column = 0;

  explicit Place(const std::string& attribute) {
    static const std::regex kSource("\\\\src \"([^\"|]+):(\\d+)\\.(\\d+)-");
    std::smatch found;
    if (!std::regex_search(attribute, found, kSource)) return;
    file = found[1];
    line = std::strtoul(found[2].str().c_str(), nullptr, 10);
    column = std::strtoul(found[3].str().c_str(), nullptr, 10);
  }
  std::string told() const { return line == 0 ? file : fmt::format("{}:{}", file, line); }
};

class Files {
 public:
  const std::string& all(const std::string& file) {
    const auto [known, is_new] = texts_.try_emplace(file);
    if (is_new) known->second = read_file(file, "a file of the RTL");
    return known->second;
  }
  // What stands at a place, to the end of its line.
  std::string at(const Place& place) {
    std::istringstream lines(all(place.file));
    std::string line;
    for (std::size_t i = 0; i < place.line && std::getline(lines, line); ++i) continue;
    return place.column == 0 || place.column > line.size() ? "" : line.substr(place.column - 1);
  }

 private:
  std::map<std::string, std::string> texts_;
};

bool names_a_net(std::string_view value) { return value.find_first_of("\\$") != std::string_view::npos; }

// Module, cell and port of what Yosys has widened, as "m.u.x".
std::map<std::string, std::string> widened_ports(const std::string& said) {
  static const std::regex kResized("Resizing cell port (\\S+) from (\\d+) bits to (\\d+) bits");
  std::map<std::string, std::string> ports;
  for (std::sregex_iterator at(said.begin(), said.end(), kResized), end; at != end; ++at)
    if (std::stoul((*at)[2]) < std::stoul((*at)[3]))
      ports[(*at)[1]] = fmt::format("{} of {} bits", (*at)[2].str(), (*at)[3].str());
  return ports;
}

std::string_view without_backslash(std::string_view name) {
  return name.substr(name.starts_with('\\') ? 1 : 0);
}

// Reads RTLIL line by line.
class Modules {
 public:
  explicit Modules(const std::string& said) : widened_(widened_ports(said)) {}

  void take(const std::string& line) {
    std::istringstream words(line);
    std::string word, first, second;
    words >> word >> first;
    std::getline(words, second);
    if (word == "attribute" && first == "\\src") source_ = line;
    if (word == "attribute" && first.starts_with("\\always_")) always_ = true;
    if (word == "module") module_ = without_backslash(first);
    if (word == "cell") {
      cell_ = without_backslash(std::string_view(second).substr(std::min<std::size_t>(1, second.size())));
      cell_source_ = source_;
    }
    if (word == "connect") check_port(std::string(without_backslash(first)), second);
    if (word == "process") {
      initial_source_ = source_;
      may_be_initial_ = !always_;
      always_ = false;
    }
    if (word == "assign" && may_be_initial_ && names_a_net(second) &&
        is_initial(Place(initial_source_), variable(first)))
      throw UserError(
          fmt::format("{}: found an initial value of {} that is no constant, expected one, or a continuous "
                      "assignment (wire, assign)",
                      Place(initial_source_).told(), variable(first)));
    if (word == "end") may_be_initial_ = may_be_initial_ && line.starts_with("    ");
  }

 private:
  // Whether the process is a declaration's initial value or an initial block, and no always block. For the
  // second one Yosys names no line, and so for always blocks with a loop.
  bool is_initial(const Place& place, const std::string& name) {
    static const std::regex kDeclared("^[A-Za-z_\\\\][\\w$]*(\\s*\\[[^\\]]*\\])*\\s*=[^=]");
    if (place.line != 0) return std::regex_search(files_.at(place), kDeclared);
    // What Yosys has named itself, as a part of a function's result, stands in no initial block.
    if (name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") !=
        std::string::npos)
      return false;
    const std::regex in_block("\\binitial\\b[^]*\\b" + name + "\\b[^=;]*=[^=]");
    return std::regex_search(files_.all(place.file), in_block);
  }
  // "$0\n[3:0]" is n.
  static std::string variable(const std::string& target) {
    const std::size_t name = target.find('\\') + 1;
    return target.substr(name, target.find('[', name) - name);
  }
  void check_port(const std::string& port, const std::string& value) const {
    const auto widened = widened_.find(fmt::format("{}.{}.{}", module_, cell_, port));
    // A constant and a net, whole or in parts, are widened alike by all.
    if (widened == widened_.end() || value.find('$') == std::string::npos) return;
    throw UserError(
        fmt::format("{}: found an expression at port {} of {}, {}, expected a net of the port's width: Yosys "
                    "would work it out in fewer bits",
                    Place(cell_source_).told(), port, cell_, widened->second));
  }

  std::map<std::string, std::string> widened_;
  Files files_;
  std::string source_, module_, cell_, cell_source_, initial_source_;
  bool always_ = false;          // an attribute of the process that follows
  bool may_be_initial_ = false;  // the process that is read
};

}  // namespace

void require_plain_readings(const std::string& said, const std::string& modules) {
  refuse_undeclared(said);
  Modules check(said);
  std::istringstream lines(modules);
  for (std::string line; std::getline(lines, line);) check.take(line);
}

}  // namespace meltstage::hls
