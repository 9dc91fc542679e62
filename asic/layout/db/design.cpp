// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/design.hpp"

#include <fmt/format.h>

#include <cctype>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "base/error.hpp"

namespace meltstage::layout {

namespace {

using nlohmann::json;

/// Names that Yosys made up: `_123_` and what it hides.
bool is_private(const std::string& name, const json& wire) {
  if (wire.value("hide_name", 0) != 0) return true;
  std::size_t digits = 1;
  while (digits < name.size() && std::isdigit(static_cast<unsigned char>(name[digits])) != 0) ++digits;
  return name[0] == '_' && digits > 1 && digits < name.size() && name[digits] == '_';
}

/// The proof of equivalence (cut_flops.py) takes public names first, then the shortest, then the first in the
/// alphabet.
struct NetName {
  std::string text;
  bool is_private = true;
  bool worse_than(const NetName& o) const {
    if (text.empty()) return true;
    if (is_private != o.is_private) return is_private;
    return std::pair(text.size(), text) > std::pair(o.text.size(), o.text);
  }
};

const json& top_module(const json& root, const std::string& file, std::string& name) {
  const json* found = nullptr;
  for (const auto& [key, module] : root.at("modules").items()) {
    const json attributes = module.value("attributes", json::object());
    if (attributes.contains("blackbox")) continue;
    if (found != nullptr && !attributes.contains("top")) continue;
    found = &module;
    name = key;
  }
  if (found == nullptr) throw UserError(fmt::format("{}: found no module with cells, expected one", file));
  return *found;
}

class NetlistReader {
 public:
  NetlistReader(const std::string& file, const Technology& technology)
      : file_(file), technology_(technology) {}

  Design read(const json& root) {
    const json& module = top_module(root, file_, design_.name);
    supplies();
    names(module);
    for (const auto& [name, port] : module.at("ports").items()) {
      const json& bits = port.at("bits");
      for (std::size_t i = 0; i < bits.size(); ++i) {
        const PinRef ref{kDiePin, static_cast<int>(design_.pins.size())};
        const int net = net_of(bits[i]);
        design_.pins.push_back({bit_name(name, port, i),
                                net,
                                port.at("direction") == "input" ? PinDirection::input : PinDirection::output,
                                Use::signal,
                                false,
                                {}});
        design_.nets[static_cast<std::size_t>(net)].pins.push_back(ref);
      }
    }
    for (const auto& [name, cell] : module.at("cells").items()) add(name, cell);
    return std::move(design_);
  }

 private:
  static std::string bit_name(const std::string& name, const json& wire, std::size_t i) {
    if (wire.at("bits").size() == 1) return name;
    return fmt::format("{}_{}", name, i + wire.value("offset", std::size_t{0}));
  }

  void supplies() {
    for (const Use use : {Use::power, Use::ground}) {
      Net net;
      net.use = use;
      for (const Macro& macro : technology_.macros) {
        for (const MacroPin& pin : macro.pins) {
          if (pin.use == use && net.name.empty()) net.name = pin.name;
        }
      }
      if (net.name.empty())
        throw UserError(fmt::format(
            "{}: found cells without supply pins, expected USE POWER and GROUND in the LEF", file_));
      design_.nets.push_back(std::move(net));
    }
  }

  void names(const json& module) {
    for (const auto& [name, wire] : module.at("netnames").items()) {
      const json& bits = wire.at("bits");
      for (std::size_t i = 0; i < bits.size(); ++i) {
        if (!bits[i].is_number_integer()) continue;
        NetName candidate{bit_name(name, wire, i), is_private(name, wire)};
        NetName& known = names_[bits[i].get<int>()];
        if (known.worse_than(candidate)) known = std::move(candidate);
      }
    }
  }

