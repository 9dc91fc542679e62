// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/functional.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <random>
#include <span>
#include <thread>
#include <utility>

#include "asic/dft/error.hpp"
#include "asic/dft/lanes.hpp"

namespace meltstage::dft {

namespace {

constexpr std::size_t kMachines = kLanes - 1;  // faulty ones; lane 0 is good
constexpr std::int32_t kNoFlop = -1;

MELTSTAGE_INLINE Lanes of_good(const Lanes& value) {
  const Lanes zero{};
  return (value[0] & 1) != 0 ? ~zero : zero;
}

// A line stuck in some machines.
struct Stuck {
  std::int32_t pin = kStem;
  Word machines;
  Word value;  // where it is stuck at 1
};

// The good machine and up to 511 faulty ones.
struct Machines {
  Machines(const CaptureView& v, std::span<const Fault> faults)
      : view(v),
        circuit(v.circuit),
        values(circuit.size()),
        pending(circuit.size() / 64 + 1, 0),
        dirty(v.flops.size() / 64 + 1, 0),
        stuck_at(circuit.size(), 0),
        flop_of_state(circuit.size(), kNoFlop),
        flop_of_next(circuit.size(), kNoFlop),
        is_port(circuit.size(), 0),
        reset_list(circuit.size(), 0),
        rose(circuit.size(), 0),
        fell(circuit.size(), 0),
        stuck(1),
        flops_of_reset(1) {
    for (std::size_t k = 0; k < faults.size(); ++k) add_fault(faults[k], k + 1);
    for (std::size_t i = 0; i < view.output_ports.size(); ++i) is_port[circuit.outputs()[i]] = 1;
    for (std::size_t k = 0; k < view.flops.size(); ++k) add_flop(k);
    for (std::size_t k = 0; k < view.flops.size(); ++k) mark_dirty(k);
  }

  void add_fault(const Fault& fault, std::size_t lane) {
    if (stuck_at[fault.node] == 0) {
      stuck_at[fault.node] = static_cast<std::uint32_t>(stuck.size());
      stuck.emplace_back();
    }
    std::vector<Stuck>& lines = stuck[stuck_at[fault.node]];
    auto line = std::find_if(lines.begin(), lines.end(), [&](const Stuck& s) { return s.pin == fault.pin; });
    if (line == lines.end()) line = lines.insert(lines.end(), Stuck{fault.pin, {}, {}});
    line->machines.set(lane, true);
    line->value.set(lane, fault.stuck);
  }
  void add_flop(std::size_t k) {
    const Node state = circuit.inputs()[view.input_ports.size() + k];
    const Node next = circuit.outputs()[view.output_ports.size() + k];
    flop_of_state[state] = flop_of_next[next] = static_cast<std::int32_t>(k);
    states.push_back(state);
    nexts.push_back(next);
    const ScanFlop& flop = view.flops[k];
    const auto found = flop.has_reset ? view.node_of_net.find(flop.reset) : view.node_of_net.end();
    resets.push_back(found == view.node_of_net.end() ? kNoNode : found->second);
    if (resets.back() == kNoNode) return;
    std::uint32_t& list = reset_list[resets.back()];
    if (list == 0) {
      list = static_cast<std::uint32_t>(flops_of_reset.size());
      flops_of_reset.emplace_back();
    }
    flops_of_reset[list].push_back(k);
  }
  void wake(Node node) { pending[node / 64] |= std::uint64_t{1} << (node % 64); }
  void mark_dirty(std::size_t flop) { dirty[flop / 64] |= std::uint64_t{1} << (flop % 64); }

