// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/machines.hpp"

#include <algorithm>
#include <utility>

#include "asic/dft/core/lanes.hpp"

namespace meltstage::dft {

namespace {

bool is_wire(Gate kind) { return kind == Gate::buf || kind == Gate::inv || kind == Gate::output; }

MELTSTAGE_INLINE Lanes everywhere(std::uint64_t bit) { return Lanes{} - bit; }  // 0 or 1 in all machines

}  // namespace

Machines::Machines(const CaptureView& view, std::span<const Fault> faults)
    : view_(view),
      circuit_(view.circuit),
      number_(circuit_.size(), kNoNumber),
      forced_of_(circuit_.size(), -1),
      resets_(1) {
  for (std::size_t k = 0; k < faults.size(); ++k) {
    const Fault& fault = faults[k];
    if (fault.node == kNoNode) continue;
    if (forced_of_[fault.node] < 0) {
      forced_of_[fault.node] = static_cast<std::int32_t>(forced_.size());
      forced_.push_back({circuit_.kind(fault.node), {}, {}});
    }
    std::vector<Stuck>& lines = forced_[static_cast<std::size_t>(forced_of_[fault.node])].stuck;
    auto line = std::find_if(lines.begin(), lines.end(), [&](const Stuck& s) { return s.pin == fault.pin; });
    if (line == lines.end()) line = lines.insert(lines.end(), Stuck{fault.pin, {}, {}});
    line->machines.set(k + 1, true);
    line->value.set(k + 1, fault.stuck);
  }
  choose_kept();
  number_nodes();
  add_flops();
  connect();
  captured_.reserve(flops_.size());
}

// Inverters, buffers and outputs are folded into what reads them, and so is the gate by which a reset acts on
// what a flop captures: the reset acts on the flop as well. Faults keep them.
void Machines::choose_kept() {
  constexpr std::uint32_t kKept = 0;
  for (Node node = 0; node < circuit_.size(); ++node) {
    if (!is_wire(circuit_.kind(node)) || forced_of_[node] >= 0) number_[node] = kKept;
  }
  for (const ScanFlop& flop : view_.flops) {
    if (!flop.has_reset) continue;
    if (const auto line = view_.node_of_net.find(flop.reset); line != view_.node_of_net.end())
      number_[line->second] = kKept;
  }
}

Machines::Source Machines::source_of(Node node) const {
  bool inverted = false;
  for (; !is_kept(node); node = circuit_.fanin(node)[0]) inverted ^= circuit_.kind(node) == Gate::inv;
  return 2 * number_[node] + (inverted ? 1 : 0);
}

// Drivers before readers, and what belongs together side by side.
void Machines::number_nodes() {
  std::vector<std::uint8_t> visited(circuit_.size(), 0);
  std::vector<std::pair<Node, std::size_t>> path;
  const auto visit = [&](Node root) {
    if (visited[root] != 0) return;
    visited[root] = 1;
    path.emplace_back(root, 0);
    while (!path.empty()) {
      auto& [node, pin] = path.back();
      const auto fanin = circuit_.fanin(node);
      if (pin < fanin.size()) {
        const Node driver = fanin[pin++];
        if (visited[driver] != 0) continue;
        visited[driver] = 1;
        path.emplace_back(driver, 0);
        continue;
      }
      if (is_kept(node)) {
        number_[node] = static_cast<std::uint32_t>(order_.size());
        order_.push_back(node);
      }
      path.pop_back();
    }
  };
  for (std::size_t k = 0; k < view_.flops.size(); ++k) {
    visit(circuit_.inputs()[view_.input_ports.size() + k]);
    visit(circuit_.outputs()[view_.output_ports.size() + k]);
  }
  for (Node node = 0; node < circuit_.size(); ++node) visit(node);
}

void Machines::add_flops() {
  reset_of_line_.assign(order_.size(), 0);
  flop_of_state_.assign(order_.size(), 0);
  for (std::size_t k = 0; k < view_.flops.size(); ++k) {
    const ScanFlop& from = view_.flops[k];
    Flop flop;
    flop.state = number_[circuit_.inputs()[view_.input_ports.size() + k]];
    flop_of_state_[flop.state] = static_cast<std::uint32_t>(k + 1);
    Node next = circuit_.outputs()[view_.output_ports.size() + k];
    const auto line = from.has_reset ? view_.node_of_net.find(from.reset) : view_.node_of_net.end();
    if (line != view_.node_of_net.end()) {
      const std::uint32_t number = number_[line->second];
      if (reset_of_line_[number] == 0) {
        reset_of_line_[number] = static_cast<std::uint32_t>(resets_.size());
        resets_.push_back({number, from.reset_low, {}, false});
      }
      flop.reset = reset_of_line_[number];
      flop.reset_value = from.reset_value;
      resets_[flop.reset].flops.push_back(static_cast<std::uint32_t>(k));
      const Node gate = circuit_.fanin(next)[0];
      const auto fanin = circuit_.fanin(gate);
      bool plain = forced_of_[next] < 0 && forced_of_[gate] < 0 && fanin.size() == 2;
      std::size_t data = 0;
      for (std::size_t pin = 0; pin < fanin.size(); ++pin) {
        const bool between = is_wire(circuit_.kind(fanin[pin])) && fanin[pin] != line->second &&
                             circuit_.fanin(fanin[pin])[0] == line->second;
        if (!between && fanin[pin] != line->second) {
          data = pin;
          continue;
        }
        flop.gate = forced_of_[gate];
        flop.gate_pin = static_cast<std::int32_t>(pin);
        flop.through_inverter = between && circuit_.kind(fanin[pin]) == Gate::inv;
        if (between) flop.through = forced_of_[fanin[pin]];
        plain = plain && flop.through < 0;
      }
      if (plain) next = fanin[data];
    }
    flop.next = source_of(next);
    flops_.push_back(flop);
  }
}

void Machines::connect() {
  ops_.resize(order_.size());
  std::vector<std::vector<std::uint32_t>> readers(order_.size());
  for (std::uint32_t number = 0; number < order_.size(); ++number) {
    const Node node = order_[number];
    Op& op = ops_[number];
    std::vector<Source> in;
    for (const Node driver : circuit_.fanin(node)) in.push_back(source_of(driver));
    for (const Source source : in) readers[source / 2].push_back(number);
    const Gate kind = circuit_.kind(node);
    if (forced_of_[node] >= 0) {
      forced_[static_cast<std::size_t>(forced_of_[node])].in = in;
      op.kind = Kind::forced;
      op.in[0] = static_cast<std::uint32_t>(forced_of_[node]);
      continue;
    }
    const bool of_or = kind == Gate::any || kind == Gate::none;
    if (of_or) {
      for (Source& source : in) source ^= 1;
    }
    op.inverted = kind == Gate::any || kind == Gate::nall || kind == Gate::same || kind == Gate::inv ||
                  kind == Gate::tie1;
    if (in.empty()) {
      op.kind = Kind::source;
    } else if (kind == Gate::mux) {
      op.kind = Kind::choice;
    } else if (in.size() == 1) {
      op.kind = Kind::wire;
    } else {
      const bool sum = kind == Gate::parity || kind == Gate::same;
      op.kind = sum ? Kind::differ : Kind::both;
      if (in.size() > 2) {
        op.kind = sum ? Kind::parity : Kind::all;
        op.in = {static_cast<std::uint32_t>(wide_.size()), static_cast<std::uint32_t>(in.size()), 0};
        wide_.insert(wide_.end(), in.begin(), in.end());
        continue;
      }
    }
    std::copy(in.begin(), in.end(), op.in.begin());
  }
  for (const Flop& flop : flops_) {
    if (ops_[flop.state].kind == Kind::source) ops_[flop.state].kind = Kind::state;
  }
  for (std::size_t r = 1; r < resets_.size(); ++r) ops_[resets_[r].line].resets = true;

  first_flop_bit_ = static_cast<std::uint32_t>((order_.size() + 4095) / 4096 * 4096);
  port_bit_ = first_flop_bit_ + static_cast<std::uint32_t>((flops_.size() + 4095) / 4096 * 4096);
  for (std::uint32_t k = 0; k < flops_.size(); ++k)
    readers[flops_[k].next / 2].push_back(first_flop_bit_ + k);
  for (std::size_t i = 0; i < view_.output_ports.size(); ++i) {
    ports_.push_back(source_of(circuit_.outputs()[i]));
    readers[ports_.back() / 2].push_back(port_bit_);
  }
  for (std::size_t i = 0; i < view_.input_ports.size(); ++i) inputs_.push_back(number_[circuit_.inputs()[i]]);
  for (std::uint32_t number = 0; number < order_.size(); ++number) {
    std::vector<std::uint32_t>& to = readers[number];
    std::sort(to.begin(), to.end());
    to.erase(std::unique(to.begin(), to.end()), to.end());
    ops_[number].fanout = static_cast<std::uint32_t>(fanout_.size());
    fanout_.insert(fanout_.end(), to.begin(), to.end());
    ops_[number].fanout_end = static_cast<std::uint32_t>(fanout_.size());
  }
  values_.assign(order_.size(), {});
  moves_.assign(order_.size(), 0);
  pending_.assign(port_bit_ / 64 + 1, 0);
  words_.assign(port_bit_ / 4096 + 1, 0);
}

// Of the line itself: an inverter falls when what it inverts rises.
std::uint8_t Machines::moves(Node node) const {
  const Source source = source_of(node);
  const std::uint8_t moves = moves_[source / 2];
  if ((source & 1) == 0) return moves;
  return static_cast<std::uint8_t>(((moves & kRose) != 0 ? kFell : 0) | ((moves & kFell) != 0 ? kRose : 0));
}

// What works on all machines at once.
struct MachineSteps {
  using Kind = Machines::Kind;
  using Op = Machines::Op;
  Machines& m;

