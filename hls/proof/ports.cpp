// SPDX-License-Identifier: Apache-2.0
#include "hls/proof/ports.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "base/error.hpp"
#include "hls/graph/reset_domain.hpp"
#include "hls/proof/counterparts.hpp"

namespace meltstage::hls {
namespace {

constexpr const char* kInputs = "hls_input_pins";
constexpr const char* kOutputs = "hls_output_pins";

void require_same(const std::vector<Pin>& pins, const char* table, bool are_inputs,
                  const std::map<std::string, RtlPort>& ports) {
  for (const Pin& pin : pins) {
    const std::string& name = pin.field.name;
    const auto port = ports.find(name);
    const char* direction = are_inputs ? "input" : "output";
    if (port == ports.end())
      throw UserError(fmt::format("RTL: found no {} {} of {} bits, expected it as in {}", direction, name,
                                  pin.field.width, table));
    if (port->second.is_input != are_inputs)
      throw UserError(fmt::format("{}: found {} {}, expected an {} as in {}", port->second.place,
                                  are_inputs ? "output" : "input", name, direction, table));
    if (port->second.width != pin.field.width)
      throw UserError(fmt::format("{}: found pin {} of {} bits, expected {} as in {}", port->second.place,
                                  name, port->second.width, pin.field.width, table));
  }
}

void require_single_bits(const TiedPins& tied, const Rtl& rtl) {
  for (const auto& [name, value] : tied) {
    if (rtl.inputs.contains(name)) continue;
    const auto port = rtl.netlist.ports.find(name);
    if (port == rtl.netlist.ports.end() || !port->second.is_input)
      throw UserError(fmt::format("--tie: found {}, expected an input pin of the RTL or a bit of one", name));
    throw UserError(fmt::format("--tie: found {}, a pin of {} bits, expected one bit of it, as {}[0]={}",
                                name, port->second.width, name, value ? 1 : 0));
  }
}

// Flops of which the RTL resets each bit at once.
std::set<std::string> reset_at_once(const Circuit& model, const Rtl& rtl) {
  std::set<std::string> bits, result;
  for (const RtlFlop& flop : rtl.flops)
    if (flop.in_reset != kFalse) bits.insert(flop.names.begin(), flop.names.end());
  for (const Flop& flop : model.flops) {
    bool all = true;
    for (unsigned i = 0; i < flop.field.width; ++i)
      all = all && (!flop.field.kept[i] || bits.contains(bit_name(flop.field, i)));
    if (all) result.insert(flop.field.name);
  }
  return result;
}

}  // namespace

void require_same_pins(const Circuit& model, const Rtl& rtl, const TiedPins& tied) {
  require_same(model.inputs, kInputs, true, rtl.netlist.ports);
  require_same(model.outputs, kOutputs, false, rtl.netlist.ports);
  require_single_bits(tied, rtl);
  if (!rtl.netlist.mixed_reset.empty() && !model.in_reset)
    throw UserError(rtl.netlist.mixed_reset +
                    ", expected one pin or flop alone, or hls_in_reset() in the C++ (hls/interface.hpp)");
}

std::vector<std::string> notes_of(const Circuit& model, const Rtl& rtl, const TiedPins& tied) {
  std::vector<std::string> result;
  for (const auto& [by, bits] : rtl.netlist.reset_by)
    result.push_back(by.empty() ? fmt::format("RTL: {} flop bits are not reset before a clock", bits)
                                : fmt::format("RTL: {} flop bits are reset at once by {}", bits, by));
  if (!rtl.array_note.empty()) result.push_back(rtl.array_note);
  const std::vector<std::string> unset =
      never_reset(model, reset_at_once(model, rtl), tied.contains("rst_ni") && tied.at("rst_ni"));
  if (!unset.empty())
    result.push_back(fmt::format("nothing resets {}: both sides stay equal only if they begin so",
                                 fmt::join(unset, ", ")));
  std::set<std::string> unread;
  const std::vector<std::string> names = counterparts(model, rtl);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i].empty() && !rtl.flops[i].names.empty())
      unread.insert(rtl.flops[i].names.front().substr(0, rtl.flops[i].names.front().rfind('[')));
  if (!unread.empty())
    result.push_back(
        fmt::format("RTL: {} not compared, since nothing depends on it and the C++ has no such flop",
                    fmt::join(unread, ", ")));
  std::string others;
  for (const auto& [name, port] : rtl.netlist.ports) {
    const bool is_known = std::any_of(model.outputs.begin(), model.outputs.end(),
                                      [&](const Pin& pin) { return pin.field.name == name; });
    if (!port.is_input && !is_known) others += (others.empty() ? "" : ", ") + name;
  }
  if (!others.empty())
    result.push_back(fmt::format("RTL: {} not compared, since the C++ has no such output", others));
  return result;
}

}  // namespace meltstage::hls
