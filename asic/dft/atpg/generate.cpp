// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/generate.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <numeric>
#include <random>

#include "asic/dft/atpg/podem.hpp"
#include "asic/dft/atpg/test_solver.hpp"
#include "asic/dft/core/workers.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

namespace {

constexpr std::size_t kBatch = 128;  // faults solved between two simulations
constexpr std::size_t kStride = 8, kChunk = 64 * kBatch;
constexpr std::size_t kPool = 64;    // merged cubes that are open at a time
constexpr std::size_t kClosed = 16;  // of these are closed at a time, when a cube fits none
constexpr std::size_t kFills = kLanes / kClosed;
constexpr std::size_t kRandomBlocks = 512;
constexpr std::array<std::size_t, 2> kBacktracks{12, 100};  // of the quick search, first and second time
constexpr std::size_t kCandidates = 2048;  // faults that a pattern is extended for when it is closed
constexpr std::size_t kInTheWay = 8;       // values of their cubes, at the most, that it has otherwise
constexpr std::size_t kExtendBacktracks = 3;
// Gates that the search may look at to extend a pattern by half of them, times nodes of the circuit: patterns
// are more and searches longer where that is larger.
constexpr std::size_t kExtendWork = 500'000'000;
constexpr std::size_t kFreeBacktracks = 100;  // of the one with nothing held
constexpr double kRandomYield = 0.00025;      // random patterns end when a block detects less than this share

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Of all threads of the program.
double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

// A pattern with free inputs: bits that are set, and their values.
struct Merged {
  std::vector<std::int8_t> value;  // by input; -1: free
  std::size_t set = 0;
};

constexpr std::uint32_t kNone = ~std::uint32_t{0};
// A pattern that detects a fault.
struct Witness {
  std::uint32_t pattern = kNone;  // kept one
  std::uint32_t block = kNone;    // the how manieth block of all it was in
};

struct Solved {
  std::uint32_t fault;
  Verdict verdict = Verdict::aborted;
  Cube cube;
};

class Generator {
 public:
  Generator(const Circuit& circuit, FaultList faults, const GenerateOptions& options)
      : circuit_(circuit),
        options_(options),
        random_(options.seed),
        simulator_(circuit),
        podems_(kWorkers, Podem(circuit)),
        free_podems_(kWorkers, Podem(circuit, std::vector<std::int8_t>(circuit.inputs().size(), -1))),
        kept_(circuit.inputs().size()),
        extend_work_(kExtendWork / circuit.size()) {
    set_.faults = std::move(faults);
    set_.of_class.assign(set_.faults.classes.size(), FaultClass::NO);
    alive_.assign(set_.faults.classes.size(), 1);
    witness_.resize(set_.faults.classes.size());
    cube_of_.resize(set_.faults.classes.size());
    placed_.assign(set_.faults.classes.size(), 0);
    solvers_.reserve(kWorkers);
    const OutputCones cones = output_cones(circuit);
    while (solvers_.size() < kWorkers) solvers_.emplace_back(circuit, cones);
  }

  TestSet run() {
    drop_structural();
    step("random patterns", [&] { random_phase(); });
    random_blocks_ = blocks_;
    solve_phase();
    step("merging", [&] { merge_phase(); });
    step("dropping", [&] { drop_superfluous(); });
    for (const TestSolver& solver : solvers_) set_.solver_calls += solver.calls();
    return std::move(set_);
  }

 private:
  template <class Body>
  void step(const char* name, const Body& body) {
    const auto start = std::chrono::steady_clock::now();
    const double processor_start = processor_s();
    body();
    set_.steps.push_back({name, since(start), processor_s() - processor_start});
  }

  void drop_superfluous() {
    set_.before_compaction = set_.patterns.size();
    std::vector<Fault> detected;
    for (std::size_t i = 0; i < set_.of_class.size(); ++i) {
      if (set_.of_class[i] == FaultClass::DS) detected.push_back(set_.faults.classes[i]);
    }
    set_.patterns = compact(circuit_, std::move(set_.patterns), detected, options_.seed,
                            options_.compaction_passes, options_.progress);
  }

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
    std::vector<std::uint32_t> watched;
    for (std::uint32_t i = 0; i < alive_.size(); ++i) {
      if (alive_[i] != 0) watched.push_back(i);
    }
    for (std::size_t b = 0; b < kRandomBlocks; ++b) {
      const std::size_t before = watched.size();
      look(random_block(), watched);
      if (static_cast<double>(before - watched.size()) < kRandomYield * static_cast<double>(alive_.size()))
        break;
    }
  }

