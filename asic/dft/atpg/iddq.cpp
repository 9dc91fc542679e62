// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/iddq.hpp"

#include <algorithm>
#include <array>
#include <random>

#include "asic/dft/atpg/lift.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/lanes.hpp"

namespace meltstage::dft {

namespace {

// How many words have a 1 in each lane: counted in binary, a bit of all lanes at a time.
MELTSTAGE_WIDE void count_lanes(const Word* words, const std::uint8_t* counted, std::size_t count,
                                std::array<std::uint32_t, kLanes>& ones) {
  constexpr std::size_t kBits = 28;
  Word planes[kBits];
  for (std::size_t i = 0; i < count; ++i) {
    if (counted[i] == 0) continue;
    Lanes carry = lanes(words[i]);
    for (std::size_t bit = 0; bit < kBits && !is_zero(carry); ++bit) {
      const Lanes both = lanes(planes[bit]) & carry;
      lanes(planes[bit]) ^= carry;
      carry = both;
    }
  }
  ones.fill(0);
  for (std::size_t bit = 0; bit < kBits; ++bit) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) ones[lane] += planes[bit].bit(lane) ? 1U << bit : 0U;
  }
}

// All pseudo-stuck-at faults of the circuit.
std::vector<Fault> pseudo_faults(const Circuit& circuit, IddqStops& result) {
  const std::vector<std::int8_t> constant =
      constants(circuit, std::vector<std::int8_t>(circuit.inputs().size(), -1));
  std::vector<Fault> faults;
  for (const Site& site : circuit.sites()) {
    if (site.node == kNoNode) continue;
    const Node line =
        site.pin == kStem ? site.node : circuit.fanin(site.node)[static_cast<std::size_t>(site.pin)];
    for (const bool stuck : {false, true}) {
      ++result.faults;
      result.tied += constant[line] == (stuck ? 1 : 0) ? 1 : 0;
      faults.push_back({site.node, site.pin, stuck});
    }
  }
  return faults;
}

// Chooses stops one after another.
class StopSearch {
 public:
  StopSearch(const Circuit& circuit, const std::vector<Pattern>& states, std::uint64_t seed)
      : circuit_(circuit),
        faults_(pseudo_faults(circuit, result_)),
        blocks_(blocks_of(states, circuit.inputs().size())),
        left_(faults_.size(), 1),
        simulator_(circuit),
        lifter_(circuit),
        random_(seed) {
    for (const PatternBlock& block : blocks_) {
      shown_.emplace_back();
      simulator_.detect_at_gate(block, faults_, shown_.back());
      values_.push_back(simulator_.values());
    }
  }

