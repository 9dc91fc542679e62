// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/design.hpp"

#include <fmt/format.h>

#include <cctype>
#include <set>
#include <unordered_map>

#include "asic/netlist/verilog.hpp"
#include "asic/netlist/yosys_json.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

/// Names that Yosys made up: `_123_` and what it hides.
bool is_private(const std::string& name, const yosys::NetName& wire) {
  if (wire.is_hidden) return true;
  std::size_t digits = 1;
  while (digits < name.size() && std::isdigit(static_cast<unsigned char>(name[digits])) != 0) ++digits;
  return name.starts_with('_') && digits > 1 && digits < name.size() && name[digits] == '_';
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

class NetlistReader {
 public:
  NetlistReader(const std::string& file, const Technology& technology)
      : file_(file), technology_(technology) {}

  Design read(const yosys::Module& module) {
    design_.name = module.name;
    design_.file = file_;
    supplies();
    names(module);
    require_directions(module);
    for (const auto& [name, port] : module.ports) {
      for (std::size_t i = 0; i < port.bits.size(); ++i) {
        const PinRef ref{kDiePin, static_cast<int>(design_.pins.size())};
        const int net = net_of(port.bits[i]);
        if (port.is_input) drive(port.bits[i], "port " + bit_name(name, port, i));
        design_.pins.push_back({bit_name(name, port, i),
                                net,
                                port.is_input ? PinDirection::input : PinDirection::output,
                                Use::signal,
                                false,
                                {}});
        design_.nets[static_cast<std::size_t>(net)].pins.push_back(ref);
      }
    }
    for (const auto& [name, cell] : module.cells) add(name, cell);
    require_own_names();
    require_drivers();
    return std::move(design_);
  }

 private:
  static std::string bit_name(const std::string& name, const yosys::Wire& wire, std::size_t i) {
    if (wire.bits.size() == 1) return name;
    return fmt::format("{}_{}", name, wire.index(i));
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
        throw UserError(
            fmt::format("{}: found no pin with USE {}, expected MACROs of the library with their supplies",
                        technology_.files, use == Use::power ? "POWER" : "GROUND"));
      design_.nets.push_back(std::move(net));
    }
  }

  void names(const yosys::Module& module) {
    for (const auto& [name, wire] : module.net_names) {
      for (std::size_t i = 0; i < wire.bits.size(); ++i) {
        if (wire.bits[i] < 2) continue;
        NetName candidate{bit_name(name, wire, i), is_private(name, wire)};
        NetName& known = names_[wire.bits[i]];
        if (known.worse_than(candidate)) known = std::move(candidate);
      }
    }
  }

  int net_of(yosys::Bit bit) {
    if (bit < 2) return bit == yosys::kOne ? 0 : 1;
    const auto [entry, is_new] = nets_.try_emplace(bit, static_cast<int>(design_.nets.size()));
    if (is_new) {
      Net net;
      const auto name = names_.find(bit);
      net.name = name == names_.end() ? fmt::format("_n{}_", bit) : name->second.text;
      design_.nets.push_back(std::move(net));
    }
    return entry->second;
  }

  void add(const std::string& name, const yosys::Cell& cell) {
    const int macro = technology_.find_macro(cell.type);
    if (macro < 0)
      throw UserError(fmt::format("{}: cell {}: found a {}, expected a macro of the LEF", file_, shown(name),
                                  shown(cell.type)));
    require_inputs(name, cell, technology_.macros[static_cast<std::size_t>(macro)]);
    const int component = static_cast<int>(design_.components.size());
    design_.components.push_back({name, macro, {}, Orientation::N, false, false});
    for (const auto& [pin_name, bit] : cell.pins) {
      const int pin = technology_.macros[static_cast<std::size_t>(macro)].find_pin(pin_name);
      if (pin < 0)
        throw UserError(fmt::format("{}: cell {}/{}: found no such pin, expected one of {} in the LEF", file_,
                                    shown(name), shown(pin_name), shown(cell.type)));
      const MacroPin& its =
          technology_.macros[static_cast<std::size_t>(macro)].pins[static_cast<std::size_t>(pin)];
      if (is_supply(its.use)) {
        require_supply(name, its, bit);
        continue;
      }
      if (its.direction == PinDirection::output && bit == yosys::kUnknown) continue;  // nobody reads it
      if (its.direction == PinDirection::output && !its.is_tristate)
        drive(bit, fmt::format("cell {}/{}", shown(name), shown(pin_name)));
      design_.nets[static_cast<std::size_t>(net_of(bit))].pins.push_back({component, pin});
    }
  }

  /// All cells' supply pins are on the design's two supplies; a netlist may say so, and nothing else.
  void require_supply(const std::string& cell, const MacroPin& pin, yosys::Bit bit) const {
    const yosys::Bit expected = pin.use == Use::power ? yosys::kOne : yosys::kZero;
    if (bit != expected)
      throw UserError(
          fmt::format("{}: cell {}/{}: found {} at a supply pin, expected the constant {} or nothing; take "
                      "the supplies out of the netlist",
                      file_, shown(cell), shown(pin.name), bit < 2 ? "the other constant" : "a net",
                      pin.use == Use::power ? 1 : 0));
  }

  /// Two outputs, or one and a constant, would pull a net both ways.
  void drive(yosys::Bit bit, const std::string& by) {
    if (bit < 2)
      throw UserError(
          fmt::format("{}: {}: found a constant, expected a net, as it is driven there", file_, by));
    const auto [first, is_first] = driver_.try_emplace(bit, by);
    if (!is_first)
      throw UserError(fmt::format("{}: net {}: found {} and {}, expected one output", file_,
                                  shown(design_.nets[static_cast<std::size_t>(net_of(bit))].name),
                                  first->second, by));
  }

  /// A bit of a bus has its number behind its name, which may be the name of another net.
  void require_own_names() const {
    std::unordered_map<std::string_view, int> net_of_name;
    const auto take = [&](const std::string& name, int net) {
      const auto [first, is_new] = net_of_name.try_emplace(name, net);
      if (!is_new && first->second != net)
        throw UserError(
            fmt::format("{}: net {}: found two nets of this name (supplies, and bits of buses as NAME_BIT, "
                        "among them), expected names of their own; rename one",
                        file_, shown(name)));
    };
    for (std::size_t i = 0; i < design_.nets.size(); ++i) take(design_.nets[i].name, static_cast<int>(i));
    for (const DiePin& pin : design_.pins) take(pin.name, pin.net);
    std::set<std::string_view> pins;
    for (const DiePin& pin : design_.pins)
      if (!pins.insert(pin.name).second)
        throw UserError(fmt::format("{}: port {}: found two pins of this name, expected names of their own",
                                    file_, shown(pin.name)));
  }

  /// An input without an output in front of it floats.
  void require_drivers() const {
    std::set<int> driven = {0, 1};
    for (const auto& [bit, by] : driver_) driven.insert(nets_.at(bit));
    for (std::size_t i = 0; i < design_.nets.size(); ++i) {
      const Net& net = design_.nets[i];
      if (driven.contains(static_cast<int>(i))) continue;
      const auto drives = [&](const PinRef& ref) {
        const PinDirection direction = pin_direction(design_, technology_, ref);
        return direction == PinDirection::inout ||
               (direction == PinDirection::input) == (ref.component == kDiePin);
      };
      if (net.pins.empty() || std::any_of(net.pins.begin(), net.pins.end(), drives)) continue;
      throw UserError(
          fmt::format("{}: net {}: found nothing that drives it, expected an output or a port; "
                      "tie an input that isn't used",
                      file_, shown(net.name)));
    }
  }

  void require_inputs(const std::string& name, const yosys::Cell& cell, const Macro& macro) const {
    for (const MacroPin& pin : macro.pins) {
      const bool is_connected = std::any_of(cell.pins.begin(), cell.pins.end(), [&](const auto& connected) {
        return connected.first == pin.name;
      });
      if (is_supply(pin.use) || pin.direction != PinDirection::input || is_connected) continue;
      throw UserError(fmt::format("{}: cell {}/{}: found no net, expected one at every input", file_,
                                  shown(name), pin.name));
    }
  }

  void require_directions(const yosys::Module& module) const {
    for (const auto& [type, directions] : module.directions) {
      const int macro = technology_.find_macro(type);
      if (macro < 0) continue;
      for (const MacroPin& pin : technology_.macros[static_cast<std::size_t>(macro)].pins) {
        const auto said = directions.find(pin.name);
        const std::string_view known = pin.direction == PinDirection::input    ? "input"
                                       : pin.direction == PinDirection::output ? "output"
                                                                               : "inout";
        if (said != directions.end() && said->second != known && said->second != "inout" && known != "inout")
          throw UserError(
              fmt::format("{}: cells of {}: found {} as {} in port_directions, expected {} as in the LEF",
                          file_, shown(type), shown(pin.name), said->second, known));
      }
    }
  }

  const std::string& file_;
  const Technology& technology_;
  Design design_;
  std::unordered_map<int, NetName> names_;
  std::unordered_map<int, int> nets_;
  std::unordered_map<int, std::string> driver_;  // of a net
};

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
  return NetlistReader(file, technology).read(yosys::read_top_module(path));
}

