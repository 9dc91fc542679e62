// SPDX-License-Identifier: Apache-2.0
#include "hls/proof/equivalence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "base/error.hpp"
#include "hls/graph/reset_domain.hpp"
#include "hls/proof/counterparts.hpp"

namespace meltstage::hls {
namespace {

std::string block_of(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? "top" : name.substr(0, dot);
}

// The invariants hold.
Literal reachable_states(const Circuit& model, Aig& aig, Blaster& gates) {
  Literal reachable = kTrue;
  for (const Invariant& invariant : model.invariants)
    reachable = aig.both(reachable, gates.bits(invariant.now)[0]);
  return reachable;
}

constexpr const char* kClock = "clk_i";

// The RTL's gates, copied into the common graph as they are asked for.
class RtlSide {
 public:
  // `names`: those of the flops, as counterparts() gives them.
  RtlSide(Aig& aig, const Rtl& rtl, const std::vector<std::string>& names, const Bits& state,
          const Bits& pins)
      : aig_(aig), rtl_(rtl) {
    known_.resize(1 + rtl.gates.inputs.size() + rtl.gates.ands.size());
    known_[0] = kFalse;
    for (std::size_t i = 0; i < rtl.flops.size(); ++i) flop_at_[rtl.flops[i].now / 2] = i;
    for (const auto& [name, literal] : rtl.inputs) {
      if (name != kClock) known_[literal / 2] = pins.at(name);
    }
    for (const std::string& name : names) held_.push_back(name.empty() ? kFalse : state.at(name));
  }

  // What a literal of the RTL is, given that flops show what they hold unless they are in reset.
  Literal at(std::uint32_t literal) {
    std::vector<std::uint32_t> open = {literal / 2};
    while (!open.empty()) {
      const std::uint32_t node = open.back();
      if (known_[node]) {
        open.pop_back();
        continue;
      }
      if (open.size() > known_.size())
        throw UserError("RTL: found a reset that depends on a flop which it resets, expected none");
      const std::size_t inputs = rtl_.gates.inputs.size();
      const auto flop = flop_at_.find(node);
      if (flop == flop_at_.end() && node <= inputs)
        throw UserError(fmt::format("RTL: found {} used as data, expected it as a clock alone",
                                    rtl_.gates.inputs[node - 1]));
      const std::pair<std::uint32_t, std::uint32_t> needs =
          flop != flop_at_.end()
              ? std::pair(rtl_.flops[flop->second].in_reset, rtl_.flops[flop->second].reset_value)
              : std::pair(rtl_.gates.ands[node - inputs - 1].a, rtl_.gates.ands[node - inputs - 1].b);
      bool ready = true;
      for (const std::uint32_t need : {needs.first, needs.second}) {
        if (known_[need / 2]) continue;
        open.push_back(need / 2);
        ready = false;
      }
      if (!ready) continue;
      open.pop_back();
      known_[node] = flop != flop_at_.end()
                         ? aig_.select(got(needs.first), got(needs.second), held_[flop->second])
                         : aig_.both(got(needs.first), got(needs.second));
    }
    return got(literal);
  }

  void give(std::uint32_t literal, Literal value) { known_[literal / 2] = value ^ (literal & 1); }

  Word at(const std::vector<std::uint32_t>& literals) {
    Word result;
    for (const std::uint32_t literal : literals) result.push_back(at(literal));
    return result;
  }

  Literal next(const RtlFlop& flop) {
    return aig_.select(at(flop.in_reset), at(flop.reset_value), at(flop.next));
  }

 private:
  Literal got(std::uint32_t literal) const { return *known_[literal / 2] ^ (literal & 1); }

  Aig& aig_;
  const Rtl& rtl_;
  std::vector<std::optional<Literal>> known_;
  std::unordered_map<std::uint32_t, std::size_t> flop_at_;
  std::vector<Literal> held_;
};

class Builder {
 public:
  Builder(const Circuit& model, const Rtl& rtl, Products products, const TiedPins& tied)
      : model_(model), rtl_(rtl), names_(counterparts(model, rtl)), products_(products), tied_(tied) {}

