// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/netlist.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "asic/netlist/verilog.hpp"
#include "asic/netlist/yosys_json.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

std::string Port::bit_name(std::size_t i) const {
  return bits.size() == 1 ? name : fmt::format("{}[{}]", name, i);
}

namespace {

/// The pins of a port are named by its bits.
void require_plain_range(const std::string& file, const std::string& name, const yosys::Port& port) {
  if (port.bits.size() < 2 || (port.offset == 0 && !port.rises)) return;
  const std::size_t highest = port.bits.size() - 1;
  throw UserError(
      fmt::format("{}: port {}: found the range [{}:{}], expected [{}:0], by which test patterns name its "
                  "pins; give the design a module around it whose ports have such ranges",
                  file, shown(name), port.index(highest), port.index(0), highest));
}

Netlist netlist_of(yosys::Module module, std::string file) {
  Netlist netlist;
  netlist.file = std::move(file);
  netlist.top = std::move(module.name);
  const auto is_known = [&](Net net) { netlist.next_net = std::max(netlist.next_net, net + 1); };
  for (auto& [name, port] : module.ports) {
    require_plain_range(netlist.file, name, port);
    netlist.ports.push_back({name, port.is_input, std::move(port.bits)});
  }
  for (auto& [name, cell] : module.cells) {
    for (const auto& [pin, net] : cell.pins) is_known(net);
    netlist.instances.push_back({name, std::move(cell.type), std::move(cell.pins)});
  }
  for (const auto& [type, directions] : module.directions) {
    for (const auto& [pin, direction] : directions)
      if (direction != "inout") netlist.is_output[type][pin] = direction == "output";
  }
  for (const Port& port : netlist.ports) std::for_each(port.bits.begin(), port.bits.end(), is_known);
  for (const auto& [name, wire] : module.net_names) {
    const bool in_a_module = name.find('.') != std::string::npos && name.find('$') == std::string::npos;
    for (std::size_t i = 0; i < wire.bits.size(); ++i) {
      const Net net = wire.bits[i];
      const std::string bit = wire.bits.size() == 1 ? name : fmt::format("{}[{}]", name, wire.index(i));
      if (in_a_module) netlist.nets_in_modules[bit] = net;
      if (net < 2) continue;
      std::string& known = netlist.net_names[net];
      if (known.empty() || bit.size() < known.size()) known = bit;
      if (in_a_module) {
        std::string& in_module = netlist.register_names[net];
        if (in_module.empty() || bit.size() < in_module.size()) in_module = bit;
      }
      is_known(net);
    }
  }
  return netlist;
}

}  // namespace

Netlist read_yosys_json(const std::filesystem::path& path) {
  return netlist_of(yosys::read_top_module(path), path.string());
}

Netlist parse_yosys_json(std::string_view text, const std::string& name) {
  return netlist_of(yosys::parse_top_module(text, name), name);
}

void require_directions(const Netlist& netlist, const CellLibrary& library) {
  const auto word = [](bool is_output) { return is_output ? "output" : "input"; };
  for (const auto& [type, pins] : netlist.is_output) {
    const auto cell = library.find(type);
    if (cell == library.end()) continue;
    for (const auto& [pin, is_output] : pins) {
      const CellPin* const known = cell->second.find(pin);
      if (known != nullptr && known->is_output != is_output)
        throw UserError(fmt::format(
            "{}: cells of {}: found {} as {} in port_directions, expected {} as in {}", netlist.file,
            shown(type), shown(pin), word(is_output), word(known->is_output), cell->second.where));
    }
  }
}

std::string verilog_text(const Netlist& netlist) {
  std::vector<std::string> names;
  for (const Port& port : netlist.ports) names.push_back(port.name);
  verilog::ModuleText text(netlist.top, names);
  const auto net_text = [](Net net) {
    if (net == 0) return std::string("1'b0");
    if (net == 1) return std::string("1'b1");
    if (net == kUnknownNet) return std::string("1'bx");
    return fmt::format("n{}", net);
  };
  std::vector<bool> used(static_cast<std::size_t>(netlist.next_net), false);
  const auto mark = [&](Net net) {
    if (net >= 2) used[static_cast<std::size_t>(net)] = true;
  };
  for (const Port& port : netlist.ports) std::for_each(port.bits.begin(), port.bits.end(), mark);
  for (const Instance& instance : netlist.instances) {
    for (const auto& [pin, net] : instance.pins) mark(net);
  }
  for (const Port& port : netlist.ports) text.port(port.is_input, port.bits.size(), port.name);
  for (std::size_t net = 2; net < used.size(); ++net) {
    if (used[net]) text.wire(net_text(static_cast<Net>(net)));
  }
  for (const Port& port : netlist.ports) {
    for (std::size_t i = 0; i < port.bits.size(); ++i) {
      const std::string bit =
          verilog::name_text(port.name) + (port.bits.size() == 1 ? "" : fmt::format("[{}]", i));
      if (port.is_input)
        text.assign(net_text(port.bits[i]), bit);
      else
        text.assign(bit, net_text(port.bits[i]));
    }
  }
  for (const Instance& instance : netlist.instances) {
    std::vector<std::pair<std::string, std::string>> pins;
    for (const auto& [pin, net] : instance.pins) pins.emplace_back(pin, net_text(net));
    text.instance(instance.type, instance.name, pins);
  }
  return text.finish();
}

// A line a port, cell and net, as it comes: a tree of it all would take longer than the tests.
std::string yosys_json_text(const Netlist& netlist) {
  using yosys::quoted;
  const auto bit = [](Net net) {
    if (net == kUnknownNet) return std::string("\"x\"");
    return net < 2 ? fmt::format("\"{}\"", net) : std::to_string(net);
  };
  std::string text = fmt::format(
      "{{\n\"creator\": \"meltstage\",\n\"modules\": {{\n{}: {{\n\"attributes\": {{\"top\": "
      "\"1\"}},\n\"ports\": {{",
      quoted(netlist.top));
  const char* separator = "\n";
  for (const Port& port : netlist.ports) {
    std::string bits;
    for (const Net net : port.bits) bits += (bits.empty() ? "" : ", ") + bit(net);
    text += fmt::format("{}{}: {{\"direction\": \"{}\", \"bits\": [{}]}}", separator, quoted(port.name),
                        port.is_input ? "input" : "output", bits);
    separator = ",\n";
  }
  text += "\n},\n\"cells\": {";
  separator = "\n";
  for (const Instance& instance : netlist.instances) {
    std::string pins;
    for (const auto& [pin, net] : instance.pins)
      pins += fmt::format("{}{}: [{}]", pins.empty() ? "" : ", ", quoted(pin), bit(net));
    text += fmt::format("{}{}: {{\"hide_name\": 0, \"type\": {}, \"connections\": {{{}}}}}", separator,
                        quoted(instance.name), quoted(instance.type), pins);
    separator = ",\n";
  }
  text += "\n},\n\"netnames\": {";
  separator = "\n";
  for (const auto& [net, name] : netlist.net_names) {
    text += fmt::format("{}{}: {{\"hide_name\": 0, \"bits\": [{}], \"attributes\": {{}}}}", separator,
                        quoted(name), net);
    separator = ",\n";
  }
  return text + "\n}\n}\n}\n}\n";
}

}  // namespace meltstage::dft