  // Keeps a pattern of the block as a witness for every fault of `watched` that it detects; these are watched
  // no more.
  void look(const PatternBlock& block, std::vector<std::uint32_t>& watched) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> found;  // fault, lane
    std::vector<std::uint32_t> place(kLanes, kNone), lanes;
    simulator_.detect(block, set_.faults.classes, watched, [&](std::uint32_t i, const Word& patterns) {
      found.emplace_back(i, static_cast<std::uint32_t>(patterns.first()));
      place[found.back().second] = 0;
    });
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      if (place[lane] == kNone) continue;
      place[lane] = static_cast<std::uint32_t>(kept_.size() + lanes.size());
      lanes.push_back(lane);
    }
    kept_.append(block, lanes);
    for (const auto& [i, lane] : found) witness_[i] = {place[lane], blocks_};
    ++blocks_;
    std::erase_if(watched, [&](std::uint32_t i) { return witness_[i].pattern != kNone; });
  }

  // A cube or a verdict for every fault without a witness; faults that the solver's patterns detect by the
  // way have a witness in them.
  void solve_phase() {
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < alive_.size(); ++i) {
      if (alive_[i] != 0 && witness_[i].pattern == kNone) open.push_back(i);
    }
    open = in_strides(std::move(open));
    for (const std::size_t backtracks : kBacktracks) {
      step("quick search", [&] {
        std::vector<std::uint32_t> left;
        solve_each(
            fmt::format("quick search, {} backtracks", backtracks), open,
            [&](unsigned w, Solved& solved) { solved.verdict = search(w, solved, backtracks); },
            [&](const Solved& solved) {
              if (solved.verdict == Verdict::aborted)
                left.push_back(solved.fault);
              else
                take_verdict(solved);
            });
        open = std::move(left);
      });
    }
    step("solver", [&] {
      solve_each(
          "solver", open,
          [&](unsigned w, Solved& solved) {
            const Fault& fault = set_.faults.classes[solved.fault];
            solved.verdict = solvers_[w].solve(fault, solved.cube, options_.conflict_limit);
          },
          [&](const Solved& solved) { take_verdict(solved); });
    });
  }
  void take_verdict(const Solved& solved) {
    if (solved.verdict == Verdict::aborted) {
      alive_[solved.fault] = 0;
      ++set_.aborted;
    } else {
      settle(solved.fault, solved.verdict == Verdict::held ? FaultClass::AU : FaultClass::UR);
    }
  }
  // Where there is no test, the inputs that are held may be why.
  Verdict search(unsigned w, Solved& solved, std::size_t backtracks) {
    const Fault& fault = set_.faults.classes[solved.fault];
    Search result = podems_[w].search(fault, backtracks, solved.cube);
    if (result == Search::test) return Verdict::test;
    if (result == Search::gave_up) return Verdict::aborted;
    Cube any;
    result = free_podems_[w].search(fault, kFreeBacktracks, any);
    if (result == Search::none) return Verdict::redundant;
    if (result == Search::test || fault.launch != kNoNode) return Verdict::held;
    return solvers_[w].without_holds(fault);
  }
  // Faults that lie together often fall together: of a chunk of them every so manieth comes first.
  std::vector<std::uint32_t> in_strides(std::vector<std::uint32_t> faults) const {
    std::stable_sort(faults.begin(), faults.end(), [&](std::uint32_t a, std::uint32_t b) {
      return set_.faults.classes[a].node < set_.faults.classes[b].node;
    });
    std::vector<std::uint32_t> queue;
    for (std::size_t chunk = 0; chunk < faults.size(); chunk += kChunk) {
      for (std::size_t offset = 0; offset < kStride; ++offset) {
        for (std::size_t k = chunk + offset; k < std::min(chunk + kChunk, faults.size()); k += kStride)
          queue.push_back(faults[k]);
      }
    }
    return queue;
  }
  bool is_open(std::uint32_t i) const {
    return alive_[i] != 0 && witness_[i].pattern == kNone && cube_of_[i].empty();
  }

  // solve(worker, solved) for each that is still open; what it finds must depend on the fault alone, since a
  // worker that is free takes the next. Faults without a test go to rest().
  template <class Solve, class Rest>
  void solve_each(const std::string& name, const std::vector<std::uint32_t>& queue, const Solve& solve,
                  const Rest& rest) {
    std::vector<std::uint32_t> watched = queue;
    for (std::size_t at = 0; at < queue.size();) {
      std::vector<Solved> batch;
      for (; at < queue.size() && batch.size() < kBatch; ++at) {
        if (is_open(queue[at])) batch.push_back({queue[at], Verdict::aborted, {}});
      }
      std::atomic<std::size_t> next{0};
      in_parallel([&](unsigned w) {
        for (std::size_t k = next++; k < batch.size(); k = next++) solve(w, batch[k]);
      });
      for (const Solved& solved : batch) {
        if (solved.verdict != Verdict::test) rest(solved);
      }
      std::erase_if(batch, [](const Solved& solved) { return solved.verdict != Verdict::test; });
      take_cubes(batch, watched);
      tell(options_.progress, name, at, queue.size());
    }
  }

  // Keeps the cubes, and looks what else patterns around them detect.
  void take_cubes(std::vector<Solved>& found, std::vector<std::uint32_t>& watched) {
    if (found.empty()) return;
    const PatternBlock block = filled(found);
    for (Solved& solved : found) cube_of_[solved.fault] = std::move(solved.cube);
    std::erase_if(watched, [&](std::uint32_t i) { return !is_open(i); });
    look(block, watched);
  }

  // Random patterns around cubes, as many in a row for each as there is room for.
  PatternBlock filled(const std::vector<Solved>& found) {
    const std::size_t fills = kLanes / found.size();
    PatternBlock block = random_block();
    block.count = found.size() * fills;
    for (std::size_t k = 0; k < found.size(); ++k) {
      for (const auto& [input, value] : found[k].cube) block.inputs[input].set(k * fills, fills, value);
    }
    return block;
  }

  // Hard faults first, each group in random order, so that cubes of far parts meet and merge.
  std::vector<std::uint32_t> merge_order() {
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < alive_.size(); ++i) {
      if (alive_[i] != 0) order.push_back(i);
    }
    std::shuffle(order.begin(), order.end(), random_);
    const auto ease = [&](std::uint32_t i) {
      if (!cube_of_[i].empty()) return 0u;
      return witness_[i].block < random_blocks_ ? random_blocks_ - witness_[i].block : 1u;
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return ease(a) < ease(b); });
    return order;
  }

  // Patterns for all faults that have a cube or a witness.
  void merge_phase() {
    order_ = merge_order();
    std::vector<CubeLifter> lifters(kWorkers, CubeLifter(circuit_));
    for (std::size_t at = 0;; ++at) {
      while (next_ < order_.size() && ready_.size() - at < kCandidates) {
        std::vector<std::uint32_t> batch;
        for (; next_ < order_.size() && batch.size() < kLanes; ++next_) {
          if (is_waiting(order_[next_])) batch.push_back(order_[next_]);
        }
        lift_witnesses(batch, lifters);
        ready_.erase(ready_.begin(), ready_.begin() + static_cast<std::ptrdiff_t>(at));
        ready_.insert(ready_.end(), batch.begin(), batch.end());
        at = 0;
      }
      if (at == ready_.size()) break;
      const std::uint32_t i = ready_[at];
      if (is_waiting(i)) merge(cube_of_[i]);
      placed_[i] = 1;
      cube_of_[i] = {};
      if (at % kLanes == 0) tell(options_.progress, "merging", next_ - (ready_.size() - at), order_.size());
    }
    while (!pool_.empty()) close(std::min(pool_.size(), kClosed));
  }
  void lift_witnesses(const std::vector<std::uint32_t>& batch, std::vector<CubeLifter>& lifters) {
    std::vector<std::uint32_t> patterns;
    for (const std::uint32_t i : batch)
      patterns.push_back(witness_[i].pattern == kNone ? PackedPatterns::kSkip : witness_[i].pattern);
    std::vector<Word> values;
    simulate(circuit_, kept_.block_of(patterns), values);
    in_parallel([&](unsigned w) {
      for (std::size_t k = w; k < batch.size(); k += kWorkers) {
        if (patterns[k] != PackedPatterns::kSkip)
          lifters[w].lift_lane(set_.faults.classes[batch[k]], values, k, cube_of_[batch[k]]);
      }
    });
  }

  // Neither detected nor in an open pattern.
  bool is_waiting(std::uint32_t i) const { return alive_[i] != 0 && placed_[i] == 0; }

  // Faults that come next get tests beside what the first `count` open patterns have set, where little of
  // their cubes is in the way. Each worker has patterns of its own, and of the faults one half after the
  // other.
  void extend(std::size_t count) {
    std::vector<std::uint32_t> candidates;
    for (const std::uint32_t i : ready_) {
      if (is_waiting(i) && candidates.size() < kCandidates) candidates.push_back(i);
    }
    for (unsigned half = 0; half < kWorkers; ++half) {
      in_parallel([&](unsigned w) {
        std::vector<std::uint32_t> part;
        for (std::size_t k = w; k < count; k += kWorkers) {
          part.clear();
          for (std::size_t c = (w + half) % kWorkers; c < candidates.size(); c += kWorkers) {
            if (placed_[candidates[c]] == 0) part.push_back(candidates[c]);
          }
          extend(podems_[w], pool_[k], std::move(part));
        }
      });
    }
  }
  // Those first whose cubes have least in their way.
  void extend(Podem& podem, Merged& merged, std::vector<std::uint32_t> part) {
    std::array<std::vector<std::uint32_t>, kInTheWay + 1> by_count;
    for (const std::uint32_t i : part) {
      const std::size_t count = in_the_way(cube_of_[i], merged);
      if (count < by_count.size()) by_count[count].push_back(i);
    }
    podem.fix(cube_of(merged));
    Cube cube;
    std::size_t work = 0;
    for (const std::vector<std::uint32_t>& faults : by_count) {
      for (const std::uint32_t i : faults) {
        if (work > extend_work_) break;
        if (in_the_way(cube_of_[i], merged) == 0) {
          cube = cube_of_[i];
        } else {
          const Search result = podem.search(set_.faults.classes[i], kExtendBacktracks, cube);
          work += podem.work();
          if (result != Search::test) continue;
        }
        placed_[i] = 1;
        add(cube, merged);
        podem.fix(cube);
      }
    }
    podem.release();
  }
  // Values of the cube that the pattern has otherwise.
  static std::size_t in_the_way(const Cube& cube, const Merged& merged) {
    std::size_t count = 0;
    for (const auto& [input, value] : cube) count += merged.value[input] == (value ? 0 : 1) ? 1 : 0;
    return count;
  }
  static Cube cube_of(const Merged& merged) {
    Cube cube;
    for (std::uint32_t input = 0; input < merged.value.size(); ++input) {
      if (merged.value[input] >= 0) cube.emplace_back(input, merged.value[input] != 0);
    }
    return cube;
  }
  static void add(const Cube& cube, Merged& merged) {
    for (const auto& [input, value] : cube) {
      merged.set += merged.value[input] < 0 ? 1 : 0;
      merged.value[input] = value ? 1 : 0;
    }
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
    add(cube, *best);
  }

  // The `count` open patterns that have most inputs set are filled in several ways; of each, the fill that
  // detects most is kept.
  void close(std::size_t count) {
    std::stable_sort(pool_.begin(), pool_.end(),
                     [](const Merged& a, const Merged& b) { return a.set > b.set; });
    extend(count);
    PatternBlock block = random_block();
    block.count = count * kFills;
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t input = 0; input < block.inputs.size(); ++input) {
        if (pool_[k].value[input] >= 0)
          block.inputs[input].set(k * kFills, kFills, pool_[k].value[input] != 0);
      }
    }
    pool_.erase(pool_.begin(), pool_.begin() + static_cast<std::ptrdiff_t>(count));
    std::vector<std::uint32_t> watched;
    for (std::uint32_t i = 0; i < alive_.size(); ++i) {
      if (alive_[i] != 0) watched.push_back(i);
    }
    std::vector<std::pair<std::uint32_t, Word>> found;
    simulator_.detect(block, set_.faults.classes, watched,
                      [&](std::uint32_t i, const Word& patterns) { found.emplace_back(i, patterns); });
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t best = best_fill(found, k);
      if (best == kLanes) continue;
      std::erase_if(found, [&](const auto& entry) {
        if (!entry.second.bit(best)) return false;
        settle(entry.first, FaultClass::DS);
        return true;
      });
      Pattern pattern(circuit_.inputs().size());
      for (std::size_t input = 0; input < pattern.size(); ++input)
        pattern[input] = block.inputs[input].bit(best) ? 1 : 0;
      set_.patterns.push_back(std::move(pattern));
    }
  }
  // The lane of the k-th pattern's fills that detects most; kLanes when none detects anything.
  static std::size_t best_fill(const std::vector<std::pair<std::uint32_t, Word>>& found, std::size_t k) {
    static_assert(kFills == 32);
    std::array<std::uint64_t, 32> planes{};  // counters of all fills, a binary digit a plane
    for (const auto& entry : found) {
      std::uint64_t carry = entry.second.part[k / 2] >> (k % 2 * kFills) & 0xFFFFFFFFU;
      for (std::size_t digit = 0; carry != 0; ++digit) {
        const std::uint64_t both = planes[digit] & carry;
        planes[digit] ^= carry;
        carry = both;
      }
    }
    std::size_t best = kLanes, most = 0;
    for (std::size_t fill = 0; fill < kFills; ++fill) {
      std::size_t count = 0;
      for (std::size_t digit = 0; digit < planes.size(); ++digit)
        count += (planes[digit] >> fill & 1U) << digit;
      if (count <= most) continue;
      most = count;
      best = k * kFills + fill;
    }
    return best;
  }

  const Circuit& circuit_;
  GenerateOptions options_;
  std::mt19937_64 random_;
  ParallelFaultSimulator simulator_;
  std::vector<Podem> podems_, free_podems_;  // with the held inputs at their values; with all inputs free
  std::vector<TestSolver> solvers_;
  std::vector<std::uint8_t> alive_;
  PackedPatterns kept_;                           // witnesses
  std::uint32_t blocks_ = 0, random_blocks_ = 0;  // that were looked at; of these the random ones
  std::vector<Witness> witness_;
  std::vector<Cube> cube_of_;
  std::vector<Merged> pool_;
  std::size_t extend_work_;           // of each worker, a pattern
  std::vector<std::uint32_t> order_;  // faults, as patterns are made for them
  std::size_t next_ = 0;              // of order_
  std::vector<std::uint32_t> ready_;  // the next ones, with their cubes
  std::vector<std::uint8_t> placed_;  // by fault: an open pattern detects it, or one that was open
  TestSet set_;
};

}  // namespace