  MELTSTAGE_INLINE Lanes read(Machines::Source source) const {
    return lanes(m.values_[source / 2]) ^ everywhere(source & 1);
  }
  MELTSTAGE_INLINE static void force(const Machines::Forced& node, std::int32_t pin, Lanes& value) {
    for (const Machines::Stuck& s : node.stuck) {
      if (s.pin == pin) value = (value & ~lanes(s.machines)) | (lanes(s.value) & lanes(s.machines));
    }
  }
  // The reset as the flop sees it, on the state it would have without.
  MELTSTAGE_INLINE void apply_reset(const Machines::Flop& flop, Lanes& state) const {
    const Machines::Reset& reset = m.resets_[flop.reset];
    Lanes line = lanes(m.values_[reset.line]);
    if (flop.through >= 0) force(m.forced_[static_cast<std::size_t>(flop.through)], 0, line);
    if (flop.through_inverter) line = ~line;
    if (flop.through >= 0) force(m.forced_[static_cast<std::size_t>(flop.through)], kStem, line);
    if (flop.gate >= 0) force(m.forced_[static_cast<std::size_t>(flop.gate)], flop.gate_pin, line);
    if (flop.through_inverter) line = ~line;
    const Lanes active = reset.low ? ~line : line;
    state = flop.reset_value ? state | active : state & ~active;
  }
  MELTSTAGE_INLINE void reset_state(const Machines::Flop& flop, Lanes& state) const {
    if (m.resets_[flop.reset].any) apply_reset(flop, state);
  }
  MELTSTAGE_INLINE void store(std::uint32_t line, const Op& op, const Lanes& value) {
    const Lanes change = value ^ lanes(m.values_[line]);
    if (is_zero(change)) return;
    if ((change[0] & 1) != 0) m.moves_[line] |= (value[0] & 1) != 0 ? Machines::kRose : Machines::kFell;
    lanes(m.values_[line]) = value;
    if (__builtin_expect(m.counting_, 0)) count(change);
    for (std::uint32_t i = op.fanout; i < op.fanout_end; ++i) m.wake(m.fanout_[i]);
    if (op.resets) reset_changed(m.resets_[m.reset_of_line_[line]]);
  }
  __attribute__((noinline)) void count(const Lanes& change) {
    for (std::size_t i = 0; i < kLanes / 64; ++i) {
      for (std::uint64_t own = change[i] ^ (std::uint64_t{0} - (change[0] & 1)); own != 0; own &= own - 1)
        ++m.own_changes_[64 * i + static_cast<std::size_t>(__builtin_ctzll(own))];
    }
  }
  void reset_changed(Machines::Reset& reset) {
    reset.any = true;  // until it is at rest again
    for (const std::uint32_t k : reset.flops) {
      m.wake(m.first_flop_bit_ + k);
      m.wake(m.flops_[k].state);
    }
    m.again_ = true;
  }
  MELTSTAGE_INLINE void evaluate_forced(std::uint32_t line, const Op& op) {
    const Machines::Forced& node = m.forced_[op.in[0]];
    Lanes value = lanes(m.values_[line]);
    if (node.kind == Gate::input) {
      if (const std::uint32_t k = m.flop_of_state_[line]; k != 0) reset_state(m.flops_[k - 1], value);
    } else {
      evaluate(
          node.kind, node.in.size(),
          [&](std::size_t i) __attribute__((always_inline)) {
            Lanes in = read(node.in[i]);
            force(node, static_cast<std::int32_t>(i), in);
            return in;
          },
          value);
    }
    force(node, kStem, value);
    store(line, op, value);
  }
  MELTSTAGE_INLINE void evaluate_line(std::uint32_t line) {
    const Op& op = m.ops_[line];
    Lanes value{};
    switch (op.kind) {
      case Kind::both:
        value = read(op.in[0]) & read(op.in[1]);
        break;
      case Kind::differ:
        value = read(op.in[0]) ^ read(op.in[1]);
        break;
      case Kind::choice: {
        const Lanes s = read(op.in[2]);
        value = (read(op.in[0]) & ~s) | (read(op.in[1]) & s);
        break;
      }
      case Kind::wire:
        value = read(op.in[0]);
        break;
      case Kind::all:
        value = read(m.wide_[op.in[0]]);
        for (std::uint32_t i = 1; i < op.in[1]; ++i) value &= read(m.wide_[op.in[0] + i]);
        break;
      case Kind::parity:
        value = read(m.wide_[op.in[0]]);
        for (std::uint32_t i = 1; i < op.in[1]; ++i) value ^= read(m.wide_[op.in[0] + i]);
        break;
      case Kind::state: {
        value = lanes(m.values_[line]);
        reset_state(m.flops_[m.flop_of_state_[line] - 1], value);
        store(line, op, value);
        return;
      }
      case Kind::source:
        return;
      case Kind::forced:
        evaluate_forced(line, op);
        return;
    }
    store(line, op, value ^ everywhere(op.inverted ? 1 : 0));
  }
  MELTSTAGE_INLINE void put(std::uint32_t line, Lanes value) {
    const Op& op = m.ops_[line];
    if (op.kind == Kind::forced) force(m.forced_[op.in[0]], kStem, value);
    store(line, op, value);
  }
  // Until nothing changes; a reset that logic drives reaches flops that stand before it.
  MELTSTAGE_INLINE void settle() {
    const std::size_t end = m.first_flop_bit_ / 4096;
    do {
      m.again_ = false;
      for (std::size_t group = 0; group < end; ++group) {
        while (m.words_[group] != 0) {
          const std::size_t word = 64 * group + static_cast<std::size_t>(__builtin_ctzll(m.words_[group]));
          m.words_[group] &= m.words_[group] - 1;
          while (m.pending_[word] != 0) {
            const auto bit = static_cast<std::size_t>(__builtin_ctzll(m.pending_[word]));
            m.pending_[word] &= m.pending_[word] - 1;
            evaluate_line(static_cast<std::uint32_t>(64 * word + bit));
          }
        }
      }
    } while (m.again_);
  }
  MELTSTAGE_INLINE void capture() {
    m.captured_.clear();
    for (std::size_t group = m.first_flop_bit_ / 4096; group < m.port_bit_ / 4096; ++group) {
      for (; m.words_[group] != 0; m.words_[group] &= m.words_[group] - 1) {
        const std::size_t word = 64 * group + static_cast<std::size_t>(__builtin_ctzll(m.words_[group]));
        for (; m.pending_[word] != 0; m.pending_[word] &= m.pending_[word] - 1) {
          const auto bit = static_cast<std::size_t>(__builtin_ctzll(m.pending_[word]));
          const Machines::Flop& flop = m.flops_[64 * word + bit - m.first_flop_bit_];
          Lanes value = read(flop.next);
          if (flop.stopped >= 0) {
            const Lanes& still = lanes(m.stopped_[static_cast<std::size_t>(flop.stopped)]);
            value = (value & ~still) | (lanes(m.values_[flop.state]) & still);
          }
          reset_state(flop, value);
          m.captured_.emplace_back();
          m.captured_.back().line = flop.state;
          lanes(m.captured_.back().value) = value;
        }
      }
    }
    for (const Machines::Captured& c : m.captured_) put(c.line, lanes(c.value));
  }
  // A reset that no machine sees needs no look at each flop.
  MELTSTAGE_INLINE void rest(Machines::Reset& reset) {
    if (!reset.any) return;
    const Lanes& line = lanes(m.values_[reset.line]);
    if (!is_zero(reset.low ? ~line : line)) return;
    for (const std::uint32_t k : reset.flops) {
      if (m.flops_[k].through >= 0 || m.flops_[k].gate >= 0) return;
    }
    reset.any = false;
  }
};

namespace {

MELTSTAGE_WIDE void clock_wide(MachineSteps steps) {
  steps.capture();
  steps.settle();
}
MELTSTAGE_WIDE void settle_wide(MachineSteps steps) { steps.settle(); }
MELTSTAGE_WIDE void put_wide(MachineSteps steps, std::uint32_t line, bool level) {
  steps.put(line, everywhere(level ? 1 : 0));
}
MELTSTAGE_WIDE void put_word_wide(MachineSteps steps, std::uint32_t line, const Word& levels) {
  steps.put(line, lanes(levels));
}
MELTSTAGE_WIDE void evaluate_all_wide(MachineSteps steps, std::uint32_t lines) {
  for (std::uint32_t line = 0; line < lines; ++line) steps.evaluate_line(line);
}

}  // namespace

void Machines::preset_inputs(std::span<const std::uint8_t> inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i)
    values_[inputs_[i]].part.fill(inputs[i] != 0 ? ~std::uint64_t{0} : 0);
}

