// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/generate.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <numeric>
#include <random>
#include <thread>

#include "asic/dft/fault_simulator.hpp"
#include "asic/dft/test_solver.hpp"

namespace meltstage::dft {

namespace {

constexpr unsigned kWorkers = 2;
constexpr std::size_t kBatch = 64;  // faults solved by a worker between two simulations
constexpr std::size_t kStride = 8, kChunk = 64 * kBatch;
constexpr std::size_t kPool = 64;    // merged cubes that are open at a time
constexpr std::size_t kClosed = 16;  // of these are closed at a time, when a cube fits none
constexpr std::size_t kFills = kLanes / kClosed;
constexpr std::size_t kRandomBlocks = 512;
constexpr double kRandomYield = 0.0005;  // random patterns end when a block detects less than this share

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// A pattern with free inputs: bits that are set, and their values.
struct Merged {
  std::vector<std::int8_t> value;  // by input; -1: free
  std::size_t set = 0;
};

constexpr std::uint32_t kNone = ~std::uint32_t{0};
// A pattern that detects a fault.
struct Witness {
  std::uint32_t block = kNone, lane = 0;
};

struct Solved {
  std::size_t fault;
  Verdict verdict = Verdict::aborted;
  Cube cube;
};

class Generator {
 public:
  Generator(const Circuit& circuit, FaultList faults, const GenerateOptions& options)
      : circuit_(circuit),
        options_(options),
        random_(options.seed),
        simulators_(kWorkers, FaultSimulator(circuit)) {
    set_.faults = std::move(faults);
    set_.of_class.assign(set_.faults.classes.size(), FaultClass::NO);
    alive_.assign(set_.faults.classes.size(), 1);
    witness_.resize(set_.faults.classes.size());
    cube_of_.resize(set_.faults.classes.size());
    cones_ = output_cones(circuit);
    for (unsigned i = 0; i < kWorkers; ++i) solvers_.emplace_back(circuit, cones_);
  }

  TestSet run() {
    drop_structural();
    auto start = std::chrono::steady_clock::now();
    random_phase();
    random_blocks_ = static_cast<std::uint32_t>(blocks_.size());
    set_.times.random_s = since(start);
    start = std::chrono::steady_clock::now();
    solve_phase();
    set_.times.solve_s = since(start);
    start = std::chrono::steady_clock::now();
    merge_phase();
    set_.times.merge_s = since(start);
    start = std::chrono::steady_clock::now();
    set_.before_compaction = set_.patterns.size();
    std::vector<Fault> detected;
    for (std::size_t i = 0; i < set_.of_class.size(); ++i) {
      if (set_.of_class[i] == FaultClass::DS) detected.push_back(set_.faults.classes[i]);
    }
    set_.patterns =
        compact(circuit_, std::move(set_.patterns), detected, options_.seed, options_.compaction_passes);
    set_.times.compact_s = since(start);
    for (const TestSolver& solver : solvers_)
      set_.solver_calls += solver.effort().near_calls + solver.effort().apart_calls;
    return std::move(set_);
  }