  Problem run() {
    make_inputs();
    RtlSide rtl(problem_.aig, rtl_, names_, problem_.state, problem_.pins);
    const std::vector<Product> products = cut_products(rtl);
    compare_flops(rtl, products);
    compare_pins(rtl, products);
    return std::move(problem_);
  }

 private:
  void make_inputs() {
    Aig& aig = problem_.aig;
    for (const Flop& flop : model_.flops) {
      for (unsigned i = 0; i < flop.field.width; ++i)
        problem_.state[bit_name(flop.field, i)] =
            flop.field.kept[i] ? aig.input() : aig.constant(flop.reset[i]);
    }
    for (const Pin& pin : model_.inputs) {
      for (unsigned i = 0; i < pin.field.width; ++i) {
        const std::string name = bit_name(pin.field, i);
        if (!rtl_.inputs.contains(name))
          throw UserError(fmt::format("RTL: found no input pin {}, which the C++ has", name));
        problem_.pins[name] = aig.input();
      }
    }
    for (const auto& [name, value] : tied_) {
      if (!rtl_.inputs.contains(name) && !problem_.pins.contains(name))
        throw UserError(fmt::format("{}: found no pin of this name to tie", name));
      problem_.pins[name] = aig.constant(value);
    }
    for (const auto& [name, literal] :
         rtl_.inputs)  // in the order of their names, for the same graph each time
      if (name != kClock && !problem_.pins.contains(name)) problem_.pins[name] = aig.input();
  }

  // Where the C++ multiplies by a constant it has gates, and not a product of two variables. So the named
  // result of a and b is known where a is one of those constants.
  Word with_constants(const Word& a, const Word& b, Word result) {
    Aig& aig = problem_.aig;
    Blaster gates(model_.graph, aig, problem_.state, {});
    const Word factor = without_repeated_sign(b);
    for (const APInt& constant : constant_factors(without_repeated_sign(a).size() - 1)) {
      Word digits;
      Literal same = kTrue;
      for (unsigned i = 0; i < kProductBits; ++i) {
        digits.push_back(aig.constant(constant[i]));
        same = aig.both(same, aig.differ(a[i], digits[i]) ^ 1);
      }
      const std::size_t bits = std::min<std::size_t>(kProductBits, factor.size() + constant.getActiveBits());
      digits.resize(bits);
      const Word product = wide(gates.product(wide(factor, bits), digits), kProductBits);
      for (unsigned i = 0; i < kProductBits; ++i) result[i] = aig.select(same, product[i], result[i]);
    }
    return result;
  }

  // Factors that are small and not negative have a small product. It matters where the C++ multiplies in
  // fewer bits and takes the others as 0.
  Word bounded(const Word& a, const Word& b, Word result) {
    Aig& aig = problem_.aig;
    const auto fits = [&](const Word& word, unsigned bits) {
      Literal above = kFalse;
      for (std::size_t i = bits; i < word.size(); ++i) above = aig.either(above, word[i]);
      return above ^ 1;
    };
    for (const auto& [x, y] : widths_of_factors()) {
      const Literal small = aig.either(aig.both(fits(a, x), fits(b, y)), aig.both(fits(a, y), fits(b, x)));
      for (std::size_t i = x + y; i < kProductBits; ++i) result[i] = aig.both(result[i], small ^ 1);
    }
    return result;
  }

  std::set<std::pair<unsigned, unsigned>> widths_of_factors() const {
    std::set<std::pair<unsigned, unsigned>> result;
    for (Node node = 0; node < model_.graph.size(); ++node) {
      const Expression& e = model_.graph[node];
      if (e.op != Op::kMul || model_.graph.is_constant(e.arguments[1])) continue;
      const unsigned x = model_.graph[e.arguments[0]].used, y = model_.graph[e.arguments[1]].used;
      if (x + y <= e.width) result.insert(std::minmax(x, y));
    }
    return result;
  }

  static Word wide(Word word, std::size_t bits) {
    word.resize(bits, word.back());
    return word;
  }

  static Word without_repeated_sign(Word word) {
    while (word.size() > 1 && word.back() == word[word.size() - 2]) word.pop_back();
    return word;
  }

