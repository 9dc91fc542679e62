// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/faults.hpp"

#include <numeric>

namespace meltstage::dft {

namespace {

// Numbers of all line faults: stems, then input lines; two each.
struct Lines {
  const Circuit& circuit;

  std::size_t count() const { return 2 * (circuit.size() + circuit.input_line_count()); }
  std::uint32_t number(const Fault& fault) const {
    const std::size_t line = fault.pin == kStem ? fault.node
                                                : circuit.size() + circuit.first_input_line(fault.node) +
                                                      static_cast<std::size_t>(fault.pin);
    return static_cast<std::uint32_t>(2 * line + (fault.stuck ? 1 : 0));
  }
};

class Union {
 public:
  explicit Union(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t find(std::uint32_t x) {
    while (parent_[x] != x) x = parent_[x] = parent_[parent_[x]];
    return x;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::uint32_t> parent_;
};

// Both faults of buffers, inverters and lines without branches.
void join_along_wires(const Circuit& circuit, const Lines& lines, Union& classes) {
  const auto join = [&](Fault a, Fault b) { classes.join(lines.number(a), lines.number(b)); };
  for (Node node = 0; node < circuit.size(); ++node) {
    const auto fanin = circuit.fanin(node);
    const Gate kind = circuit.kind(node);
    for (std::int32_t pin = 0; pin < static_cast<std::int32_t>(fanin.size()); ++pin) {
      const Node driver = fanin[static_cast<std::size_t>(pin)];
      for (const bool stuck : {false, true}) {
        if (circuit.fanout(driver).size() == 1) join({driver, kStem, stuck}, {node, pin, stuck});
        if (kind == Gate::buf || kind == Gate::output) join({node, pin, stuck}, {node, kStem, stuck});
        if (kind == Gate::inv) join({node, pin, stuck}, {node, kStem, !stuck});
      }
    }
  }
}

// A controlling input and the output.
void join_at_gates(const Circuit& circuit, const Lines& lines, Union& classes) {
  for (Node node = 0; node < circuit.size(); ++node) {
    const Gate kind = circuit.kind(node);
    if (kind != Gate::all && kind != Gate::nall && kind != Gate::any && kind != Gate::none) continue;
    const bool controlling = kind == Gate::any || kind == Gate::none;
    const bool inverts = kind == Gate::nall || kind == Gate::none;
    for (std::int32_t pin = 0; pin < static_cast<std::int32_t>(circuit.fanin(node).size()); ++pin)
      classes.join(lines.number({node, pin, controlling}),
                   lines.number({node, kStem, controlling != inverts}));
  }
}

FaultList list_of(const Circuit& circuit, const Lines& lines, Union& classes) {
  FaultList list;
  std::vector<std::uint32_t> class_of_root(lines.count(), FaultList::kNoClass);
  for (const Site& site : circuit.sites()) {
    for (const bool stuck : {false, true}) {
      if (site.node == kNoNode) {
        list.class_of.push_back(FaultList::kNoClass);
        continue;
      }
      const Fault fault{site.node, site.pin, stuck};
      std::uint32_t& number = class_of_root[classes.find(lines.number(fault))];
      if (number == FaultList::kNoClass) {
        number = static_cast<std::uint32_t>(list.classes.size());
        list.classes.push_back(fault);
      }
      list.class_of.push_back(number);
    }
  }
  return list;
}

}  // namespace

const char* to_string(FaultClass c) {
  constexpr const char* kNames[] = {"NO", "NC", "DS", "DI", "PT", "UT", "UR", "AU"};
  return kNames[static_cast<std::size_t>(c)];
}

FaultList collapse(const Circuit& circuit) {
  const Lines lines{circuit};
  Union classes(lines.count());
  join_along_wires(circuit, lines, classes);
  join_at_gates(circuit, lines, classes);
  return list_of(circuit, lines, classes);
}

FaultList collapse_along_wires(const Circuit& circuit) {
  const Lines lines{circuit};
  Union classes(lines.count());
  join_along_wires(circuit, lines, classes);
  return list_of(circuit, lines, classes);
}

std::size_t Coverage::total() const { return std::accumulate(count.begin(), count.end(), std::size_t{0}); }

double Coverage::test_coverage() const {
  const std::size_t testable = total() - undetectable();
  return testable == 0 ? 1.0 : static_cast<double>(detected()) / static_cast<double>(testable);
}

double Coverage::fault_coverage() const {
  return total() == 0 ? 1.0 : static_cast<double>(detected()) / static_cast<double>(total());
}

double Coverage::fault_efficiency() const {
  const std::size_t settled = detected() + undetectable() + of(FaultClass::AU);
  return total() == 0 ? 1.0 : static_cast<double>(settled) / static_cast<double>(total());
}

std::vector<FaultClass> reported_classes(const FaultList& list, const std::vector<FaultClass>& of_class) {
  std::vector<FaultClass> reported;
  for (std::size_t fault = 0; fault < list.total(); ++fault) {
    reported.push_back(list.class_of[fault] == FaultList::kNoClass ? FaultClass::UT
                                                                   : of_class[list.class_of[fault]]);
  }
  return reported;
}

Coverage coverage(const FaultList& list, const std::vector<FaultClass>& reported) {
  Coverage result;
  for (const FaultClass c : reported) ++result.count[static_cast<std::size_t>(c)];
  result.collapsed = list.classes.size();
  return result;
}

std::string fault_name(const Circuit& circuit, std::size_t fault) {
  return circuit.sites()[fault / 2].name + (fault % 2 == 0 ? " stuck-at-0" : " stuck-at-1");
}

}  // namespace meltstage::dft