 private:
  // What constants settle without a search: a fault at the value its line has anyway, or behind gates that
  // they close. Ties make it untestable; held inputs make it so for this test alone.
  void drop_structural() {
    const std::vector<std::int8_t> free(circuit_.inputs().size(), -1);
    settle_constant(constants(circuit_, free), FaultClass::UT);
    if (circuit_.held() != free) settle_constant(constants(circuit_, circuit_.held()), FaultClass::AU);
  }
  void settle_constant(const std::vector<std::int8_t>& constant, FaultClass c) {
    std::vector<std::uint8_t> reaches(circuit_.size(), 0);
    for (Node node = static_cast<Node>(circuit_.size()); node-- > 0;) {
      reaches[node] = circuit_.kind(node) == Gate::output ? 1 : 0;
      for (const Node next : circuit_.fanout(node)) {
        const auto fanin = circuit_.fanin(next);
        for (std::size_t pin = 0; pin < fanin.size() && reaches[node] == 0; ++pin) {
          if (fanin[pin] == node && reaches[next] != 0 && !closed(next, pin, constant)) reaches[node] = 1;
        }
      }
    }
    for (std::size_t i = 0; i < set_.faults.classes.size(); ++i) {
      if (alive_[i] == 0) continue;
      const Fault& fault = set_.faults.classes[i];
      const auto pin = static_cast<std::size_t>(fault.pin);
      const Node line = fault.pin == kStem ? fault.node : circuit_.fanin(fault.node)[pin];
      bool hidden = reaches[fault.node] == 0 || (fault.pin != kStem && closed(fault.node, pin, constant));
      if (constant[line] >= 0)
        hidden = false;  // the fault changes the constant, and with it what that closes
      const bool launched = fault.launch == kNoNode || constant[fault.launch] != (fault.stuck ? 0 : 1);
      if (hidden || !launched || constant[line] == (fault.stuck ? 1 : 0)) settle(i, c);
    }
  }
  // Another input of the gate is at a constant that hides this one.
  bool closed(Node gate, std::size_t pin, const std::vector<std::int8_t>& constant) const {
    const auto fanin = circuit_.fanin(gate);
    const Gate kind = circuit_.kind(gate);
    if (kind == Gate::mux) return pin < 2 && constant[fanin[2]] == (pin == 0 ? 1 : 0);
    if (kind != Gate::all && kind != Gate::nall && kind != Gate::any && kind != Gate::none) return false;
    const std::int8_t controlling = kind == Gate::all || kind == Gate::nall ? 0 : 1;
    for (std::size_t other = 0; other < fanin.size(); ++other) {
      if (other != pin && constant[fanin[other]] == controlling) return true;
    }
    return false;
  }
  void settle(std::size_t i, FaultClass c) {
    set_.of_class[i] = c;
    alive_[i] = 0;
  }

  std::uint64_t bits() { return random_(); }
  PatternBlock random_block() {
    PatternBlock block{std::vector<Word>(circuit_.inputs().size()), kLanes, {}};
    for (std::size_t i = 0; i < block.inputs.size(); ++i) {
      const std::int8_t held = circuit_.held()[i];
      for (std::uint64_t& part : block.inputs[i].part)
        part = held < 0 ? bits() : held != 0 ? ~std::uint64_t{0} : 0;
    }
    return block;
  }

  // Random patterns tell easy faults from hard ones and give the easy ones a witness.
  void random_phase() {
    std::vector<std::uint8_t> watched = alive_;
    for (std::size_t b = 0; b < kRandomBlocks; b += kWorkers) {
      std::vector<std::vector<Word>> detected(kWorkers);
      const std::size_t first = blocks_.size();
      for (unsigned w = 0; w < kWorkers; ++w) blocks_.push_back(random_block());
      in_parallel([&](unsigned w) {
        simulators_[w].detect(blocks_[first + w], set_.faults.classes, watched, detected[w]);
      });
      std::size_t found = 0;
      for (unsigned w = 0; w < kWorkers; ++w) found += take_witnesses(detected[w], first + w, watched);
      if (static_cast<double>(found) < kRandomYield * static_cast<double>(alive_.size())) break;
    }
  }

  // Returns how many faults of `watched` have got a witness; they are watched no more.
  std::size_t take_witnesses(const std::vector<Word>& detected, std::size_t block,
                             std::vector<std::uint8_t>& watched) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < watched.size(); ++i) {
      if (watched[i] == 0) continue;
      const std::size_t lane = detected[i].first();
      if (lane == kLanes) continue;
      witness_[i] = {static_cast<std::uint32_t>(block), static_cast<std::uint32_t>(lane)};
      watched[i] = 0;
      ++found;
    }
    return found;
  }

