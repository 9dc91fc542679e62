// SPDX-License-Identifier: Apache-2.0
// Structural Verilog, written piece by piece: one module, its ports, wires, connections and instances.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace meltstage::verilog {

/// The name as Verilog takes it: escaped when it isn't made of letters, digits and underscores.
std::string name_text(const std::string& name);

class ModuleText {
 public:
  ModuleText(const std::string& module, const std::vector<std::string>& ports);
  /// `name` is `width` bits wide, 1: no range.
  void port(bool is_input, std::size_t width, const std::string& name);
  void wire(const std::string& name);
  /// Both sides as they stand in the text.
  void assign(const std::string& left, const std::string& right);
  /// `pins`: name of the pin, and the text of what it is connected to.
  void instance(const std::string& type, const std::string& name,
                std::span<const std::pair<std::string, std::string>> pins);
  std::string finish();

 private:
  std::string text_;
};

}  // namespace meltstage::verilog