  // What the C++ multiplies by, of at most so many bits and without sign. The compiler moves shifts from one
  // factor to the other one: so each is taken with any number of zeros at its end.
  std::vector<APInt> constant_factors(std::size_t bits) const {
    std::vector<APInt> result;
    for (Node node = 0; node < model_.graph.size(); ++node) {
      const Expression& e = model_.graph[node];
      if (e.op != Op::kMul || !model_.graph.is_constant(e.arguments[1])) continue;
      APInt value = model_.graph.value(e.arguments[1]).zextOrTrunc(kProductBits);
      value.lshrInPlace(value.countTrailingZeros());
      if (std::find(result.begin(), result.end(), value) != result.end()) continue;
      for (; !value.isZero() && value.getActiveBits() <= bits; value <<= 1) result.push_back(value);
    }
    return result;
  }

  std::vector<Product> cut_products(RtlSide& rtl) {
    std::vector<Product> products;
    for (const RtlProduct& product : rtl_.products) {
      Word result;
      if (products_ == Products::kNamed) {
        const Word a = rtl.at(product.a), b = rtl.at(product.b);
        // a product has as many bits as both factors, and its sign above them
        const std::size_t bits = without_repeated_sign(a).size() + without_repeated_sign(b).size();
        while (result.size() < std::min<std::size_t>(bits, kProductBits))
          result.push_back(problem_.aig.input());
        result = wide(std::move(result), kProductBits);
        result = with_constants(a, b, bounded(a, b, std::move(result)));
      } else {
        result = Blaster(model_.graph, problem_.aig, problem_.state, {})
                     .product(rtl.at(product.a), rtl.at(product.b));
      }
      for (unsigned i = 0; i < kProductBits; ++i)
        if (product.result[i] != 0) rtl.give(product.result[i], result[i]);
      if (products_ == Products::kNamed) products.push_back({rtl.at(product.a), rtl.at(product.b), result});
    }
    return products;
  }

  void compare_flops(RtlSide& rtl, const std::vector<Product>& products) {
    Aig& aig = problem_.aig;
    Bits inputs = problem_.pins;
    inputs.insert(problem_.state.begin(), problem_.state.end());
    Blaster model(model_.graph, aig, inputs, products);
    problem_.reachable = reachable_states(model_, aig, model);

    std::unordered_map<std::string, const RtlFlop*> flop_of;
    for (std::size_t i = 0; i < names_.size(); ++i) flop_of[names_[i]] = &rtl_.flops[i];
    for (const Flop& flop : model_.flops) {
      for (unsigned i = 0; i < flop.field.width; ++i) {
        const std::string name = bit_name(flop.field, i);
        const auto counterpart = flop_of.find(name);
        if (counterpart == flop_of.end()) {
          if (!flop.field.kept[i]) continue;  // a constant on both sides
          throw UserError(fmt::format("RTL: found no flop {}, which the C++ has", name));
        }
        add(Kind::kFlop, name, model.bits(flop.next)[i], rtl.next(*counterpart->second));
        require_same_start(name, flop.reset[i], *counterpart->second);
      }
    }
    for (const Invariant& invariant : model_.invariants)
      problem_.obligations.push_back({Kind::kInvariant, invariant.name, "invariants",
                                      model.bits(invariant.next)[0] ^ 1, kFalse, kFalse});
    for (const Promise& promise : model_.promises)
      problem_.obligations.push_back(
          {Kind::kPromise, fmt::format("{}:{}: {}", promise.place.file, promise.place.line, promise.what),
           "promises", model.bits(promise.broken)[0], kFalse, kFalse});
  }

  // Both sides begin in the state of hls_reset(), so it has to be the one that the RTL's reset pins give.
  void require_same_start(const std::string& name, bool reset, const RtlFlop& flop) {
    const bool is_reset = flop.in_reset != kFalse;
    if (!is_reset || flop.reset_value == (reset ? kTrue : kFalse)) return;
    problem_.obligations.push_back(
        {Kind::kPromise, fmt::format("{}: hls_reset() gives another value than the RTL's reset", name),
         block_of(name), kTrue, kFalse, kFalse});
  }