  int net_of(const json& bit) {
    if (!bit.is_number_integer()) return bit == "1" ? 0 : 1;
    const auto [entry, is_new] = nets_.try_emplace(bit.get<int>(), static_cast<int>(design_.nets.size()));
    if (is_new) {
      Net net;
      const auto name = names_.find(bit.get<int>());
      net.name = name == names_.end() ? fmt::format("_n{}_", bit.get<int>()) : name->second.text;
      design_.nets.push_back(std::move(net));
    }
    return entry->second;
  }

  void add(const std::string& name, const json& cell) {
    const std::string type = cell.at("type");
    const int macro = technology_.find_macro(type);
    if (macro < 0)
      throw UserError(fmt::format("{}: cell {}: found a {}, expected a macro of the LEF", file_, name, type));
    const int component = static_cast<int>(design_.components.size());
    design_.components.push_back({name, macro, {}, Orientation::N, false, false});
    for (const auto& [pin_name, bits] : cell.at("connections").items()) {
      if (bits.empty()) continue;
      const int pin = technology_.macros[static_cast<std::size_t>(macro)].find_pin(pin_name);
      if (pin < 0 || bits.size() != 1)
        throw UserError(fmt::format("{}: cell {}/{}: found {} bits, expected one on a pin of {} in the LEF",
                                    file_, name, pin_name, bits.size(), type));
      design_.nets[static_cast<std::size_t>(net_of(bits[0]))].pins.push_back({component, pin});
    }
  }

