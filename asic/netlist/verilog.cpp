// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/verilog.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>

namespace meltstage::verilog {

std::string name_text(const std::string& name) {
  const bool plain =
      !name.empty() && (std::isalpha(static_cast<unsigned char>(name[0])) != 0 || name[0] == '_') &&
      std::all_of(name.begin(), name.end(),
                  [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; });
  return plain ? name : "\\" + name + " ";
}

ModuleText::ModuleText(const std::string& module, const std::vector<std::string>& ports)
    : text_(fmt::format("module {}(", name_text(module))) {
  for (std::size_t i = 0; i < ports.size(); ++i) text_ += (i == 0 ? "" : ", ") + name_text(ports[i]);
  text_ += ");\n";
}

void ModuleText::port(bool is_input, std::size_t width, const std::string& name) {
  const std::string range = width == 1 ? "" : fmt::format("[{}:0] ", width - 1);
  fmt::format_to(std::back_inserter(text_), "  {} {}{};\n", is_input ? "input" : "output", range,
                 name_text(name));
}

void ModuleText::wire(const std::string& name) {
  fmt::format_to(std::back_inserter(text_), "  wire {};\n", name_text(name));
}

void ModuleText::assign(const std::string& left, const std::string& right) {
  fmt::format_to(std::back_inserter(text_), "  assign {} = {};\n", left, right);
}

void ModuleText::instance(const std::string& type, const std::string& name,
                          std::span<const std::pair<std::string, std::string>> pins) {
  fmt::format_to(std::back_inserter(text_), "  {} {} (", name_text(type), name_text(name));
  const char* separator = "";
  for (const auto& [pin, net] : pins) {
    fmt::format_to(std::back_inserter(text_), "{}.{}({})", separator, name_text(pin), net);
    separator = ", ";
  }
  text_ += ");\n";
}

std::string ModuleText::finish() { return std::move(text_) + "endmodule\n"; }

}  // namespace meltstage::verilog
