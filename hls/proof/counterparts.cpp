// SPDX-License-Identifier: Apache-2.0
#include "hls/proof/counterparts.hpp"

#include <fmt/format.h>

#include <unordered_map>
#include <unordered_set>

#include "base/error.hpp"

namespace meltstage::hls {
namespace {

std::unordered_set<std::string> bits_of(const std::vector<Field>& fields) {
  std::unordered_set<std::string> names;
  for (const Field& field : fields)
    for (unsigned i = 0; i < field.width; ++i)
      names.insert(field.width == 1 ? field.name : fmt::format("{}[{}]", field.name, i));
  return names;
}

// Whether the roots depend on each flop, through gates, products and other flops.
std::vector<bool> flops_behind(const Rtl& rtl, std::vector<std::uint32_t> roots) {
  std::unordered_map<std::uint32_t, std::size_t> flop_at, product_at;  // by node
  for (std::size_t i = 0; i < rtl.flops.size(); ++i) flop_at[rtl.flops[i].now / 2] = i;
  for (std::size_t i = 0; i < rtl.products.size(); ++i)
    for (const std::uint32_t bit : rtl.products[i].result) product_at[bit / 2] = i;
  product_at.erase(0);
  const std::size_t inputs = rtl.gates.inputs.size();
  std::vector<bool> seen(1 + inputs + rtl.gates.ands.size()), behind(rtl.flops.size());
  while (!roots.empty()) {
    const std::uint32_t node = roots.back() / 2;
    roots.pop_back();
    if (seen[node]) continue;
    seen[node] = true;
    if (const auto flop = flop_at.find(node); flop != flop_at.end()) {
      behind[flop->second] = true;
      const RtlFlop& it = rtl.flops[flop->second];
      roots.insert(roots.end(), {it.next, it.in_reset, it.reset_value});
    } else if (const auto product = product_at.find(node); product != product_at.end()) {
      for (const auto* operand : {&rtl.products[product->second].a, &rtl.products[product->second].b})
        roots.insert(roots.end(), operand->begin(), operand->end());
    } else if (node > inputs) {
      const Aig::And& gate = rtl.gates.ands[node - inputs - 1];
      roots.insert(roots.end(), {gate.a, gate.b});
    }
  }
  return behind;
}

struct Told {
  std::string name, place;
};

// Of a flop's bit: the flop, and where it stands.
Told told(const Rtl& rtl, const std::string& bit) {
  for (const std::string& name : {bit, bit.substr(0, bit.rfind('['))})
    if (const auto found = rtl.netlist.flop_places.find(name); found != rtl.netlist.flop_places.end())
      return {name, found->second};
  return {bit, "RTL"};
}

// Yosys gives a flop without a name to a variable in a clocked process that some path leaves as it was.
[[noreturn]] void refuse_nameless(const Rtl& rtl, std::size_t nameless,
                                  const std::vector<std::string>& counterparts) {
  Told user{"", "RTL"};
  for (std::size_t i = 0; i < rtl.flops.size() && user.name.empty(); ++i)
    if (!counterparts[i].empty() && flops_behind(rtl, {rtl.flops[i].next})[nameless])
      user = told(rtl, counterparts[i]);
  throw UserError(fmt::format(
      "{}: found a variable or a function's result {}that keeps its last value where no path assigns it, "
      "expected each path to assign it",
      user.place, user.name.empty() ? "" : fmt::format("behind flop {} ", user.name)));
}

}  // namespace

std::vector<std::string> counterparts(const Circuit& model, const Rtl& rtl) {
  std::vector<Field> fields;
  for (const Flop& flop : model.flops) fields.push_back(flop.field);
  const std::unordered_set<std::string> known = bits_of(fields);
  std::vector<std::string> result;
  std::vector<std::uint32_t> roots;
  for (const RtlFlop& flop : rtl.flops) {
    std::string& counterpart = result.emplace_back();
    for (const std::string& name : flop.names)
      if (counterpart.empty() && known.contains(name)) counterpart = name;
    if (!counterpart.empty()) roots.insert(roots.end(), {flop.next, flop.in_reset, flop.reset_value});
  }
  fields.clear();
  for (const Pin& pin : model.outputs) fields.push_back(pin.field);
  for (const std::string& name : bits_of(fields))
    if (const auto pin = rtl.outputs.find(name); pin != rtl.outputs.end()) roots.push_back(pin->second);
  const std::vector<bool> behind = flops_behind(rtl, std::move(roots));
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (!result[i].empty() || !behind[i]) continue;
    if (rtl.flops[i].names.empty()) refuse_nameless(rtl, i, result);
    const auto [name, place] = told(rtl, rtl.flops[i].names.front());
    throw UserError(fmt::format("{}: found flop {}, which the C++ has not", place, name));
  }
  return result;
}

}  // namespace meltstage::hls