void Machines::preset_inputs(std::span<const Word> inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i) values_[inputs_[i]] = inputs[i];
}

void Machines::start() {
  for (Reset& reset : resets_) reset.any = false;  // states stand; lines of resets are not known yet
  for (std::uint32_t line = 0; line < ops_.size(); ++line) {
    if (ops_[line].kind == Kind::source && ops_[line].inverted)
      values_[line].part.fill(~std::uint64_t{0});  // a constant
  }
  evaluate_all_wide({*this}, static_cast<std::uint32_t>(ops_.size()));
  for (std::uint32_t k = 0; k < flops_.size(); ++k) {
    wake(flops_[k].state);
    wake(first_flop_bit_ + k);
  }
  for (std::size_t r = 1; r < resets_.size(); ++r) resets_[r].any = true;
  wake(port_bit_);
  settle_wide({*this});
  std::fill(moves_.begin(), moves_.end(), std::uint8_t{0});
}

void Machines::set_inputs(std::span<const std::uint8_t> inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i) put_wide({*this}, inputs_[i], inputs[i] != 0);
  settle_wide({*this});
  for (std::size_t r = 1; r < resets_.size(); ++r) MachineSteps{*this}.rest(resets_[r]);
}

void Machines::set_inputs(std::span<const Word> inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i) put_word_wide({*this}, inputs_[i], inputs[i]);
  settle_wide({*this});
  for (std::size_t r = 1; r < resets_.size(); ++r) MachineSteps{*this}.rest(resets_[r]);
}