  // A cube or a verdict for every fault without a witness; faults that the solver's patterns detect by the
  // way have a witness in them.
  void solve_phase() {
    std::vector<std::uint8_t> watched(alive_.size(), 0);
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < alive_.size(); ++i) {
      if (alive_[i] == 0 || witness_[i].block != kNone) continue;
      watched[i] = 1;
      order.push_back(i);
    }
    solve_apart(solve_near(order, watched), watched);
  }

  // At the nearest output of each fault alone; returns those that have no test there. Faults of one output
  // stand together and share a solver. Each worker takes its batches from its own half, every so manieth
  // fault first: its neighbours often fall with it.
  std::vector<std::size_t> solve_near(std::vector<std::size_t> order, std::vector<std::uint8_t>& watched) {
    const auto output = [&](std::size_t i) { return cones_.nearest[set_.faults.classes[i].node]; };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return output(a) < output(b); });
    std::vector<std::vector<std::size_t>> queue(kWorkers);
    for (unsigned w = 0; w < kWorkers; ++w) {
      const std::size_t first = order.size() * w / kWorkers, end = order.size() * (w + 1) / kWorkers;
      for (std::size_t chunk = first; chunk < end; chunk += kChunk) {
        for (std::size_t offset = 0; offset < kStride; ++offset) {
          for (std::size_t k = chunk + offset; k < std::min(chunk + kChunk, end); k += kStride)
            queue[w].push_back(order[k]);
        }
      }
    }
    std::vector<std::size_t> at(kWorkers, 0), left;
    const auto done = [&] {
      for (unsigned w = 0; w < kWorkers; ++w) {
        if (at[w] < queue[w].size()) return false;
      }
      return true;
    };
    while (!done()) {
      std::vector<std::vector<Solved>> batch(kWorkers);
      in_parallel([&](unsigned w) {
        for (; at[w] < queue[w].size() && batch[w].size() < kBatch; ++at[w]) {
          const std::size_t i = queue[w][at[w]];
          if (watched[i] == 0) continue;
          Solved solved{i, Verdict::aborted, {}};
          if (solvers_[w].solve_near(set_.faults.classes[i], solved.cube)) solved.verdict = Verdict::test;
          batch[w].push_back(std::move(solved));
        }
      });
      std::vector<Solved> found;
      for (std::vector<Solved>& part : batch) {
        for (Solved& solved : part) {
          if (solved.verdict == Verdict::test)
            found.push_back(std::move(solved));
          else
            left.push_back(solved.fault);
        }
      }
      take_cubes(found, watched);
    }
    return left;
  }

  // A verdict for each. They are independent of each other, so that a worker that is free takes the next.
  void solve_apart(const std::vector<std::size_t>& order, std::vector<std::uint8_t>& watched) {
    for (std::size_t at = 0; at < order.size();) {
      std::vector<Solved> batch;
      for (; at < order.size() && batch.size() < kWorkers * kBatch; ++at) {
        if (watched[order[at]] != 0) batch.push_back({order[at], Verdict::aborted, {}});
      }
      std::atomic<std::size_t> next{0};
      in_parallel([&](unsigned w) {
        for (std::size_t k = next++; k < batch.size(); k = next++)
          batch[k].verdict = solvers_[w].solve_apart(set_.faults.classes[batch[k].fault], batch[k].cube,
                                                     options_.conflict_limit);
      });
      std::vector<Solved> found;
      for (Solved& solved : batch) {
        watched[solved.fault] = 0;
        if (solved.verdict == Verdict::test) {
          found.push_back(std::move(solved));
        } else if (solved.verdict == Verdict::aborted) {
          alive_[solved.fault] = 0;
          ++set_.aborted;
        } else {
          settle(solved.fault, solved.verdict == Verdict::held ? FaultClass::AU : FaultClass::UR);
        }
      }
      take_cubes(found, watched);
    }
  }

  // Keeps the cubes, and looks what else patterns around them detect.
  void take_cubes(std::vector<Solved>& found, std::vector<std::uint8_t>& watched) {
    if (found.empty()) return;
    const std::size_t first = blocks_.size();
    for (unsigned w = 0; w < kWorkers; ++w) blocks_.push_back(filled(found, kLanes / (kWorkers * kBatch)));
    for (Solved& solved : found) {
      watched[solved.fault] = 0;
      cube_of_[solved.fault] = std::move(solved.cube);
    }
    std::vector<std::vector<Word>> detected(kWorkers);
    in_parallel([&](unsigned w) {
      simulators_[w].detect(blocks_[first + w], set_.faults.classes, watched, detected[w]);
    });
    for (unsigned w = 0; w < kWorkers; ++w) take_witnesses(detected[w], first + w, watched);
  }

  // Random patterns around cubes, `fills` in a row for each.
  PatternBlock filled(const std::vector<Solved>& found, std::size_t fills) {
    PatternBlock block = random_block();
    block.count = found.size() * fills;
    for (std::size_t k = 0; k < found.size(); ++k) {
      for (const auto& [input, value] : found[k].cube) {
        for (std::size_t fill = 0; fill < fills; ++fill) block.inputs[input].set(k * fills + fill, value);
      }
    }
    return block;
  }

  template <class Body>
  void in_parallel(const Body& body) {
    std::jthread other([&] { body(1); });
    body(0);
  }

  // Hard faults first, each group in random order, so that cubes of far parts meet and merge.
  std::vector<std::size_t> merge_order() {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < alive_.size(); ++i) {
      if (alive_[i] != 0) order.push_back(i);
    }
    std::shuffle(order.begin(), order.end(), random_);
    const auto ease = [&](std::size_t i) {
      if (!cube_of_[i].empty()) return 0u;
      return witness_[i].block < random_blocks_ ? random_blocks_ - witness_[i].block : 1u;
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return ease(a) < ease(b); });
    return order;
  }

  // Patterns for all faults that have a cube or a witness.
  void merge_phase() {
    const std::vector<std::size_t> order = merge_order();
    std::vector<CubeLifter> lifters(kWorkers, CubeLifter(circuit_));
    for (std::size_t at = 0; at < order.size();) {
      std::vector<std::size_t> batch;
      for (; at < order.size() && batch.size() < kLanes; ++at) {
        if (alive_[order[at]] != 0) batch.push_back(order[at]);
      }
      lift_witnesses(batch, lifters);
      for (const std::size_t i : batch) {
        if (alive_[i] != 0) merge(cube_of_[i]);
        cube_of_[i] = {};
      }
    }
    while (!pool_.empty()) close(std::min(pool_.size(), kClosed));
  }
  void lift_witnesses(const std::vector<std::size_t>& batch, std::vector<CubeLifter>& lifters) {
    PatternBlock block{std::vector<Word>(circuit_.inputs().size()), batch.size(), {}};
    for (std::size_t k = 0; k < batch.size(); ++k) {
      const Witness& witness = witness_[batch[k]];
      if (witness.block == kNone) continue;
      const std::vector<Word>& from = blocks_[witness.block].inputs;
      for (std::size_t i = 0; i < from.size(); ++i) block.inputs[i].set(k, from[i].bit(witness.lane));
    }
    std::vector<Word> values;
    simulate(circuit_, block, values);
    in_parallel([&](unsigned w) {
      for (std::size_t k = w; k < batch.size(); k += kWorkers) {
        if (witness_[batch[k]].block != kNone)
          lifters[w].lift_lane(set_.faults.classes[batch[k]], values, k, cube_of_[batch[k]]);
      }
    });
  }

  // Into the open pattern that shares most values with the cube and contradicts none.
  void merge(const Cube& cube) {
    Merged* best = nullptr;
    std::size_t best_shared = 0;
    for (Merged& merged : pool_) {
      std::size_t shared = 0;
      bool fits = true;
      for (const auto& [input, value] : cube) {
        const std::int8_t have = merged.value[input];
        if (have < 0) continue;
        if (have != (value ? 1 : 0)) {
          fits = false;
          break;
        }
        ++shared;
      }
      if (fits && (best == nullptr || shared > best_shared)) {
        best = &merged;
        best_shared = shared;
      }
    }
    if (best == nullptr) {
      if (pool_.size() == kPool) close(kClosed);
      pool_.push_back({std::vector<std::int8_t>(circuit_.inputs().size(), -1), 0});
      best = &pool_.back();
    }
    for (const auto& [input, value] : cube) {
      best->set += best->value[input] < 0 ? 1 : 0;
      best->value[input] = value ? 1 : 0;
    }
  }

  // The `count` open patterns that have most inputs set are filled in several ways; of each, the fill that
  // detects most is kept.
  void close(std::size_t count) {
    std::stable_sort(pool_.begin(), pool_.end(),
                     [](const Merged& a, const Merged& b) { return a.set > b.set; });
    PatternBlock block = random_block();
    block.count = count * kFills;
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t input = 0; input < block.inputs.size(); ++input) {
        if (pool_[k].value[input] < 0) continue;
        for (std::size_t fill = 0; fill < kFills; ++fill)
          block.inputs[input].set(k * kFills + fill, pool_[k].value[input] != 0);
      }
    }
    pool_.erase(pool_.begin(), pool_.begin() + static_cast<std::ptrdiff_t>(count));
    std::vector<Word> detected;
    simulators_[0].detect(block, set_.faults.classes, alive_, detected);
    std::vector<std::vector<std::uint32_t>> by_lane(block.count);
    for (std::size_t i = 0; i < detected.size(); ++i) {
      for (std::size_t part = 0; part < detected[i].part.size(); ++part) {
        for (std::uint64_t bits = detected[i].part[part]; bits != 0; bits &= bits - 1)
          by_lane[64 * part + static_cast<std::size_t>(__builtin_ctzll(bits))].push_back(
              static_cast<std::uint32_t>(i));
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      std::size_t best = k * kFills, best_new = 0;
      for (std::size_t lane = k * kFills; lane < (k + 1) * kFills; ++lane) {
        const auto fresh = static_cast<std::size_t>(std::count_if(
            by_lane[lane].begin(), by_lane[lane].end(), [&](std::uint32_t i) { return alive_[i] != 0; }));
        if (fresh > best_new) {
          best_new = fresh;
          best = lane;
        }
      }
      if (best_new == 0) continue;
      for (const std::uint32_t i : by_lane[best]) settle(i, FaultClass::DS);
      Pattern pattern(circuit_.inputs().size());
      for (std::size_t input = 0; input < pattern.size(); ++input)
        pattern[input] = block.inputs[input].bit(best) ? 1 : 0;
      set_.patterns.push_back(std::move(pattern));
    }
  }

  const Circuit& circuit_;
  GenerateOptions options_;
  std::mt19937_64 random_;
  std::vector<FaultSimulator> simulators_;
  OutputCones cones_;
  std::vector<TestSolver> solvers_;
  std::vector<std::uint8_t> alive_;
  std::vector<PatternBlock> blocks_;  // random ones, then those around the solver's cubes
  std::uint32_t random_blocks_ = 0;
  std::vector<Witness> witness_;
  std::vector<Cube> cube_of_;
  std::vector<Merged> pool_;
  TestSet set_;
};

}  // namespace