  MELTSTAGE_INLINE void force(Node node, std::int32_t pin, Lanes& value) const {
    if (stuck_at[node] == 0) return;
    for (const Stuck& s : stuck[stuck_at[node]]) {
      if (s.pin == pin) value = (value & ~lanes(s.machines)) | (lanes(s.value) & lanes(s.machines));
    }
  }
  // The reset as the flop sees it: its pin is an input of the gate before `next`.
  MELTSTAGE_INLINE void apply_reset(std::size_t k, Lanes& state) const {
    if (resets[k] == kNoNode) return;
    Lanes line = lanes(values[resets[k]]);
    const Node gate = circuit.fanin(nexts[k])[0];
    if (stuck_at[gate] != 0) {
      const auto fanin = circuit.fanin(gate);
      for (std::size_t pin = 0; pin < fanin.size(); ++pin) {
        if (fanin[pin] == resets[k]) force(gate, static_cast<std::int32_t>(pin), line);
      }
    }
    const Lanes active = view.flops[k].reset_low ? ~line : line;
    state = view.flops[k].reset_value ? state | active : state & ~active;
  }
  MELTSTAGE_INLINE void store(Node node, const Lanes& value) {
    const Lanes change = value ^ lanes(values[node]);
    if (is_zero(change)) return;
    if ((change[0] & 1) != 0) ((value[0] & 1) != 0 ? rose : fell)[node] = 1;
    lanes(values[node]) = value;
    for (const Node next : circuit.fanout(node)) wake(next);
    if (flop_of_next[node] != kNoFlop) mark_dirty(static_cast<std::size_t>(flop_of_next[node]));
    if (is_port[node] != 0) port_changed = true;
    for (const std::size_t k : flops_of_reset[reset_list[node]]) {
      mark_dirty(k);
      wake(states[k]);
    }
  }
  MELTSTAGE_INLINE void drive(Node node, Lanes value) {
    force(node, kStem, value);
    store(node, value);
  }
  MELTSTAGE_INLINE void evaluate_state(Node node) {
    Lanes value = lanes(values[node]);
    apply_reset(static_cast<std::size_t>(flop_of_state[node]), value);
    drive(node, value);
  }
  MELTSTAGE_INLINE void evaluate_gate(Node node) {
    const auto fanin = circuit.fanin(node);
    Lanes value = lanes(values[node]);
    if (stuck_at[node] == 0) {
      evaluate(
          circuit.kind(node), fanin.size(),
          [&](std::size_t i) __attribute__((always_inline))->const Lanes& { return lanes(values[fanin[i]]); },
          value);
    } else {
      evaluate(
          circuit.kind(node), fanin.size(),
          [&](std::size_t i) __attribute__((always_inline)) {
            Lanes in = lanes(values[fanin[i]]);
            force(node, static_cast<std::int32_t>(i), in);
            return in;
          },
          value);
    }
    drive(node, value);
  }

  const CaptureView& view;
  const Circuit& circuit;
  std::vector<Word> values;
  std::vector<std::uint64_t> pending;   // a bit a node to be evaluated
  std::vector<std::uint64_t> dirty;     // a bit a flop that may change at the next clock
  std::vector<std::uint32_t> stuck_at;  // by node, index into stuck; 0: no fault
  std::vector<std::int32_t> flop_of_state, flop_of_next;
  std::vector<std::uint8_t> is_port;
  std::vector<std::uint32_t> reset_list;  // by node, index into flops_of_reset; 0: no reset
  std::vector<std::uint8_t> rose, fell;   // in the good machine
  std::vector<std::vector<Stuck>> stuck;
  std::vector<std::vector<std::size_t>> flops_of_reset;
  std::vector<Node> states, nexts, resets;  // by flop
  std::vector<std::pair<Node, Word>> captured;
  bool port_changed = true;
};

// All states 0, gates by these, no reset yet.
MELTSTAGE_WIDE void power_up_wide(Machines& m) {
  for (Node node = 0; node < m.circuit.size(); ++node) m.evaluate_gate(node);
  for (const Node state : m.states) m.wake(state);
  std::fill(m.rose.begin(), m.rose.end(), std::uint8_t{0});
  std::fill(m.fell.begin(), m.fell.end(), std::uint8_t{0});
}

// Until nothing changes; a reset that logic drives reaches flops that stand before it.
MELTSTAGE_WIDE void settle_wide(Machines& m) {
  for (bool again = true; again;) {
    again = false;
    for (std::size_t word = 0; word < m.pending.size(); ++word) {
      while (m.pending[word] != 0) {
        const auto bit = static_cast<std::size_t>(__builtin_ctzll(m.pending[word]));
        m.pending[word] &= m.pending[word] - 1;
        const Node node = static_cast<Node>(64 * word + bit);
        if (m.flop_of_state[node] != kNoFlop)
          m.evaluate_state(node);
        else
          m.evaluate_gate(node);
        again = true;
      }
    }
  }
}

MELTSTAGE_WIDE void drive_wide(Machines& m, Node node, const Word& value) { m.drive(node, lanes(value)); }

// A rising edge, before anything has settled.
MELTSTAGE_WIDE void capture_wide(Machines& m) {
  m.captured.clear();
  for (std::size_t word = 0; word < m.dirty.size(); ++word) {
    for (; m.dirty[word] != 0; m.dirty[word] &= m.dirty[word] - 1) {
      const std::size_t k = 64 * word + static_cast<std::size_t>(__builtin_ctzll(m.dirty[word]));
      m.captured.emplace_back(m.states[k], m.values[m.nexts[k]]);
      m.apply_reset(k, lanes(m.captured.back().second));
    }
  }
  for (const auto& [node, value] : m.captured) m.drive(node, lanes(value));
}

// In which machines a port differs from the good one's.
MELTSTAGE_WIDE void compare_wide(Machines& m, Word& differs) {
  Lanes found{};
  for (std::size_t i = 0; i < m.view.output_ports.size(); ++i) {
    const Lanes& value = lanes(m.values[m.circuit.outputs()[i]]);
    found |= value ^ of_good(value);
  }
  lanes(differs) = found;
}

// Detected machines become good ones: they cost nothing any more.
MELTSTAGE_WIDE void drop_wide(Machines& m, const Word& machines) {
  const Lanes gone = lanes(machines);
  for (std::vector<Stuck>& lines : m.stuck) {
    for (Stuck& s : lines) lanes(s.machines) &= ~gone;
  }
  for (Word& word : m.values) {
    const Lanes value = lanes(word);
    lanes(word) = (value & ~gone) | (of_good(value) & gone);
  }
}

void set_inputs(Machines& m, const std::vector<std::uint8_t>& inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    Word value;
    if (inputs[i] != 0) value.part.fill(~std::uint64_t{0});
    drive_wide(m, m.circuit.inputs()[i], value);
  }
  settle_wide(m);
}

void run(Machines& m, const std::vector<FunctionalStretch>& stretches, std::span<std::uint64_t> first_clock) {
  constexpr std::uint64_t kDropEvery = 64;  // clocks; dropping goes over all nodes
  std::uint64_t clock = 0;
  Word gone, differs;
  bool fresh = false;
  power_up_wide(m);
  for (const FunctionalStretch& stretch : stretches) {
    set_inputs(m, stretch.inputs);
    for (std::uint64_t c = 0; c < stretch.clocks; ++c, ++clock) {
      capture_wide(m);
      settle_wide(m);
      if (m.port_changed) {
        m.port_changed = false;
        compare_wide(m, differs);
        for (std::size_t k = 0; k < first_clock.size() && differs.any(); ++k) {
          if (!differs.bit(k + 1) || first_clock[k] != FunctionalGrade::kUndetected) continue;
          first_clock[k] = clock;
          gone.set(k + 1, true);
          fresh = true;
        }
      }
      if (fresh && clock % kDropEvery == 0) {
        drop_wide(m, gone);
        fresh = false;
      }
    }
  }
}

ToggleCoverage toggle_coverage(const Machines& machines) {
  const Circuit& circuit = machines.circuit;
  const std::vector<std::int8_t> constant =
      constants(circuit, std::vector<std::int8_t>(circuit.inputs().size(), -1));
  ToggleCoverage result;
  for (const Site& site : circuit.sites()) {
    if (site.node == kNoNode || site.pin != kStem || constant[site.node] >= 0) continue;
    ++result.lines;
    if (machines.rose[site.node] != 0 && machines.fell[site.node] != 0)
      ++result.toggled;
    else
      result.idle.push_back(site.name);
  }
  return result;
}

}  // namespace