  const std::string& file_;
  const Technology& technology_;
  Design design_;
  std::unordered_map<int, NetName> names_;
  std::unordered_map<int, int> nets_;
};

std::string verilog_name(const std::string& name) {
  bool plain = !name.empty() && (std::isalpha(static_cast<unsigned char>(name[0])) != 0 || name[0] == '_');
  for (const char c : name) plain = plain && (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_');
  return plain ? name : "\\" + name + " ";
}

}  // namespace

Rect Wire::metal() const {
  return Rect{std::min(from.x, to.x), std::min(from.y, to.y), std::max(from.x, to.x), std::max(from.y, to.y)}
      .grown(width / 2);
}

int Design::find_net(std::string_view net) const {
  for (std::size_t i = 0; i < nets.size(); ++i) {
    if (nets[i].name == net) return static_cast<int>(i);
  }
  return -1;
}

const Via& Design::via(const Technology& technology, int index) const {
  const auto shared = static_cast<int>(technology.vias.size());
  return index < shared ? technology.vias[static_cast<std::size_t>(index)]
                        : vias[static_cast<std::size_t>(index - shared)];
}

Rect placed(const Rect& r, const Macro& macro, const Component& component) {
  Rect turned = r;
  const bool flip_x = component.orientation == Orientation::S || component.orientation == Orientation::FN;
  const bool flip_y = component.orientation == Orientation::S || component.orientation == Orientation::FS;
  if (flip_x) turned = {macro.width - r.x1, turned.y0, macro.width - r.x0, turned.y1};
  if (flip_y) turned = {turned.x0, macro.height - r.y1, turned.x1, macro.height - r.y0};
  return turned.moved(component.at);
}

Rect outline(const Component& component, const Technology& technology) {
  const Macro& macro = technology.macros[static_cast<std::size_t>(component.macro)];
  return {component.at.x, component.at.y, component.at.x + macro.width, component.at.y + macro.height};
}

std::vector<Shape> pin_shapes(const Design& design, const Technology& technology, PinRef ref) {
  if (ref.component == kDiePin) return {design.pins[static_cast<std::size_t>(ref.pin)].shape};
  const Component& component = design.components[static_cast<std::size_t>(ref.component)];
  const Macro& macro = technology.macros[static_cast<std::size_t>(component.macro)];
  std::vector<Shape> shapes = macro.pins[static_cast<std::size_t>(ref.pin)].shapes;
  for (Shape& shape : shapes) shape.rect = placed(shape.rect, macro, component);
  return shapes;
}

PinDirection pin_direction(const Design& design, const Technology& technology, PinRef ref) {
  if (ref.component == kDiePin) return design.pins[static_cast<std::size_t>(ref.pin)].direction;
  const Component& component = design.components[static_cast<std::size_t>(ref.component)];
  return technology.macros[static_cast<std::size_t>(component.macro)]
      .pins[static_cast<std::size_t>(ref.pin)]
      .direction;
}

Design read_netlist(const std::filesystem::path& path, const Technology& technology) {
  const std::string file = path.string();
  std::ifstream stream(path, std::ios::binary);
  if (!stream)
    throw UserError(fmt::format("{}: can't be read, expected a netlist of Yosys' write_json", file));
  try {
    return NetlistReader(file, technology).read(json::parse(stream));
  } catch (const json::exception& error) {
    throw UserError(fmt::format("{}: found another structure ({}), expected a netlist of Yosys' write_json",
                                file, error.what()));
  }
}

std::string verilog_text(const Design& design, const Technology& technology) {
  std::string text;
  auto out = std::back_inserter(text);
  std::vector<std::vector<std::pair<std::string, std::string>>> connections(design.components.size());
  for (const Net& net : design.nets) {
    const std::string value = net.use == Use::power    ? "1'b1"
                              : net.use == Use::ground ? "1'b0"
                                                       : verilog_name(net.name);
    for (const PinRef& ref : net.pins) {
      if (ref.component == kDiePin) continue;
      const Component& component = design.components[static_cast<std::size_t>(ref.component)];
      const Macro& macro = technology.macros[static_cast<std::size_t>(component.macro)];
      connections[static_cast<std::size_t>(ref.component)].emplace_back(
          macro.pins[static_cast<std::size_t>(ref.pin)].name, value);
    }
  }
  const auto is_supply = [](const DiePin& pin) { return pin.use == Use::power || pin.use == Use::ground; };
  fmt::format_to(out, "module {}(", verilog_name(design.name));
  const char* separator = "";
  for (const DiePin& pin : design.pins) {
    if (is_supply(pin)) continue;
    fmt::format_to(out, "{}{}", separator, verilog_name(pin.name));
    separator = ", ";
  }
  fmt::format_to(out, ");\n");
  std::map<std::string, bool> is_port;
  for (const DiePin& pin : design.pins) {
    if (is_supply(pin)) continue;
    is_port[pin.name] = true;
    fmt::format_to(out, "  {} {};\n", pin.direction == PinDirection::input ? "input" : "output",
                   verilog_name(pin.name));
  }
  for (const Net& net : design.nets) {
    const bool is_signal = net.use != Use::power && net.use != Use::ground;
    if (is_signal && !is_port.contains(net.name)) fmt::format_to(out, "  wire {};\n", verilog_name(net.name));
  }
  for (const DiePin& pin : design.pins) {
    const Net& net = design.nets[static_cast<std::size_t>(pin.net)];
    if (is_supply(pin) || net.name == pin.name) continue;
    const std::string inner = net.use == Use::power    ? "1'b1"
                              : net.use == Use::ground ? "1'b0"
                                                       : verilog_name(net.name);
    if (pin.direction == PinDirection::input)
      fmt::format_to(out, "  assign {} = {};\n", inner, verilog_name(pin.name));
    else
      fmt::format_to(out, "  assign {} = {};\n", verilog_name(pin.name), inner);
  }
  for (std::size_t i = 0; i < design.components.size(); ++i) {
    const Macro& macro = technology.macros[static_cast<std::size_t>(design.components[i].macro)];
    fmt::format_to(out, "  {} {} (", verilog_name(macro.name), verilog_name(design.components[i].name));
    separator = "";
    for (const auto& [pin, net] : connections[i]) {
      fmt::format_to(out, "{}.{}({})", separator, verilog_name(pin), net);
      separator = ", ";
    }
    fmt::format_to(out, ");\n");
  }
  return text + "endmodule\n";
}

}  // namespace meltstage::layout
