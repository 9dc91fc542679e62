// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/podem.hpp"

namespace meltstage::dft {

namespace {

constexpr std::uint32_t kNever = 1'000'000;  // cost of what can't be had, and only of that
constexpr std::size_t kWorkEach = 2000;      // gates looked at, a backtrack
constexpr std::size_t kCone = 3000;          // nodes looked at for what all ways to an output share

std::uint64_t mixed(std::uint64_t x) {  // S. Vigna's splitmix64
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9U;
  x = (x ^ x >> 27) * 0x94D049BB133111EBU;
  return x ^ x >> 31;
}

std::uint32_t sum(std::uint32_t a, std::uint32_t b) {
  return a >= kNever || b >= kNever ? kNever : std::min(a + b, kNever - 1);
}

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

Podem::Podem(const Circuit& circuit, const std::vector<std::int8_t>& inputs)
    : circuit_(circuit),
      control_(circuit.size()),
      observe_(circuit.size(), kNever),
      value_(circuit.size()),
      pending_(circuit.size() / 64 + 1, 0),
      seen_(circuit.size(), 0),
      must_(circuit.size(), kX),
      in_cone_(circuit.size(), 0),
      leads_out_(circuit.size(), 0),
      lifter_(circuit) {
  const std::vector<std::int8_t> held = constants(circuit, inputs);
  for (Node node = 0; node < circuit.size(); ++node) {
    const std::uint8_t value = held[node] < 0 ? kX : static_cast<std::uint8_t>(held[node]);
    value_[node] = pair(value, value);
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
  const std::uint64_t bit = std::uint64_t{1} << (node % 64);
  waiting_ += (pending_[node / 64] & bit) == 0 ? 1 : 0;
  pending_[node / 64] |= bit;
  first_pending_ = std::min<std::size_t>(first_pending_, node / 64);
}

// The lowest of the nodes that wait, which waits no more.
Node Podem::take_pending() {
  while (pending_[first_pending_] == 0) ++first_pending_;
  std::uint64_t& word = pending_[first_pending_];
  const auto node = static_cast<Node>(64 * first_pending_ + static_cast<std::size_t>(__builtin_ctzll(word)));
  word &= word - 1;
  --waiting_;
  return node;
}

void Podem::set(Node node, std::uint8_t value) {
  trail_.push_back({node, value_[node]});
  value_[node] = value;
  if (must_[node] != kX && good(node) != kX && good(node) != must_[node]) contradicted_ = true;
  for (const Node next : circuit_.fanout(node)) {
    if (!grows_ || is_unknown(next)) wake(next);
  }
}

std::uint8_t Podem::evaluate(Node node) const {
  constexpr std::uint8_t kOnes = 0b0101, kZeros = 0b1010;
  const auto turned = [](std::uint32_t v) { return (v & kOnes) << 1 | (v & kZeros) >> 1; };
  const bool is_site = node == fault_.node;
  const auto fanin = circuit_.fanin(node);
  const std::uint8_t stuck = fault_.stuck ? 1 : 0;
  const auto input = [&](std::size_t pin) -> std::uint32_t {
    const bool is_stuck = is_site && static_cast<std::int32_t>(pin) == fault_.pin;
    return is_stuck ? pair(good(fanin[pin]), stuck) : value_[fanin[pin]];
  };
  const Gate kind = circuit_.kind(node);
  std::uint32_t value = value_[node];
  if (kind == Gate::mux) {
    const std::uint32_t d0 = input(0), d1 = input(1), select = input(2);
    const std::uint32_t at1 = (select & kOnes) * 3, at0 = (select & kZeros) / 2 * 3;
    value = (d0 & at0) | (d1 & at1) | (d0 & d1);
  } else if (!fanin.empty()) {
    value = input(0);
    for (std::size_t pin = 1; pin < fanin.size(); ++pin) {
      const std::uint32_t next = input(pin), both = value & next, either = value | next;
      if (is_and(kind))
        value = (both & kOnes) | (either & kZeros);
      else if (is_or(kind))
        value = (either & kOnes) | (both & kZeros);
      else {
        const std::uint32_t same = both, other = value & turned(next);
        value = ((other | other >> 1) & kOnes) | ((same | same << 1) & kZeros);
      }
    }
    if (inverts(kind)) value = turned(value);
  }
  if (is_site && fault_.pin == kStem) return pair(static_cast<std::uint8_t>(2 - (value & 3U)), stuck);
  return static_cast<std::uint8_t>(value);
}

void Podem::imply() {
  while (waiting_ != 0) {
    const Node node = take_pending();
    ++work_;
    const std::uint8_t value = evaluate(node);
    if (value != value_[node]) set(node, value);
  }
  first_pending_ = pending_.size();
}

void Podem::undo(std::size_t mark) {
  while (trail_.size() > mark) {
    value_[trail_.back().node] = trail_.back().before;
    trail_.pop_back();
  }
  contradicted_ = false;
}

// A value that every test has; false when the good circuit has another.
bool Podem::require(Node node, std::uint8_t value) {
  if (known(node) != kX) return known(node) == value;
  must_[node] = value;
  needs_.push_back(node);
  return true;
}

bool Podem::require_all(std::span<const Node> nodes, std::uint8_t value) {
  return std::all_of(nodes.begin(), nodes.end(),
                     [&](Node node) { return known(node) != kX || require(node, value); });
}

// What follows at one gate, in either direction, from what is known of it.
bool Podem::require_by(Node gate) {
  const auto fanin = circuit_.fanin(gate);
  const Gate kind = circuit_.kind(gate);
  if (fanin.empty()) return true;
  const std::uint8_t out = known(gate);
  const std::uint8_t value =
      three_valued(kind, fanin.size(), [&](std::size_t pin) { return known(fanin[pin]); });
  if (value != kX) return require(gate, value);
  if (out == kX) return true;
  if (kind == Gate::mux) {
    const std::uint8_t select = known(fanin[2]);
    if (select != kX) return require(fanin[select], out);
    const std::uint8_t d0 = known(fanin[0]), d1 = known(fanin[1]);
    if (d0 != kX && d0 != out) return require(fanin[2], 1) && require(fanin[1], out);
    if (d1 != kX && d1 != out) return require(fanin[2], 0) && require(fanin[0], out);
    return true;
  }
  const bool inverted = inverts(kind);
  if (is_and(kind) || is_or(kind)) {
    const std::uint8_t controlling = is_or(kind) ? 1 : 0;
    if (out != (inverted ? controlling ^ 1U : controlling)) return require_all(fanin, controlling ^ 1U);
    const auto unknown = [&](Node driver) { return known(driver) == kX; };
    const auto first = std::find_if(fanin.begin(), fanin.end(), unknown);
    if (std::find_if(first + 1, fanin.end(), unknown) != fanin.end()) return true;
    return require(*first, controlling);
  }
  std::uint8_t left = static_cast<std::uint8_t>(inverted ? out ^ 1U : out);
  Node last = kNoNode;
  for (const Node driver : fanin) {
    if (known(driver) != kX) {
      left ^= known(driver);
    } else {
      if (last != kNoNode) return true;
      last = driver;
    }
  }
  return require(last, left);
}

// The consequences of all needs; false when they contradict each other.
bool Podem::follow() {
  for (; followed_ < needs_.size(); ++followed_) {
    const Node node = needs_[followed_];
    if (!require_by(node)) return false;
    for (const Node next : circuit_.fanout(node)) {
      if (!require_by(next)) return false;
    }
    work_ += circuit_.fanout(node).size();
  }
  return true;
}

// The input is one that the fault may change.
bool Podem::may_differ(Node gate, std::size_t pin) const {
  return gate == fault_.node ? static_cast<std::int32_t>(pin) == fault_.pin
                             : in_cone_[circuit_.fanin(gate)[pin]] == cone_now_;
}

// No input that the fault leaves as it is keeps a difference from passing the gate.
bool Podem::lets_through(Node gate) const {
  const auto fanin = circuit_.fanin(gate);
  const Gate kind = circuit_.kind(gate);
  if (!is_unknown(gate) && !differs(gate)) return false;
  if (kind == Gate::mux) {
    const std::uint8_t select = known(fanin[2]);
    return may_differ(gate, 2) || select == kX || may_differ(gate, select);
  }
  if (!is_and(kind) && !is_or(kind)) return true;
  const std::uint8_t controlling = is_or(kind) ? 1 : 0;
  for (std::size_t pin = 0; pin < fanin.size(); ++pin) {
    if (known(fanin[pin]) == controlling && !may_differ(gate, pin)) return false;
  }
  return true;
}

// What the fault may change, and what of that leads to an output; false when nothing does.
bool Podem::trace_cone() {
  ++cone_now_;
  cone_.clear();
  cone_end_ = kNoNode;
  wake(fault_.node);
  while (waiting_ != 0) {
    const Node node = take_pending();
    if (cone_.size() >= kCone) {
      cone_end_ = std::min(cone_end_, node);
      continue;
    }
    if (!(node == fault_.node && fault_.pin == kStem) && !lets_through(node)) continue;
    in_cone_[node] = cone_now_;
    cone_.push_back(node);
    for (const Node next : circuit_.fanout(node)) {
      if (observe_[next] < kNever) wake(next);
    }
  }
  first_pending_ = pending_.size();
  work_ += cone_.size();
  for (std::size_t k = cone_.size(); k-- > 0;) {
    const Node node = cone_[k];
    const auto fanout = circuit_.fanout(node);
    if (circuit_.kind(node) == Gate::output || std::any_of(fanout.begin(), fanout.end(), [&](Node next) {
          return leads_out_[next] == cone_now_ || (next >= cone_end_ && observe_[next] < kNever);
        }))
      leads_out_[node] = cone_now_;
  }
  return leads_out_[fault_.node] == cone_now_;
}

// What a gate that every way to an output leads through needs beside the fault.
bool Podem::require_passage(Node gate) {
  const auto fanin = circuit_.fanin(gate);
  const Gate kind = circuit_.kind(gate);
  if (kind == Gate::mux) {
    if (may_differ(gate, 2)) {
      if (may_differ(gate, 0) || may_differ(gate, 1)) return true;
      const std::uint8_t d0 = known(fanin[0]), d1 = known(fanin[1]);
      if (d0 != kX) return require(fanin[1], d0 ^ 1U);
      return d1 == kX || require(fanin[0], d1 ^ 1U);
    }
    if (may_differ(gate, 0) == may_differ(gate, 1)) return true;
    return require(fanin[2], may_differ(gate, 0) ? 0 : 1);
  }
  if (!is_and(kind) && !is_or(kind)) return true;
  for (std::size_t pin = 0; pin < fanin.size(); ++pin) {
    if (!may_differ(gate, pin) && !require(fanin[pin], is_and(kind) ? 1 : 0)) return false;
  }
  return true;
}

// A node that no line of the cone leads past is on every way.
bool Podem::require_passages() {
  Node furthest = 0;
  for (const Node node : cone_) {
    if (leads_out_[node] != cone_now_) continue;
    if (furthest <= node && !(node == fault_.node && fault_.pin == kStem) && !require_passage(node))
      return false;
    if (circuit_.kind(node) == Gate::output) return true;
    for (const Node next : circuit_.fanout(node)) {
      if (next >= cone_end_ && observe_[next] < kNever) return true;
      if (leads_out_[next] == cone_now_) furthest = std::max(furthest, next);
    }
  }
  return true;
}

// What every test of the fault has; false when that contradicts itself.
bool Podem::find_needs() {
  const std::uint8_t stuck = fault_.stuck ? 1 : 0;
  if (!require(line_, stuck ^ 1U)) return false;
  if (fault_.launch != kNoNode && !require(fault_.launch, stuck)) return false;
  for (std::size_t before = needs_.size() + 1; before != needs_.size();) {
    before = needs_.size();
    if (!follow() || !trace_cone() || !require_passages()) return false;
  }
  return follow();
}

void Podem::fix_needed_inputs() {
  const std::uint8_t stuck = fault_.stuck ? 1 : 0;
  for (const Node node : needs_) {
    if (circuit_.kind(node) != Gate::input) continue;
    const std::uint8_t bad_value = node == fault_.node && fault_.pin == kStem ? stuck : must_[node];
    set(node, pair(must_[node], bad_value));
  }
  imply();
}

void Podem::fix(const Cube& cube) {
  first_pending_ = pending_.size();
  for (const auto& [input, value] : cube) {
    const std::uint8_t v = value ? 1 : 0;
    if (good(circuit_.inputs()[input]) == kX) set(circuit_.inputs()[input], pair(v, v));
  }
  imply();
  fixed_ = trail_.size();
}

void Podem::release() {
  undo(0);
  fixed_ = 0;
}

Search Podem::search(const Fault& fault, std::size_t backtracks, Cube& cube) {
  if (observe_[fault.node] >= kNever) return Search::gave_up;
  fault_ = fault;
  line_ = fault.pin == kStem ? fault.node : circuit_.fanin(fault.node)[static_cast<std::size_t>(fault.pin)];
  // a fault that changes a constant opens ways that are taken for closed here
  const bool complete = cost(line_, 0) < kNever && cost(line_, 1) < kNever;
  work_ = 0;
  salt_ = 2 * std::uint64_t{fault.node} + (fault.stuck ? 1 : 0);
  Search result = find(backtracks);
  if (result == Search::none && !complete) result = Search::gave_up;
  if (result == Search::test)
    lifter_.lift(
        fault, shown_, [&](Node node) { return good(node); }, [&](Node node) { return bad(node); }, cube);
  undo(fixed_);
  decisions_.clear();
  for (const Node node : needs_) must_[node] = kX;
  needs_.clear();
  followed_ = 0;
  fault_ = {};
  return result;
}

Search Podem::find(std::size_t backtracks) {
  if (good(line_) == (fault_.stuck ? 1 : 0)) return Search::none;
  first_pending_ = pending_.size();
  wake(fault_.node);
  grows_ = false;
  imply();
  grows_ = true;
  if (!find_needs()) return Search::none;
  fix_needed_inputs();
  return decide(backtracks);
}

// Decisions at inputs until the fault shows at an output.
Search Podem::decide(std::size_t most) {
  for (std::size_t backtracks = 0; backtracks <= most && work_ <= kWorkEach * (most + 1);) {
    Goal goal;
    const Outlook outlook = look(goal);
    if (outlook == Outlook::test) return Search::test;
    if (outlook == Outlook::dead) {
      ++backtracks;
      if (!backtrack()) return Search::none;
    } else {
      decisions_.push_back(backtrace(goal));
      decisions_.back().mark = trail_.size();
    }
    const Decision& last = decisions_.back();
    const bool is_site = last.input == fault_.node && fault_.pin == kStem;
    const std::uint8_t bad_value = is_site ? (fault_.stuck ? 1 : 0) : last.value;
    set(last.input, pair(last.value, bad_value));
    imply();
  }
  return Search::gave_up;
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
  if (contradicted_ || good(line_) == stuck) return Outlook::dead;
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
  Node node = goal.node;
  std::uint8_t value = goal.value;
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