  void compare_pins(RtlSide& rtl, const std::vector<Product>& products) {
    Bits shown = problem_.pins;
    shown.insert(problem_.state.begin(), problem_.state.end());
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (!names_[i].empty()) shown[names_[i]] = rtl.at(rtl_.flops[i].now);
    Blaster model(model_.graph, problem_.aig, shown, products);
    for (const Pin& pin : model_.outputs) {
      for (unsigned i = 0; i < pin.field.width; ++i) {
        const std::string name = bit_name(pin.field, i);
        const auto counterpart = rtl_.outputs.find(name);
        if (counterpart == rtl_.outputs.end())
          throw UserError(fmt::format("RTL: found no output pin {}, which the C++ has", name));
        add(Kind::kPin, name, model.bits(pin.node)[i], rtl.at(counterpart->second));
      }
    }
  }

  void add(Kind kind, const std::string& name, Literal model, Literal rtl) {
    problem_.obligations.push_back({kind, name, kind == Kind::kPin ? "pins" : block_of(name),
                                    problem_.aig.differ(model, rtl), model, rtl});
  }

  const Circuit& model_;
  const Rtl& rtl_;
  std::vector<std::string> names_;  // of rtl_.flops
  Products products_;
  const TiedPins& tied_;
  Problem problem_;
};

}  // namespace

Problem make_problem(const Circuit& model, const Rtl& rtl, Products products, const TiedPins& tied) {
  return Builder(model, rtl, products, tied).run();
}

namespace {

// Inputs of `circuit` in the common graph, made where the other side has not made them.
Bits inputs_of(const Circuit& circuit, Problem& problem) {
  Aig& aig = problem.aig;
  const auto add = [&](Bits& bits, const Field& field, const APInt* reset) {
    for (unsigned i = 0; i < field.width; ++i) {
      const std::string name = bit_name(field, i);
      if (bits.contains(name)) continue;
      bits[name] = reset != nullptr && !field.kept[i] ? aig.constant((*reset)[i]) : aig.input();
    }
  };
  for (const Flop& flop : circuit.flops) add(problem.state, flop.field, &flop.reset);
  for (const Pin& pin : circuit.inputs) add(problem.pins, pin.field, nullptr);
  Bits all = problem.pins;
  all.insert(problem.state.begin(), problem.state.end());
  return all;
}

void require_pins(const Circuit& circuit, const TiedPins& tied) {
  for (const auto& [name, value] : tied) {
    std::string wider;
    bool found = false;
    for (const Pin& pin : circuit.inputs) {
      for (unsigned i = 0; i < pin.field.width; ++i) found = found || bit_name(pin.field, i) == name;
      if (pin.field.name == name) wider = fmt::format(" of one bit, such as {}", bit_name(pin.field, 0));
    }
    if (!found)
      throw UserError(fmt::format("--tie: found no input pin {}{}, which the C++ should have", name, wider));
  }
}

// Both have to begin alike.
void compare_reset(Problem& problem, const Circuit& one, const Circuit& other) {
  for (std::size_t i = 0; i < one.flops.size(); ++i)
    for (unsigned k = 0; k < one.flops[i].field.width; ++k) {
      const Literal a = problem.aig.constant(one.flops[i].reset[k]),
                    b = problem.aig.constant(other.flops[i].reset[k]);
      if (a != b)
        problem.obligations.push_back({Kind::kPin, bit_name(one.flops[i].field, k) + " in reset",
                                       block_of(one.flops[i].field.name), problem.aig.differ(a, b), a, b});
    }
}

template <class Named>
void require_same_names(const std::vector<Named>& one, const std::vector<Named>& other, const char* what) {
  for (std::size_t i = 0; i < std::max(one.size(), other.size()); ++i) {
    const auto name = [&](const std::vector<Named>& side) {
      return i < side.size() ? fmt::format("{} of {} bits", side[i].field.name, side[i].field.width)
                             : std::string("none");
    };
    if (name(one) != name(other))
      throw UserError(fmt::format("{} {}: found {}, expected {} as the first way has it", what, i + 1,
                                  name(other), name(one)));
  }
}

}  // namespace

Problem make_problem(const Circuit& one, const Circuit& other) {
  require_same_names(one.flops, other.flops, "flop");
  require_same_names(one.inputs, other.inputs, "input pin");
  require_same_names(one.outputs, other.outputs, "output pin");
  Problem problem;
  const Bits inputs = inputs_of(one, problem);
  Blaster gates(one.graph, problem.aig, inputs, {});
  Blaster others(other.graph, problem.aig, inputs, {});
  problem.reachable = reachable_states(one, problem.aig, gates);
  const auto compare = [&](Kind kind, const Field& field, Node a, Node b) {
    for (unsigned i = 0; i < field.width; ++i) {
      const Literal of_one = gates.bits(a)[i], of_other = others.bits(b)[i];
      problem.obligations.push_back({kind, bit_name(field, i),
                                     kind == Kind::kPin ? "pins" : block_of(field.name),
                                     problem.aig.differ(of_one, of_other), of_one, of_other});
    }
  };
  for (std::size_t i = 0; i < one.flops.size(); ++i)
    compare(Kind::kFlop, one.flops[i].field, one.flops[i].next, other.flops[i].next);
  for (std::size_t i = 0; i < one.outputs.size(); ++i)
    compare(Kind::kPin, one.outputs[i].field, one.outputs[i].node, other.outputs[i].node);
  compare_reset(problem, one, other);
  if (one.in_reset.has_value() != other.in_reset.has_value())
    throw UserError(
        fmt::format("hls_in_reset(): found {} it, expected the same of both ways",
                    one.in_reset ? "the first way alone to have" : "the other way alone to have"));
  if (one.in_reset)
    compare(Kind::kPin, {"hls_in_reset()", 0, 1, 1, false, APInt(1, 1)}, *one.in_reset, *other.in_reset);
  return problem;
}

Problem make_switches(Circuit model, const TiedPins& tied) {
  std::vector<std::optional<Node>> out_of_reset(model.flops.size());
  if (model.in_reset) out_of_reset = next_out_of_reset(model, *model.in_reset);
  Problem problem;
  for (const auto& [name, value] : tied) problem.pins[name] = problem.aig.constant(value);
  require_pins(model, tied);
  const Bits inputs = inputs_of(model, problem);
  Blaster gates(model.graph, problem.aig, inputs, {});
  problem.reachable = reachable_states(model, problem.aig, gates);
  for (std::size_t k = 0; k < model.flops.size(); ++k) {
    const Flop& flop = model.flops[k];
    const Literal works = out_of_reset[k] ? gates.bits(*model.in_reset)[0] ^ 1 : kTrue;
    for (unsigned i = 0; i < flop.field.width; ++i) {
      if (!flop.field.kept[i]) continue;
      const std::string name = bit_name(flop.field, i);
      const Literal now = problem.state.at(name), next = gates.bits(flop.next)[i];
      const auto add = [&](const char* what, Literal switches) {
        problem.obligations.push_back({Kind::kFlop, name + what, block_of(flop.field.name),
                                       problem.aig.both(works, switches), now, next});
      };
      add(" never rises", problem.aig.both(now ^ 1, next));
      add(" never falls", problem.aig.both(now, next ^ 1));
    }
  }
  // these hold for all values of the pins, or of no use
  Bits untied = inputs;
  for (const auto& [name, value] : tied) untied[name] = problem.aig.input();
  Blaster all_pins(model.graph, problem.aig, untied, {});
  for (const Invariant& invariant : model.invariants)
    problem.obligations.push_back({Kind::kInvariant, invariant.name, "invariants",
                                   all_pins.bits(invariant.next)[0] ^ 1, kFalse, kFalse});
  return problem;
}

void add_promises(Problem& problem, const Circuit& trapped) {
  Bits inputs = problem.pins;
  inputs.insert(problem.state.begin(), problem.state.end());
  Blaster blaster(trapped.graph, problem.aig, inputs, {});
  for (const Promise& promise : trapped.promises)
    problem.obligations.push_back(
        {Kind::kPromise, fmt::format("{}:{}: {}", promise.place.file, promise.place.line, promise.what),
         "promises", blaster.bits(promise.broken)[0], kFalse, kFalse});
}

}  // namespace meltstage::hls