std::string verilog_text(const Design& design, const Technology& technology) {
  const auto value_of = [](const Net& net) {
    return net.use == Use::power ? "1'b1" : net.use == Use::ground ? "1'b0" : verilog::name_text(net.name);
  };
  std::vector<std::vector<std::pair<std::string, std::string>>> connections(design.components.size());
  for (const Net& net : design.nets) {
    for (const PinRef& ref : net.pins) {
      if (ref.component == kDiePin) continue;
      const Component& component = design.components[static_cast<std::size_t>(ref.component)];
      const Macro& macro = technology.macros[static_cast<std::size_t>(component.macro)];
      connections[static_cast<std::size_t>(ref.component)].emplace_back(
          macro.pins[static_cast<std::size_t>(ref.pin)].name, value_of(net));
    }
  }
  std::vector<std::string> ports;
  std::set<std::string> is_port;
  for (const DiePin& pin : design.pins) {
    if (is_supply(pin.use)) continue;
    ports.push_back(pin.name);
    is_port.insert(pin.name);
  }
  verilog::ModuleText text(design.name, ports);
  for (const DiePin& pin : design.pins) {
    if (!is_supply(pin.use)) text.port(pin.direction == PinDirection::input, 1, pin.name);
  }
  for (const Net& net : design.nets) {
    if (!is_supply(net.use) && !is_port.contains(net.name)) text.wire(net.name);
  }
  for (const DiePin& pin : design.pins) {
    const Net& net = design.nets[static_cast<std::size_t>(pin.net)];
    if (is_supply(pin.use) || net.name == pin.name) continue;
    if (pin.direction == PinDirection::input)
      text.assign(value_of(net), verilog::name_text(pin.name));
    else
      text.assign(verilog::name_text(pin.name), value_of(net));
  }
  for (std::size_t i = 0; i < design.components.size(); ++i) {
    const Macro& macro = technology.macros[static_cast<std::size_t>(design.components[i].macro)];
    text.instance(macro.name, design.components[i].name, connections[i]);
  }
  return text.finish();
}

}  // namespace meltstage::layout