std::vector<Pattern> compact(const Circuit& circuit, std::vector<Pattern> patterns,
                             const std::vector<Fault>& faults, std::uint64_t seed, unsigned passes) {
  std::mt19937_64 random(seed);
  FaultSimulator simulator(circuit);
  for (unsigned pass = 0; pass < passes; ++pass) {
    std::vector<std::size_t> order(patterns.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::reverse(order.begin(), order.end());
    if (pass > 0) std::shuffle(order.begin(), order.end(), random);
    std::vector<Pattern> ordered;
    for (const std::size_t i : order) ordered.push_back(patterns[i]);
    std::vector<std::uint8_t> keep(patterns.size(), 0), alive(faults.size(), 1);
    std::vector<Word> detected;
    std::size_t first = 0;
    for (const PatternBlock& block : blocks_of(ordered, circuit.inputs().size())) {
      simulator.detect(block, faults, alive, detected);
      for (std::size_t i = 0; i < faults.size(); ++i) {
        const std::size_t lane = detected[i].first();
        if (lane == kLanes) continue;
        keep[order[first + lane]] = 1;
        alive[i] = 0;
      }
      first += block.count;
    }
    std::vector<Pattern> kept;
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      if (keep[i] != 0) kept.push_back(std::move(patterns[i]));
    }
    patterns = std::move(kept);
  }
  return patterns;
}

TestSet generate_tests(const Circuit& circuit, const GenerateOptions& options) {
  return generate_tests(circuit, collapse(circuit), options);
}

TestSet generate_tests(const Circuit& circuit, FaultList faults, const GenerateOptions& options) {
  return Generator(circuit, std::move(faults), options).run();
}

}  // namespace meltstage::dft
