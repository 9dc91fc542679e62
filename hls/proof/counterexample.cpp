// SPDX-License-Identifier: Apache-2.0
#include "hls/proof/counterexample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <unordered_map>

#include "hls/proof/engines.hpp"

namespace meltstage::hls {
namespace {

// Flops as in reset, pins low, but not that of the reset.
std::vector<bool> usual_inputs(const Circuit& model, const Problem& problem) {
  std::unordered_map<Literal, bool> high;
  for (const Flop& flop : model.flops)
    for (unsigned i = 0; i < flop.field.width; ++i)
      high[problem.state.at(bit_name(flop.field, i))] = flop.reset[i];
  if (const auto reset = problem.pins.find("rst_ni"); reset != problem.pins.end()) high[reset->second] = true;
  std::vector<bool> result;
  for (const Literal input : problem.aig.inputs()) {
    const auto found = high.find(input);
    result.push_back(found != high.end() && found->second);
  }
  return result;
}

// Of these inputs those which, changed alone, leave nothing broken; 64 of them are tried at once.
std::vector<bool> needed(const Problem& problem, const Obligation& obligation,
                         const std::vector<bool>& inputs, const std::vector<std::size_t>& asked) {
  const std::array<Literal, 2> roots = {obligation.wrong, problem.reachable};
  const std::vector<std::uint32_t> cone = problem.aig.cone(roots);
  std::vector<bool> result;
  for (std::size_t start = 0; start < asked.size(); start += kRuns) {
    const auto tried = std::span(asked).subspan(start, std::min(kRuns, asked.size() - start));
    const Pattern broken = broken_with_one_changed(problem, obligation, cone, inputs, tried);
    for (std::size_t i = 0; i < tried.size(); ++i) result.push_back((broken >> i & 1) == 0);
  }
  return result;
}

}  // namespace

std::unordered_map<std::string, std::string> words_of_bits(const Circuit& model) {
  std::unordered_map<std::string, std::string> result;
  const auto add = [&](const Field& field) {
    for (unsigned i = 0; i < field.width; ++i) result.emplace(bit_name(field, i), field.name);
  };
  for (const Flop& flop : model.flops) add(flop.field);
  for (const Pin& pin : model.outputs) add(pin.field);
  return result;
}

Counterexample make_counterexample(const Circuit& model, const Problem& problem, const Obligation& obligation,
                                   const std::vector<bool>& example) {
  const std::vector<bool> inputs = simplest(problem, obligation, example, usual_inputs(model, problem));
  const std::vector<bool> value = evaluate(problem.aig, inputs);
  const auto of = [&](Literal literal) { return value[literal / 2] != ((literal & 1) != 0); };
  const auto word = [&](const Bits& bits, const Field& field) {
    std::uint64_t result = 0;
    for (unsigned i = 0; i < field.width; ++i)
      result |= static_cast<std::uint64_t>(of(bits.at(bit_name(field, i)))) << i;
    return result;
  };
  Counterexample result{
      .kind = obligation.kind, .name = obligation.name, .state = {}, .pins = {}, .of_model = 0, .of_rtl = 0};
  for (const Flop& flop : model.flops)
    if (const std::uint64_t held = word(problem.state, flop.field); held != flop.reset.getZExtValue())
      result.state.push_back({flop.field.name, held});
  std::set<std::string> of_both;
  for (const Pin& pin : model.inputs) {
    result.pins.push_back({pin.field.name, word(problem.pins, pin.field)});
    for (unsigned i = 0; i < pin.field.width; ++i) of_both.insert(bit_name(pin.field, i));
  }
  // Of the RTL alone those are told without which the example would be none.
  std::unordered_map<Literal, std::string> names;
  for (const auto& [name, literal] : problem.pins) names[literal] = name;
  std::vector<std::size_t> alone;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (const auto pin = names.find(problem.aig.inputs()[i]);
        pin != names.end() && !of_both.contains(pin->second))
      alone.push_back(i);
  const std::vector<bool> matters = needed(problem, obligation, inputs, alone);
  for (std::size_t i = 0; i < alone.size(); ++i)
    if (inputs[alone[i]] || matters[i])
      result.pins.push_back({names.at(problem.aig.inputs()[alone[i]]), inputs[alone[i]] ? 1U : 0U});
  if (obligation.kind != Kind::kFlop && obligation.kind != Kind::kPin) return result;
  // all bits of the word, of which some may be equal
  const std::unordered_map<std::string, std::string> words = words_of_bits(model);
  const auto word_of = [&](const std::string& bit) {
    const auto found = words.find(bit);
    return found == words.end() ? bit : found->second;
  };
  result.name = word_of(obligation.name);
  for (const Obligation& other : problem.obligations) {
    if (other.kind != obligation.kind || word_of(other.name) != result.name) continue;
    unsigned bit = 0;
    if (const std::size_t bracket = other.name.rfind('['); other.name != result.name)
      bit = static_cast<unsigned>(std::stoul(other.name.substr(bracket + 1)));
    result.of_model |= static_cast<std::uint64_t>(of(other.of_model)) << bit;
    result.of_rtl |= static_cast<std::uint64_t>(of(other.of_rtl)) << bit;
  }
  return result;
}

std::string to_text(const Counterexample& example, const SideNames& names) {
  std::string text =
      fmt::format("counterexample: {}{}\n  state (what is not listed is as in reset)", example.name,
                  example.kind == Kind::kInvariant ? " does not hold in the next state" : "");
  for (const NamedValue& flop : example.state) text += fmt::format("\n    {} = {:#x}", flop.name, flop.value);
  text += "\n  pins\n   ";
  for (const NamedValue& pin : example.pins) text += fmt::format(" {}={:#x}", pin.name, pin.value);
  if (example.kind == Kind::kFlop || example.kind == Kind::kPin)
    text += fmt::format("\n  {}: {} {:#x}, {} {:#x}",
                        example.kind == Kind::kPin ? "in this state" : "after the clock", names.rtl,
                        example.of_rtl, names.model, example.of_model);
  return text + "\n";
}

std::vector<bool> carried_over(const Problem& from, const std::vector<bool>& example, const Problem& to) {
  std::unordered_map<Literal, bool> high;
  for (std::size_t i = 0; i < example.size(); ++i) high[from.aig.inputs()[i]] = example[i];
  std::unordered_map<Literal, bool> there;
  const auto carry = [&](const Bits& bits, const Bits& bits_there) {
    for (const auto& [name, literal] : bits)
      if (const auto found = high.find(literal); found != high.end())
        there[bits_there.at(name)] = found->second;
  };
  carry(from.state, to.state);
  carry(from.pins, to.pins);
  std::vector<bool> result;
  for (const Literal input : to.aig.inputs()) {
    const auto found = there.find(input);
    result.push_back(found != there.end() && found->second);
  }
  return result;
}

bool is_broken(const Problem& problem, const Obligation& obligation, const std::vector<bool>& example) {
  const std::vector<bool> value = evaluate(problem.aig, example);
  const auto of = [&](Literal literal) { return value[literal / 2] != ((literal & 1) != 0); };
  return of(obligation.wrong) && of(problem.reachable);
}

}  // namespace meltstage::hls
