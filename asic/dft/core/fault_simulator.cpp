// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/fault_simulator.hpp"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <thread>

#include "asic/dft/core/lanes.hpp"

namespace meltstage::dft {

namespace {

// In which patterns the gate's output follows its input `pin`.
MELTSTAGE_INLINE void sensitive(const Circuit& circuit, const Word* values, Node node, std::size_t pin,
                                Lanes& result) {
  const auto fanin = circuit.fanin(node);
  const Lanes ones = ~Lanes{};
  Lanes open = ones;
  switch (circuit.kind(node)) {
    case Gate::all:
    case Gate::nall:
      for (std::size_t i = 0; i < fanin.size(); ++i) {
        if (i != pin) open &= lanes(values[fanin[i]]);
      }
      break;
    case Gate::any:
    case Gate::none:
      for (std::size_t i = 0; i < fanin.size(); ++i) {
        if (i != pin) open &= ~lanes(values[fanin[i]]);
      }
      break;
    case Gate::mux: {
      const Lanes s = lanes(values[fanin[2]]);
      open = pin == 0 ? ~s : pin == 1 ? s : lanes(values[fanin[0]]) ^ lanes(values[fanin[1]]);
      break;
    }
    default:
      break;
  }
  result = open;
}

MELTSTAGE_WIDE void simulate_wide(const Circuit& circuit, Word* values) {
  for (Node node = 0; node < circuit.size(); ++node) {
    const auto fanin = circuit.fanin(node);
    evaluate(
        circuit.kind(node), fanin.size(),
        [&](std::size_t i) __attribute__((always_inline))->const Lanes& { return lanes(values[fanin[i]]); },
        lanes(values[node]));
  }
}

struct Workspace {
  const Circuit& circuit;
  const Word* values;
  Word* observable;
  const Word* reaching;
  const Node* root;
  const std::uint8_t* needed;
  Word* faulty;
  std::uint32_t* stamp;
  std::uint64_t* pending;
  std::uint32_t now;
};

// From which lines of a fan-out-free region its root follows a change, in which patterns.
MELTSTAGE_WIDE void trace_regions_wide(const Circuit& circuit, const Word* values, const Node* root,
                                       const std::uint8_t* needed, Word* observable, Word* reaching) {
  for (Node node = static_cast<Node>(circuit.size()); node-- > 0;) {
    if (needed[node] == 0 || circuit.kind(node) == Gate::output) continue;
    if (root[node] == node) {
      lanes(observable[node]) = ~Lanes{};
      lanes(reaching[node]) = Lanes{};
      continue;
    }
    const Node next = circuit.fanout(node)[0];
    const auto fanin = circuit.fanin(next);
    std::size_t pin = 0;
    while (fanin[pin] != node) ++pin;
    Lanes open{};
    sensitive(circuit, values, next, pin, open);
    lanes(observable[node]) = open & lanes(observable[next]);
  }
}

// In which patterns each fault changes the root of its region, and where any does.
MELTSTAGE_WIDE void excite_wide(const Circuit& circuit, const Word* values, const Word* observable,
                                const Node* root, const Fault* faults, const std::uint32_t* which,
                                std::size_t count, const Word& used, Word* detected, Word* reaching) {
  for (std::size_t k = 0; k < count; ++k) {
    const Fault& fault = faults[which[k]];
    const Node line =
        fault.pin == kStem ? fault.node : circuit.fanin(fault.node)[static_cast<std::size_t>(fault.pin)];
    Lanes changed = fault.stuck ? ~lanes(values[line]) : lanes(values[line]);
    changed &= lanes(observable[fault.node]) & lanes(used);
    if (fault.launch != kNoNode)
      changed &= fault.stuck ? lanes(values[fault.launch]) : ~lanes(values[fault.launch]);
    if (fault.pin != kStem) {
      Lanes pass{};
      sensitive(circuit, values, fault.node, static_cast<std::size_t>(fault.pin), pass);
      changed &= pass;
    }
    lanes(detected[k]) = changed;
    if (circuit.kind(root[fault.node]) != Gate::output) lanes(reaching[root[fault.node]]) |= changed;
  }
}

// A change of `stem` in the patterns that reach it, propagated.
MELTSTAGE_INLINE void propagate(Workspace& w, Node stem, Lanes& seen) {
  const Circuit& circuit = w.circuit;
  ++w.now;
  lanes(w.faulty[stem]) = lanes(w.values[stem]) ^ lanes(w.reaching[stem]);
  w.stamp[stem] = w.now;
  std::size_t waiting = 0;
  std::size_t at = stem / 64;
  const auto wake = [&](Node node) __attribute__((always_inline)) {
    for (const Node next : circuit.fanout(node)) {
      std::uint64_t& word = w.pending[next / 64];
      const std::uint64_t bit = std::uint64_t{1} << (next % 64);
      waiting += (word & bit) == 0 ? 1 : 0;
      word |= bit;
    }
  };
  wake(stem);
  Lanes found{};
  while (waiting != 0) {
    while (w.pending[at] == 0) ++at;
    const Node node = static_cast<Node>(64 * at + static_cast<std::size_t>(__builtin_ctzll(w.pending[at])));
    w.pending[at] &= w.pending[at] - 1;
    --waiting;
    const auto fanin = circuit.fanin(node);
    Lanes value{};
    evaluate(
        circuit.kind(node), fanin.size(),
        [&](std::size_t i) __attribute__((always_inline))->const Lanes& {
          return w.stamp[fanin[i]] == w.now ? lanes(w.faulty[fanin[i]]) : lanes(w.values[fanin[i]]);
        },
        value);
    const Lanes difference = value ^ lanes(w.values[node]);
    if (is_zero(difference)) continue;
    if (circuit.kind(node) == Gate::output) {
      found |= difference & lanes(w.observable[node]);
      continue;
    }
    if (waiting == 0 && w.needed[node] != 0) {  // what is left has been looked at, perhaps
      const Node root = w.root[node];
      const Lanes left = root == node ? difference : difference & lanes(w.observable[node]);
      if (is_zero(left & ~lanes(w.reaching[root]))) {
        found |= left & lanes(w.observable[root]);
        continue;
      }
    }
    lanes(w.faulty[node]) = value;
    w.stamp[node] = w.now;
    wake(node);
  }
  seen = found;
}

// Of each root the patterns in which what reaches it shows at an output.
MELTSTAGE_WIDE void observe_wide(Workspace& w) {
  const Circuit& circuit = w.circuit;
  for (Node node = static_cast<Node>(circuit.size()); node-- > 0;) {
    if (w.needed[node] == 0 || w.root[node] != node || circuit.kind(node) == Gate::output) continue;
    Lanes& seen = lanes(w.observable[node]);
    if (is_zero(lanes(w.reaching[node])))
      seen = Lanes{};
    else
      propagate(w, node, seen);
  }
}

MELTSTAGE_WIDE void detect_wide(const Word* observable, const Node* root, const Fault* faults,
                                const std::uint32_t* which, std::size_t count, Word* detected) {
  for (std::size_t k = 0; k < count; ++k)
    lanes(detected[k]) &= lanes(observable[root[faults[which[k]].node]]);
}

}  // namespace

void simulate(const Circuit& circuit, const PatternBlock& block, std::vector<Word>& values) {
  values.resize(circuit.size());
  for (std::size_t i = 0; i < circuit.inputs().size(); ++i) values[circuit.inputs()[i]] = block.inputs[i];
  simulate_wide(circuit, values.data());
}

void simulate_values(const Circuit& circuit, std::vector<Word>& values) {
  simulate_wide(circuit, values.data());
}

void simulate_faulty(const Circuit& circuit, const Fault& fault, std::vector<Word>& values) {
  Lanes stuck{};
  if (fault.stuck) stuck = ~stuck;
  for (Node node = 0; node < circuit.size(); ++node) {
    const auto fanin = circuit.fanin(node);
    evaluate(
        circuit.kind(node), fanin.size(),
        [&](std::size_t i) -> const Lanes& {
          return fault.node == node && fault.pin == static_cast<std::int32_t>(i) ? stuck
                                                                                 : lanes(values[fanin[i]]);
        },
        lanes(values[node]));
    if (fault.node == node && fault.pin == kStem) lanes(values[node]) = stuck;
  }
}

std::vector<std::uint32_t> every(std::size_t count) {
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

FaultSimulator::FaultSimulator(const Circuit& circuit)
    : circuit_(circuit),
      root_(circuit.size()),
      values_(circuit.size()),
      observable_(circuit.size()),
      reaching_(circuit.size()),
      needed_(circuit.size()),
      faulty_(circuit.size()),
      stamp_(circuit.size(), 0),
      pending_(circuit.size() / 64 + 1, 0) {
  for (Node node = static_cast<Node>(circuit.size()); node-- > 0;)
    root_[node] = circuit.fanout(node).size() == 1 ? root_[circuit.fanout(node)[0]] : node;
  for (const Node output : circuit.outputs()) reaching_[output].part.fill(~std::uint64_t{0});
}

const std::vector<Word>& FaultSimulator::detect(const PatternBlock& block, const std::vector<Fault>& faults,
                                                const std::vector<std::uint32_t>& which) {
  simulate(circuit_, block, values_);
  std::fill(needed_.begin(), needed_.end(), std::uint8_t{0});
  for (const std::uint32_t i : which) {
    for (Node node = faults[i].node; needed_[node] == 0; node = circuit_.fanout(node)[0]) {
      needed_[node] = 1;
      if (root_[node] == node) break;
    }
  }
  for (std::size_t i = 0; i < circuit_.outputs().size(); ++i) {
    if (block.compared.empty())
      observable_[circuit_.outputs()[i]].part.fill(~std::uint64_t{0});
    else
      observable_[circuit_.outputs()[i]] = block.compared[i];
  }
  detected_.resize(which.size());
  trace_regions_wide(circuit_, values_.data(), root_.data(), needed_.data(), observable_.data(),
                     reaching_.data());
  excite_wide(circuit_, values_.data(), observable_.data(), root_.data(), faults.data(), which.data(),
              which.size(), block.used(), detected_.data(), reaching_.data());
  Workspace w{circuit_,       values_.data(), observable_.data(), reaching_.data(), root_.data(),
              needed_.data(), faulty_.data(), stamp_.data(),      pending_.data(),  now_};
  observe_wide(w);
  now_ = w.now;
  detect_wide(observable_.data(), root_.data(), faults.data(), which.data(), which.size(), detected_.data());
  return detected_;
}

void FaultSimulator::detect_at_gate(const PatternBlock& block, const std::vector<Fault>& faults,
                                    std::vector<Word>& detected) {
  simulate(circuit_, block, values_);
  for (Word& word : observable_) word.part.fill(~std::uint64_t{0});
  const std::vector<std::uint32_t> all = every(faults.size());
  detected.resize(faults.size());
  excite_wide(circuit_, values_.data(), observable_.data(), root_.data(), faults.data(), all.data(),
              faults.size(), block.used(), detected.data(), reaching_.data());
}

Grade grade(const Circuit& circuit, const std::vector<PatternBlock>& blocks, const std::vector<Fault>& faults,
            unsigned threads, const Progress& progress) {
  const std::vector<std::uint32_t> all = every(faults.size());
  std::vector<Grade> parts(std::max(1U, threads));
  std::atomic<std::size_t> next{0};
  const auto work = [&](Grade& part) {
    part.first_pattern.assign(faults.size(), Grade::kUndetected);
    part.detections.assign(faults.size(), 0);
    FaultSimulator simulator(circuit);
    for (std::size_t b = next++; b < blocks.size(); b = next++) {
      if (&part == &parts[0]) tell(progress, "grading", b, blocks.size());
      const std::vector<Word>& detected = simulator.detect(blocks[b], faults, all);
      for (std::size_t i = 0; i < faults.size(); ++i) {
        const std::size_t lane = detected[i].first();
        if (lane == kLanes) continue;
        part.first_pattern[i] =
            std::min(part.first_pattern[i], static_cast<std::uint32_t>(b * kLanes + lane));
        for (const std::uint64_t p : detected[i].part)
          part.detections[i] += static_cast<std::uint32_t>(__builtin_popcountll(p));
      }
    }
  };
  {
    std::vector<std::jthread> pool;
    for (std::size_t i = 1; i < parts.size(); ++i) pool.emplace_back([&work, &parts, i] { work(parts[i]); });
    work(parts[0]);
  }
  for (std::size_t i = 1; i < parts.size(); ++i) {
    for (std::size_t f = 0; f < faults.size(); ++f) {
      parts[0].first_pattern[f] = std::min(parts[0].first_pattern[f], parts[i].first_pattern[f]);
      parts[0].detections[f] += parts[i].detections[f];
    }
  }
  return std::move(parts[0]);
}

}  // namespace meltstage::dft