std::size_t FunctionalGrade::detected() const {
  return first_clock.size() -
         static_cast<std::size_t>(std::count(first_clock.begin(), first_clock.end(), kUndetected));
}

FunctionalGrade grade_functional(const CaptureView& view, const std::vector<FunctionalStretch>& stretches,
                                 const std::vector<Fault>& faults, unsigned threads, PowerUp power_up) {
  FunctionalGrade grade;
  grade.first_clock.assign(faults.size(), FunctionalGrade::kUndetected);
  for (const FunctionalStretch& stretch : stretches) grade.clocks += stretch.clocks;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t batch = next++; batch == 0 || batch * kMachines < faults.size(); batch = next++) {
      const std::size_t first = batch * kMachines, count = std::min(kMachines, faults.size() - first);
      Machines machines(view, std::span(faults).subspan(first, count));
      if (power_up == PowerUp::ones) {
        for (const Node state : machines.states) machines.values[state].part.fill(~std::uint64_t{0});
      }
      run(machines, stretches, std::span(grade.first_clock).subspan(first, count));
      if (batch == 0) grade.toggle = toggle_coverage(machines);
    }
  };
  {
    std::vector<std::jthread> pool;
    for (unsigned i = 1; i < threads; ++i) pool.emplace_back(work);
    work();
  }
  return grade;
}

