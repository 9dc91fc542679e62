// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/netlist.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace meltstage::dft {

namespace {

using nlohmann::json;

Net net_of(const json& bit, const std::string& file, const std::string& where) {
  if (bit.is_number_integer()) return bit.get<Net>();
  const std::string text = bit.is_string() ? bit.get<std::string>() : "";
  if (text == "0") return 0;
  if (text == "1") return 1;
  if (text == "x" || text == "z") return kUnknownNet;
  throw UserError(
      fmt::format("{}: {}: found bit {}, expected a number, \"0\", \"1\" or \"x\"", file, where, bit.dump()));
}

const json& top_module(const json& root, const std::string& file, std::string& name) {
  if (!root.is_object() || !root.contains("modules") || root["modules"].empty())
    throw UserError(fmt::format("{}: found no \"modules\", expected a netlist of Yosys' write_json", file));
  const json& modules = root["modules"];
  const json* found = nullptr;
  for (const auto& [key, module] : modules.items()) {
    if (module.value("attributes", json::object()).contains("blackbox")) continue;
    const bool top = module.value("attributes", json::object()).contains("top");
    if (found != nullptr && !top) continue;
    found = &module;
    name = key;
    if (top) break;
  }
  if (found == nullptr) throw UserError(fmt::format("{}: found black boxes alone, expected a design", file));
  return *found;
}

std::string verilog_name(const std::string& name) {
  const bool plain =
      !name.empty() && (std::isalpha(static_cast<unsigned char>(name[0])) != 0 || name[0] == '_') &&
      std::all_of(name.begin(), name.end(),
                  [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; });
  return plain ? name : "\\" + name + " ";
}

}  // namespace

std::string Port::bit_name(std::size_t i) const {
  return bits.size() == 1 ? name : fmt::format("{}[{}]", name, i);
}

Netlist read_yosys_json(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw UserError(fmt::format("{}: can't be read; give a netlist of Yosys' write_json", file));
  json root;
  try {
    root = json::parse(stream);
  } catch (const json::exception& error) {
    throw UserError(
        fmt::format("{}: is not JSON ({}), expected a netlist of Yosys' write_json", file, error.what()));
  }
  Netlist netlist;
  netlist.file = file;
  try {
    const json& module = top_module(root, file, netlist.top);
    for (const auto& [name, port] : module.at("ports").items()) {
      const std::string direction = port.at("direction");
      if (direction != "input" && direction != "output")
        throw UserError(
            fmt::format("{}: port {}: found {}, expected input or output; split it", file, name, direction));
      Port entry{name, direction == "input", {}};
      for (const json& bit : port.at("bits")) entry.bits.push_back(net_of(bit, file, "port " + name));
      netlist.ports.push_back(std::move(entry));
    }
    for (const auto& [name, cell] : module.at("cells").items()) {
      Instance instance{name, cell.at("type"), {}};
      for (const auto& [pin, bits] : cell.at("connections").items()) {
        if (bits.empty()) continue;
        if (bits.size() != 1)
          throw UserError(
              fmt::format("{}: cell {}/{}: found {} bits, expected a mapped netlist with one bit a pin; "
                          "map it to the library (abc -liberty, dfflibmap)",
                          file, name, pin, bits.size()));
        instance.pins[pin] = net_of(bits[0], file, "cell " + name);
      }
      netlist.instances.push_back(std::move(instance));
    }
    for (const auto& [name, wire] : module.at("netnames").items()) {
      const json& bits = wire.at("bits");
      for (std::size_t i = 0; i < bits.size(); ++i) {
        const Net net = net_of(bits[i], file, "net " + name);
        const std::string bit = bits.size() == 1 ? name : fmt::format("{}[{}]", name, i);
        const bool in_a_module = name.find('.') != std::string::npos && name.find('$') == std::string::npos;
        if (in_a_module) netlist.nets_in_modules[bit] = net;
        if (net < 2) continue;
        std::string& known = netlist.net_names[net];
        if (known.empty() || bit.size() < known.size()) known = bit;
        if (in_a_module) {
          std::string& in_module = netlist.register_names[net];
          if (in_module.empty() || bit.size() < in_module.size()) in_module = bit;
        }
        netlist.next_net = std::max(netlist.next_net, net + 1);
      }
    }
  } catch (const json::exception& error) {
    throw UserError(fmt::format("{}: found another structure ({}), expected a netlist of Yosys' write_json",
                                file, error.what()));
  }
  for (const Instance& instance : netlist.instances) {
    for (const auto& [pin, net] : instance.pins) netlist.next_net = std::max(netlist.next_net, net + 1);
  }
  return netlist;
}

std::string verilog_text(const Netlist& netlist) {
  std::string text = fmt::format("module {}(", verilog_name(netlist.top));
  for (std::size_t i = 0; i < netlist.ports.size(); ++i)
    text += (i == 0 ? "" : ", ") + verilog_name(netlist.ports[i].name);
  text += ");\n";
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
  for (const Port& port : netlist.ports) {
    const std::string range = port.bits.size() == 1 ? "" : fmt::format("[{}:0] ", port.bits.size() - 1);
    text += fmt::format("  {} {}{};\n", port.is_input ? "input" : "output", range, verilog_name(port.name));
  }
  for (std::size_t net = 2; net < used.size(); ++net) {
    if (used[net]) text += fmt::format("  wire n{};\n", net);
  }
  for (const Port& port : netlist.ports) {
    for (std::size_t i = 0; i < port.bits.size(); ++i) {
      const std::string bit = verilog_name(port.name) + (port.bits.size() == 1 ? "" : fmt::format("[{}]", i));
      text += port.is_input ? fmt::format("  assign {} = {};\n", net_text(port.bits[i]), bit)
                            : fmt::format("  assign {} = {};\n", bit, net_text(port.bits[i]));
    }
  }
  for (const Instance& instance : netlist.instances) {
    text += fmt::format("  {} {} (", verilog_name(instance.type), verilog_name(instance.name));
    const char* separator = "";
    for (const auto& [pin, net] : instance.pins) {
      text += fmt::format("{}.{}({})", separator, verilog_name(pin), net_text(net));
      separator = ", ";
    }
    text += ");\n";
  }
  return text + "endmodule\n";
}

// A line a port, cell and net, as it comes: a tree of it all would take longer than the tests.
std::string yosys_json_text(const Netlist& netlist) {
  const auto quoted = [](const std::string& name) { return json(name).dump(); };
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