  // False when no state shows an unseen fault.
  bool choose() {
    std::size_t most = 0, in_block = 0, in_lane = 0;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      count_lanes(shown_[b].data(), left_.data(), faults_.size(), ones_);
      const auto best = std::max_element(ones_.begin(), ones_.end());
      if (*best <= most) continue;
      most = *best;
      in_block = b;
      in_lane = static_cast<std::size_t>(best - ones_.begin());
    }
    if (most == 0) return false;
    state_.assign(circuit_.inputs().size(), 0);
    for (std::size_t i = 0; i < state_.size(); ++i)
      state_[i] = blocks_[in_block].inputs[i].bit(in_lane) ? 1 : 0;
    unseen_.clear();
    unseen_at_.clear();
    for (std::size_t i = 0; i < faults_.size(); ++i) {
      if (left_[i] == 0) continue;
      unseen_.push_back(faults_[i]);
      unseen_at_.push_back(i);
    }
    return true;
  }

  // Puts cubes of unseen faults into the chosen state while that helps.
  void improve() {
    for (std::size_t futile = 0; futile < kFutile;) futile = improve_once() ? 0 : futile + 1;
  }

  // The chosen state is a stop.
  void take() {
    simulator_.detect_at_gate(copies(1), unseen_, detected_);
    std::size_t seen = 0;
    for (std::size_t k = 0; k < unseen_.size(); ++k) {
      if (!detected_[k].bit(0)) continue;
      left_[unseen_at_[k]] = 0;
      ++seen;
    }
    result_.states.push_back(state_);
    result_.detected.push_back(seen + (result_.detected.empty() ? 0 : result_.detected.back()));
  }

  IddqStops& result() { return result_; }

 private:
  static constexpr std::size_t kFutile = 2;     // rounds in a row with hardly any gain
  static constexpr std::uint32_t kLeast = 400;  // what is gained in a round that is worth it: 1 / kLeast

  PatternBlock copies(std::size_t count) const {
    PatternBlock block{std::vector<Word>(state_.size()), count, {}};
    for (std::size_t i = 0; i < state_.size(); ++i)
      block.inputs[i].part.fill(state_[i] != 0 ? ~std::uint64_t{0} : 0);
    return block;
  }
  void evaluate(const PatternBlock& block) {
    simulator_.detect_at_gate(block, unseen_, detected_);
    const std::vector<std::uint8_t> all(unseen_.size(), 1);
    count_lanes(detected_.data(), all.data(), unseen_.size(), ones_);
  }

  // What a fault needs in a state that shows it, taken at random; empty when none does.
  Cube cube_of(std::size_t fault) {
    Cube cube;
    const std::size_t first = random_() % blocks_.size();
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      const std::size_t b = (first + k) % blocks_.size();
      if (!shown_[b][fault].any()) continue;
      std::size_t lane = random_() % blocks_[b].count;
      while (!shown_[b][fault].bit(lane)) lane = (lane + 1) % kLanes;
      const auto good = [&](Node node) { return values_[b][node].bit(lane); };
      const Node gate = faults_[fault].node;
      lifter_.lift(
          faults_[fault], gate, good, [&](Node node) { return good(node) != (node == gate); }, cube);
      break;
    }
    return cube;
  }

  // Cubes of unseen faults that the state doesn't show, each tried by itself; then those that help together,
  // the best first. Whether that was worth the trouble.
  bool improve_once() {
    std::vector<Cube> cubes = draw();
    PatternBlock block = copies(cubes.size() + 1);  // the last lane: as it is
    for (std::size_t k = 0; k < cubes.size(); ++k) {
      for (const auto& [input, value] : cubes[k]) block.inputs[input].set(k, value);
    }
    evaluate(block);
    const std::uint32_t now = ones_[cubes.size()];
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < cubes.size(); ++k) {
      if (ones_[k] > now) order.push_back(k);
    }
    if (order.empty()) return false;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return ones_[a] > ones_[b]; });
    block = copies(order.size());
    std::vector<std::int8_t> set(state_.size(), -1);
    for (std::size_t n = 0; n < order.size(); ++n) {
      const Cube& cube = cubes[order[n]];
      const bool fits = std::all_of(cube.begin(), cube.end(), [&](const auto& literal) {
        return set[literal.first] < 0 || set[literal.first] == (literal.second ? 1 : 0);
      });
      for (const auto& [input, value] : cube) {
        if (!fits) break;
        set[input] = value ? 1 : 0;
        for (std::size_t lane = n; lane < order.size(); ++lane) block.inputs[input].set(lane, value);
      }
    }
    evaluate(block);
    const auto best =
        std::max_element(ones_.begin(), ones_.begin() + static_cast<std::ptrdiff_t>(order.size()));
    if (*best <= now) return false;
    const auto lane = static_cast<std::size_t>(best - ones_.begin());
    for (std::size_t i = 0; i < state_.size(); ++i) state_[i] = block.inputs[i].bit(lane) ? 1 : 0;
    return *best - now > now / kLeast;
  }
  std::vector<Cube> draw() {
    simulator_.detect_at_gate(copies(1), unseen_, detected_);
    std::vector<std::size_t> candidates;
    for (std::size_t k = 0; k < unseen_.size(); ++k) {
      if (!detected_[k].bit(0)) candidates.push_back(unseen_at_[k]);
    }
    std::vector<Cube> cubes;
    for (std::size_t k = 0; k < candidates.size() && cubes.size() + 1 < kLanes; ++k) {
      std::swap(candidates[k], candidates[k + random_() % (candidates.size() - k)]);
      Cube cube = cube_of(candidates[k]);
      if (!cube.empty()) cubes.push_back(std::move(cube));
    }
    return cubes;
  }

  const Circuit& circuit_;
  IddqStops result_;
  std::vector<Fault> faults_;
  std::vector<PatternBlock> blocks_;
  std::vector<std::uint8_t> left_;  // by fault: no stop shows it
  FaultSimulator simulator_;
  CubeLifter lifter_;
  std::mt19937_64 random_;
  std::vector<std::vector<Word>> shown_, values_;  // by block of states
  Pattern state_;                                  // the chosen one
  std::vector<Fault> unseen_;                      // before it
  std::vector<std::size_t> unseen_at_;             // their places in faults_
  std::vector<Word> detected_;
  std::array<std::uint32_t, kLanes> ones_{};
};

}  // namespace

double IddqStops::coverage() const {
  if (faults == tied) return 1.0;
  return detected.empty() ? 0.0 : static_cast<double>(detected.back()) / static_cast<double>(faults - tied);
}

Circuit observe_every_gate(const Circuit& circuit) {
  CircuitBuilder builder;
  // nodes stand in topological order: their numbers are the builder's
  for (Node node = 0; node < circuit.size(); ++node)
    builder.add(circuit.kind(node), {circuit.fanin(node).begin(), circuit.fanin(node).end()},
                circuit.name(node));
  for (Node node = 0; node < circuit.size(); ++node) {
    if (circuit.kind(node) != Gate::output) builder.add(Gate::output, {node}, circuit.name(node));
  }
  for (const Site& site : circuit.sites()) builder.add_site(site);
  for (std::size_t i = 0; i < circuit.inputs().size(); ++i) {
    if (circuit.held()[i] >= 0) builder.hold(circuit.inputs()[i], circuit.held()[i] != 0);
  }
  return builder.finish("every gate observed");
}

IddqStops choose_iddq_stops(const Circuit& circuit, const std::vector<Pattern>& states, std::size_t most) {
  StopSearch search(circuit, states, 0);
  while (search.result().states.size() < most && search.choose()) search.take();
  return std::move(search.result());
}

IddqStops search_iddq_stops(const Circuit& circuit, const std::vector<Pattern>& states, std::size_t most,
                            std::uint64_t seed, const Progress& progress) {
  StopSearch search(circuit, states, seed);
  while (search.result().states.size() < most && search.choose()) {
    tell(progress, "choosing stops", search.result().states.size(), most);
    search.improve();
    search.take();
  }
  return std::move(search.result());
}

IddqStops scan_iddq_stops(const ScanDesign& design, const CaptureView& view, std::size_t most,
                          const GenerateOptions& options) {
  constexpr std::size_t kStates = 256;  // to choose from, each with scan enable off and on
  const auto enable = static_cast<std::size_t>(
      std::find(view.input_ports.begin(), view.input_ports.end(), design.scan_enable) -
      view.input_ports.begin());
  std::vector<Pattern> states = generate_tests(observe_every_gate(view.circuit), options).patterns;
  if (states.size() > kStates) states.resize(kStates);
  for (std::size_t i = 0, count = states.size(); i < count; ++i) {
    states.push_back(states[i]);
    states.back()[enable] = 1;
  }
  return search_iddq_stops(view.circuit, states, most, options.seed, options.progress);
}

}  // namespace meltstage::dft