namespace {

std::size_t signal_of(const CycleStream& stream, const std::string& name, bool input) {
  std::size_t s = 0;
  while (s < stream.signals.size() && (stream.signals[s].name != name || stream.signals[s].is_input != input))
    ++s;
  return s;
}

// By input port, the signal that drives it; the number of signals where none does.
std::vector<std::size_t> drivers(const CaptureView& view, const CycleStream& stream) {
  std::vector<std::size_t> signals;
  for (const std::string& port : view.input_ports) {
    signals.push_back(signal_of(stream, port, true));
    const bool of_test = port.starts_with("test_mode") || port.starts_with("scan_");
    if (signals.back() == stream.signals.size() && !of_test)
      throw InputError(fmt::format("{}: found no input signal {}, expected every input port of the netlist",
                                   stream.title, port));
  }
  return signals;
}

struct Expected {
  std::size_t signal;
  Node node;
};

// Mismatches of a cycle, over all power-up states.
struct Comparison {
  std::size_t strobes = 0, mismatches = 0;
  std::string first;
};

MELTSTAGE_WIDE void check_wide(const Machines& m, const Word& used, const std::vector<Expected>& outputs,
                               const std::string& states, const CycleStream& stream, Comparison& result) {
  result = {};
  for (const Expected& output : outputs) {
    const char c = states[output.signal];
    if (c != 'H' && c != 'L') continue;
    ++result.strobes;
    const Lanes zero{};
    Word wrong;
    lanes(wrong) = (lanes(m.values[output.node]) ^ (c == 'H' ? ~zero : zero)) & lanes(used);
    if (!wrong.any()) continue;
    for (std::size_t lane = 0; lane < kLanes; ++lane) result.mismatches += wrong.bit(lane) ? 1 : 0;
    if (result.first.empty())
      result.first = fmt::format("{}: found {}, expected {} (power-up state {})",
                                 stream.signals[output.signal].name, c == 'H' ? 0 : 1, c, wrong.first());
  }
}

}  // namespace

std::vector<FunctionalStretch> stretches_of(const CaptureView& view, const CycleStream& stream) {
  const std::vector<std::size_t> signals = drivers(view, stream);
  std::vector<FunctionalStretch> stretches;
  for (const TestCycle& cycle : stream.cycles) {
    FunctionalStretch stretch{0, {}};
    for (const std::size_t s : signals)
      stretch.inputs.push_back(s < stream.signals.size() && cycle.states[s] == '1' ? 1 : 0);
    if (cycle.states.find('P') != std::string::npos) stretch.clocks = cycle.count;
    if (!stretches.empty() && stretches.back().inputs == stretch.inputs)
      stretches.back().clocks += stretch.clocks;
    else
      stretches.push_back(std::move(stretch));
  }
  return stretches;
}

ReplayResult replay_cycles(const CaptureView& view, const CycleStream& stream, unsigned random_power_ups,
                           std::uint64_t seed) {
  const std::vector<std::size_t> signals = drivers(view, stream);
  std::vector<Expected> outputs;
  for (std::size_t i = 0; i < view.output_ports.size(); ++i) {
    const std::size_t s = signal_of(stream, view.output_ports[i], false);
    if (s < stream.signals.size()) outputs.push_back({s, view.circuit.outputs()[i]});
  }
  const auto named = static_cast<std::size_t>(std::count_if(stream.signals.begin(), stream.signals.end(),
                                                            [](const TestSignal& s) { return !s.is_input; }));
  if (outputs.size() != named)
    throw InputError(fmt::format("{}: found {} output signals that the netlist has, expected all {}",
                                 stream.title, outputs.size(), named));
  Machines m(view, {});
  Word used;
  const std::size_t machines = std::min<std::size_t>(2 + random_power_ups, kLanes);
  for (std::size_t lane = 0; lane < machines; ++lane) used.set(lane, true);
  std::mt19937_64 random(seed);
  for (const Node state : m.states) {
    m.values[state].set(1, true);
    for (std::size_t lane = 2; lane < machines; ++lane) m.values[state].set(lane, (random() & 1) != 0);
  }
  power_up_wide(m);
  ReplayResult result;
  Comparison now;
  std::vector<std::uint8_t> inputs(signals.size());
  for (const TestCycle& cycle : stream.cycles) {
    bool clocked = false;
    for (std::size_t i = 0; i < signals.size(); ++i) {
      const char c = signals[i] < stream.signals.size() ? cycle.states[signals[i]] : '0';
      inputs[i] = c == '1' ? 1 : 0;
      clocked = clocked || c == 'P';
    }
    set_inputs(m, inputs);
    m.port_changed = true;
    for (std::uint64_t c = 0; c < cycle.count; ++c, ++result.cycles) {
      if (m.port_changed) check_wide(m, used, outputs, cycle.states, stream, now);
      m.port_changed = false;
      result.strobes += now.strobes;
      if (now.mismatches != 0 && result.mismatches == 0)
        result.first = fmt::format("cycle {}: {}", result.cycles, now.first);
      result.mismatches += now.mismatches;
      if (!clocked) continue;
      capture_wide(m);
      settle_wide(m);
    }
  }
  return result;
}

std::vector<Fault> sample_faults(const std::vector<Fault>& faults, std::size_t count, std::uint64_t seed) {
  std::vector<Fault> sample;
  std::mt19937_64 random(seed);
  std::sample(faults.begin(), faults.end(), std::back_inserter(sample), count, random);
  return sample;
}

}  // namespace meltstage::dft