std::vector<Pattern> compact(const Circuit& circuit, std::vector<Pattern> patterns,
                             const std::vector<Fault>& faults, std::uint64_t seed, unsigned passes,
                             const Progress& progress) {
  std::mt19937_64 random(seed);
  ParallelFaultSimulator simulator(circuit);
  for (unsigned pass = 0; pass < passes; ++pass) {
    std::vector<std::size_t> order(patterns.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::reverse(order.begin(), order.end());
    if (pass > 0) std::shuffle(order.begin(), order.end(), random);
    std::vector<Pattern> ordered;
    for (const std::size_t i : order) ordered.push_back(patterns[i]);
    std::vector<std::uint8_t> keep(patterns.size(), 0), seen(faults.size(), 0);
    std::vector<std::uint32_t> open = every(faults.size());
    std::size_t first = 0;
    for (const PatternBlock& block : blocks_of(ordered, circuit.inputs().size())) {
      tell(progress, "dropping", pass * patterns.size() + first, passes * patterns.size());
      simulator.detect(block, faults, open, [&](std::uint32_t i, const Word& detecting) {
        keep[order[first + detecting.first()]] = 1;
        seen[i] = 1;
      });
      std::erase_if(open, [&](std::uint32_t i) { return seen[i] != 0; });
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
  if (circuit.inputs().empty()) throw UserError("circuit: found no input and no flop, expected some to set");
  return Generator(circuit, std::move(faults), options).run();
}

}  // namespace meltstage::dft
