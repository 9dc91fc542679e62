// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/podem.hpp"

namespace meltstage::dft {

namespace {

constexpr std::uint32_t kNever = 1'000'000;  // cost of what can't be had
constexpr std::size_t kBacktracks = 12;
constexpr std::size_t kWork = 20'000;  // gates looked at

std::uint64_t mixed(std::uint64_t x) {  // S. Vigna's splitmix64
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9U;
  x = (x ^ x >> 27) * 0x94D049BB133111EBU;
  return x ^ x >> 31;
}

std::uint32_t sum(std::uint32_t a, std::uint32_t b) { return std::min(a + b, kNever); }

bool is_and(Gate kind) { return kind == Gate::all || kind == Gate::nall; }
bool is_or(Gate kind) { return kind == Gate::any || kind == Gate::none; }
bool inverts(Gate kind) {
  return kind == Gate::inv || kind == Gate::nall || kind == Gate::none || kind == Gate::same;
}

// A gate's value from values 0, 1 and 2 (unknown) of its inputs.
template <class Value>
std::uint8_t three_valued(Gate kind, std::size_t inputs, const Value& value) {
  constexpr std::uint8_t kUnknown = 2;
  if (kind == Gate::mux) {
    const std::uint8_t select = value(2);
    if (select != kUnknown) return value(select);
    return value(0) == value(1) ? value(0) : kUnknown;
  }
  std::uint8_t result = value(0);
  if (is_and(kind) || is_or(kind)) {
    const std::uint8_t controlling = is_or(kind) ? 1 : 0;
    for (std::size_t pin = 1; pin < inputs && result != controlling; ++pin) {
      const std::uint8_t v = value(pin);
      if (v == controlling || v == kUnknown) result = v;
    }
  } else {
    for (std::size_t pin = 1; pin < inputs && result != kUnknown; ++pin) {
      const std::uint8_t v = value(pin);
      result = v == kUnknown ? v : result ^ v;
    }
  }
  return result == kUnknown || !inverts(kind) ? result : result ^ 1U;
}

}  // namespace

Podem::Podem(const Circuit& circuit)
    : circuit_(circuit),
      control_(circuit.size()),
      observe_(circuit.size(), kNever),
      value_(circuit.size()),
      pending_(circuit.size() / 64 + 1, 0),
      seen_(circuit.size(), 0),
      lifter_(circuit) {
  const std::vector<std::int8_t> held = constants(circuit, circuit.held());
  for (Node node = 0; node < circuit.size(); ++node) {
    const std::uint8_t value = held[node] < 0 ? kX : static_cast<std::uint8_t>(held[node]);
    value_[node] = static_cast<std::uint8_t>(value | value << 2);
  }
  measure();
}

// Costs of values and of showing a line, roughly the inputs that have to be set.
void Podem::measure() {
  for (Node node = 0; node < circuit_.size(); ++node) {
    auto& control = control_[node];
    if (good(node) != kX) {
      control[good(node)] = 0;
      control[good(node) ^ 1U] = kNever;
      continue;
    }
    const auto fanin = circuit_.fanin(node);
    const Gate kind = circuit_.kind(node);
    if (fanin.empty()) {
      control = {1, 1};
      continue;
    }
    if (kind == Gate::mux) {
      for (const std::uint8_t v : {std::uint8_t{0}, std::uint8_t{1}})
        control[v] = sum(1, std::min(sum(cost(fanin[2], 0), cost(fanin[0], v)),
                                     sum(cost(fanin[2], 1), cost(fanin[1], v))));
      continue;
    }
    std::array<std::uint32_t, 2> cheap{cost(fanin[0], 0), cost(fanin[0], 1)};
    for (std::size_t pin = 1; pin < fanin.size(); ++pin) {
      const std::array<std::uint32_t, 2> next{cost(fanin[pin], 0), cost(fanin[pin], 1)};
      if (is_and(kind))
        cheap = {std::min(cheap[0], next[0]), sum(cheap[1], next[1])};
      else if (is_or(kind))
        cheap = {sum(cheap[0], next[0]), std::min(cheap[1], next[1])};
      else
        cheap = {std::min(sum(cheap[0], next[0]), sum(cheap[1], next[1])),
                 std::min(sum(cheap[0], next[1]), sum(cheap[1], next[0]))};
    }
    if (inverts(kind)) std::swap(cheap[0], cheap[1]);
    control = {sum(cheap[0], 1), sum(cheap[1], 1)};
  }
  for (Node node = static_cast<Node>(circuit_.size()); node-- > 0;) {
    if (circuit_.kind(node) == Gate::output) observe_[node] = 0;
    const auto fanin = circuit_.fanin(node);
    const Gate kind = circuit_.kind(node);
    for (std::size_t pin = 0; pin < fanin.size() && observe_[node] < kNever; ++pin) {
      std::uint32_t total = sum(observe_[node], 1);
      if (kind == Gate::mux) {
        total = sum(total, pin < 2 ? cost(fanin[2], static_cast<std::uint8_t>(pin))
                                   : std::min(sum(cost(fanin[0], 0), cost(fanin[1], 1)),
                                              sum(cost(fanin[0], 1), cost(fanin[1], 0))));
      } else {
        for (std::size_t other = 0; other < fanin.size(); ++other) {
          if (other == pin) continue;
          total = sum(total, is_and(kind)  ? cost(fanin[other], 1)
                             : is_or(kind) ? cost(fanin[other], 0)
                                           : std::min(cost(fanin[other], 0), cost(fanin[other], 1)));
        }
      }
      observe_[fanin[pin]] = std::min(observe_[fanin[pin]], total);
    }
  }
}

// The cost times 1 to 126, drawn for the fault at hand. If all faults took what is cheapest, those that lie
// together would set the same few lines, each to what it needs, and their cubes would seldom merge.
std::uint32_t Podem::drawn(std::uint32_t cost, std::uint32_t choice) const {
  if (cost >= kNever) return cost;
  return cost + static_cast<std::uint32_t>(cost * (mixed(salt_ << 32 ^ choice) % 1000) / 8);
}

void Podem::wake(Node node) {
  pending_[node / 64] |= std::uint64_t{1} << (node % 64);
  first_pending_ = std::min<std::size_t>(first_pending_, node / 64);
}

void Podem::set(Node node, std::uint8_t value) {
  trail_.push_back({node, value_[node]});
  value_[node] = value;
  for (const Node next : circuit_.fanout(node)) wake(next);
}

std::uint8_t Podem::evaluate(Node node) const {
  const auto fanin = circuit_.fanin(node);
  const Gate kind = circuit_.kind(node);
  const bool is_site = node == fault_.node;
  std::uint8_t good_value = good(node);
  if (!fanin.empty())
    good_value = three_valued(kind, fanin.size(), [&](std::size_t pin) { return good(fanin[pin]); });
  std::uint8_t bad_value = good_value;
  if (is_site && fault_.pin == kStem) {
    bad_value = fault_.stuck ? 1 : 0;
  } else if (is_site || std::any_of(fanin.begin(), fanin.end(), [&](Node n) { return good(n) != bad(n); })) {
    bad_value = three_valued(kind, fanin.size(), [&](std::size_t pin) -> std::uint8_t {
      if (is_site && static_cast<std::int32_t>(pin) == fault_.pin) return fault_.stuck ? 1 : 0;
      return bad(fanin[pin]);
    });
  }
  return static_cast<std::uint8_t>(good_value | bad_value << 2);
}

void Podem::imply() {
  for (std::size_t word = first_pending_; word < pending_.size(); ++word) {
    while (pending_[word] != 0) {
      const Node node =
          static_cast<Node>(64 * word + static_cast<std::size_t>(__builtin_ctzll(pending_[word])));
      pending_[word] &= pending_[word] - 1;
      ++work_;
      const std::uint8_t value = evaluate(node);
      if (value != value_[node]) set(node, value);
    }
  }
  first_pending_ = pending_.size();
}

void Podem::undo(std::size_t mark) {
  while (trail_.size() > mark) {
    value_[trail_.back().node] = trail_.back().before;
    trail_.pop_back();
  }
}

bool Podem::search(const Fault& fault, Cube& cube) {
  if (observe_[fault.node] >= kNever) return false;
  fault_ = fault;
  line_ = fault.pin == kStem ? fault.node : circuit_.fanin(fault.node)[static_cast<std::size_t>(fault.pin)];
  work_ = 0;
  salt_ = 2 * std::uint64_t{fault.node} + (fault.stuck ? 1 : 0);
  first_pending_ = pending_.size();
  wake(fault.node);
  imply();
  bool found = false;
  for (std::size_t backtracks = 0; backtracks <= kBacktracks && work_ <= kWork;) {
    Goal goal;
    const Outlook outlook = look(goal);
    if (outlook == Outlook::test) {
      found = true;
      break;
    }
    if (outlook == Outlook::dead) {
      ++backtracks;
      if (!backtrack()) break;
    } else {
      decisions_.push_back(backtrace(goal));
      decisions_.back().mark = trail_.size();
    }
    const Decision& last = decisions_.back();
    const std::uint8_t bad_value = last.input == fault.node ? (fault.stuck ? 1 : 0) : last.value;
    set(last.input, static_cast<std::uint8_t>(last.value | bad_value << 2));
    imply();
  }
  if (found)
    lifter_.lift(
        fault, shown_, [&](Node node) { return good(node); }, [&](Node node) { return bad(node); }, cube);
  undo(0);
  decisions_.clear();
  return found;
}

// The last decision that was not turned round is; false when there is none.
bool Podem::backtrack() {
  while (!decisions_.empty()) {
    Decision& last = decisions_.back();
    undo(last.mark);
    if (!last.flipped) {
      last.flipped = true;
      last.value ^= 1U;
      return true;
    }
    decisions_.pop_back();
  }
  return false;
}

// Where the search stands, and what to aim at next.
Podem::Outlook Podem::look(Goal& goal) {
  const std::uint8_t stuck = fault_.stuck ? 1 : 0;
  if (good(line_) == stuck) return Outlook::dead;
  if (fault_.launch != kNoNode && good(fault_.launch) == (stuck ^ 1U)) return Outlook::dead;
  // the line before the transition first: a flop that keeps its value is the easiest way to the other value
  if (fault_.launch != kNoNode && good(fault_.launch) == kX) {
    goal = {fault_.launch, stuck};
    return Outlook::open;
  }
  if (good(line_) == kX) {
    goal = {line_, static_cast<std::uint8_t>(stuck ^ 1U)};
    return Outlook::open;
  }
  ++now_;
  differing_.clear();
  frontier_.clear();
  const auto meet = [&](Node node) {
    if (seen_[node] == now_) return;
    seen_[node] = now_;
    if (is_unknown(node)) {
      if (observe_[node] < kNever) frontier_.push_back(node);
    } else if (good(node) != bad(node)) {
      differing_.push_back(node);
    }
  };
  meet(fault_.node);
  for (std::size_t i = 0; i < differing_.size(); ++i) {
    if (circuit_.kind(differing_[i]) == Gate::output) {
      shown_ = differing_[i];
      return Outlook::test;
    }
    for (const Node next : circuit_.fanout(differing_[i])) meet(next);
    work_ += circuit_.fanout(differing_[i]).size();
  }
  ++now_;  // from here on: no way to an output
  while (!frontier_.empty()) {
    const auto nearest = std::min_element(frontier_.begin(), frontier_.end(), [&](Node a, Node b) {
      return std::pair(drawn(observe_[a], a), a) < std::pair(drawn(observe_[b], b), b);
    });
    if (side_input(*nearest, goal) && reaches_output(*nearest)) return Outlook::open;
    frontier_.erase(nearest);
  }
  return Outlook::dead;
}

// What lets a difference at the gate's inputs through.
bool Podem::side_input(Node gate, Goal& goal) const {
  const auto fanin = circuit_.fanin(gate);
  const Gate kind = circuit_.kind(gate);
  const auto carries = [&](std::size_t pin) {
    return differs(fanin[pin]) || (gate == fault_.node && static_cast<std::int32_t>(pin) == fault_.pin);
  };
  if (kind == Gate::mux) {
    if (carries(2)) {
      const std::uint8_t d0 = good(fanin[0]), d1 = good(fanin[1]);
      if (d0 != kX && d1 != kX) return false;
      if (d0 != kX)
        goal = {fanin[1], static_cast<std::uint8_t>(d0 ^ 1U)};
      else if (d1 != kX)
        goal = {fanin[0], static_cast<std::uint8_t>(d1 ^ 1U)};
      else
        goal = {fanin[0],
                sum(cost(fanin[0], 0), cost(fanin[1], 1)) <= sum(cost(fanin[0], 1), cost(fanin[1], 0))
                    ? std::uint8_t{0}
                    : std::uint8_t{1}};
      return true;
    }
    if (good(fanin[2]) != kX) return false;
    goal = {fanin[2], carries(0) ? std::uint8_t{0} : std::uint8_t{1}};
    return true;
  }
  std::uint32_t most = 0;
  goal.node = kNoNode;
  for (std::size_t pin = 0; pin < fanin.size(); ++pin) {
    if (good(fanin[pin]) != kX || carries(pin)) continue;
    const std::uint8_t value = is_and(kind)                                 ? 1
                               : is_or(kind)                                ? 0
                               : cost(fanin[pin], 0) <= cost(fanin[pin], 1) ? 0
                                                                            : 1;
    if (goal.node != kNoNode && cost(fanin[pin], value) <= most) continue;
    most = cost(fanin[pin], value);  // the hardest first: where it can't be had, that is soon known
    goal = {fanin[pin], value};
  }
  return goal.node != kNoNode;
}

// Over lines that are not decided.
bool Podem::reaches_output(Node gate) {
  path_.assign(1, gate);
  seen_[gate] = now_;
  while (!path_.empty()) {
    const Node node = path_.back();
    path_.pop_back();
    if (circuit_.kind(node) == Gate::output) return true;
    for (const Node next : circuit_.fanout(node)) {
      if (seen_[next] == now_ || !is_unknown(next) || observe_[next] >= kNever) continue;
      seen_[next] = now_;
      ++work_;
      path_.push_back(next);
    }
  }
  return false;
}

// The input that serves the goal, with its value: where one input of a gate does, the easiest; where all are
// needed, the hardest.
Podem::Decision Podem::backtrace(Goal goal) const {
  auto [node, value] = goal;
  while (circuit_.kind(node) != Gate::input) {
    const auto fanin = circuit_.fanin(node);
    const Gate kind = circuit_.kind(node);
    if (kind == Gate::mux) {
      std::uint8_t select = good(fanin[2]);
      if (select != kX) {
        node = fanin[select];
        continue;
      }
      const auto price = [&](std::uint8_t choice) {
        const std::uint8_t data = good(fanin[choice]);
        return sum(drawn_cost(fanin[2], choice), data == kX      ? drawn_cost(fanin[choice], value)
                                                 : data == value ? 0
                                                                 : kNever);
      };
      node = fanin[2];
      value = price(0) <= price(1) ? 0 : 1;
      continue;
    }
    if (inverts(kind)) value ^= 1U;
    Node next = kNoNode;
    std::uint8_t next_value = value;
    std::size_t unknown = 0;
    for (const Node driver : fanin) {
      if (good(driver) != kX) {
        if (!is_and(kind) && !is_or(kind)) value ^= good(driver);
        continue;
      }
      ++unknown;
      if (is_and(kind) || is_or(kind)) {
        const bool one_serves = value == (is_or(kind) ? 1 : 0);
        if (next == kNoNode || (one_serves ? drawn_cost(driver, value) < drawn_cost(next, value)
                                           : drawn_cost(driver, value) > drawn_cost(next, value)))
          next = driver;
      } else {
        next = driver;
      }
    }
    if (is_and(kind) || is_or(kind)) {
      next_value = value;
    } else {  // of several free inputs of a parity, this one takes what is easy
      next_value = unknown == 1 ? value : drawn_cost(next, 0) <= drawn_cost(next, 1) ? 0 : 1;
    }
    node = next;
    value = next_value;
  }
  return {node, value, false, 0};
}

}  // namespace meltstage::dft