void Machines::stop_clock(std::size_t flop, std::size_t machine) {
  std::int32_t& stopped = flops_[flop].stopped;
  if (stopped < 0) {
    stopped = static_cast<std::int32_t>(stopped_.size());
    stopped_.emplace_back();
  }
  stopped_[static_cast<std::size_t>(stopped)].set(machine, true);
}

void Machines::clock() { clock_wide({*this}); }

bool Machines::ports_changed() {
  std::uint64_t& bit = pending_[port_bit_ / 64];
  words_[port_bit_ / 4096] = 0;
  return std::exchange(bit, 0) != 0;
}

Word Machines::different() const {
  Word found;
  for (const Source port : ports_) {
    const Word& value = values_[port / 2];
    const std::uint64_t good = std::uint64_t{0} - (value.part[0] & 1);
    for (std::size_t i = 0; i < value.part.size(); ++i) found.part[i] |= value.part[i] ^ good;
  }
  return found;
}

Word Machines::unlike(std::size_t port, bool level, const Word& machines) const {
  Word found = values_[ports_[port] / 2];
  const std::uint64_t wanted = level != ((ports_[port] & 1) != 0) ? ~std::uint64_t{0} : 0;
  for (std::size_t i = 0; i < found.part.size(); ++i)
    found.part[i] = (found.part[i] ^ wanted) & machines.part[i];
  return found;
}

void Machines::drop(const Word& machines) {
  for (Forced& node : forced_) {
    for (Stuck& s : node.stuck) {
      for (std::size_t i = 0; i < s.machines.part.size(); ++i) s.machines.part[i] &= ~machines.part[i];
    }
  }
  for (Word& value : values_) {
    const std::uint64_t good = std::uint64_t{0} - (value.part[0] & 1);
    for (std::size_t i = 0; i < value.part.size(); ++i)
      value.part[i] = (value.part[i] & ~machines.part[i]) | (good & machines.part[i]);
  }
}

}  // namespace meltstage::dft
