// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/functional.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <numeric>
#include <random>
#include <span>
#include <thread>
#include <utility>

#include "asic/dft/core/machines.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

namespace {

constexpr std::size_t kMachines = kLanes - 1;  // faulty ones
// Batches at work together: their undetected faults are put into fewer batches as the others are detected.
constexpr std::size_t kBatches = 16;
constexpr std::uint64_t kFirstStage = 1 << 16, kLongestStage = 1 << 20;  // cycles between two looks at that
// A few machines that run wild without a sign at the outputs would cost more than all others. In the longest
// stages one cycle in kCountEvery is looked at; the wildest are set aside, until what remains changes no more
// than kOwnChanges lines a cycle. They begin again with the next reset.
constexpr std::uint64_t kCountEvery = 61;
constexpr double kOwnChanges = 15;

std::size_t signal_of(const CycleStream& stream, const std::string& name, bool input) {
  std::size_t s = 0;
  while (s < stream.signals.size() && (stream.signals[s].name != name || stream.signals[s].is_input != input))
    ++s;
  return s;
}

// A stream as the ports of a netlist see it.
class Vectors {
 public:
  struct Strobe {
    std::size_t signal, port;
  };

  Vectors(const CaptureView& view, const CycleStream& stream) : view_(view), stream_(stream) {
    require_runnable(stream);
    require_clocks(view, stream);
    for (const std::string& port : view.input_ports) {
      drivers_.push_back(signal_of(stream, port, true));
      const bool of_test = port.starts_with("test_mode") || port.starts_with("scan_");
      if (drivers_.back() == stream.signals.size() && !of_test)
        throw UserError(fmt::format("{}: found no input signal {}, expected every input port of the netlist",
                                    stream.title, port));
    }
    for (std::size_t i = 0; i < view.output_ports.size(); ++i) {
      const std::size_t s = signal_of(stream, view.output_ports[i], false);
      if (s < stream.signals.size()) strobes_.push_back({s, i});
    }
    const auto named = static_cast<std::size_t>(std::count_if(
        stream.signals.begin(), stream.signals.end(), [](const TestSignal& s) { return !s.is_input; }));
    if (strobes_.size() != named)
      throw UserError(fmt::format("{}: found {} output signals that the netlist has, expected all {}",
                                  stream.title, strobes_.size(), named));
  }

  const std::vector<TestCycle>& cycles() const { return stream_.cycles; }
  const std::vector<Strobe>& strobes() const { return strobes_; }
  const std::string& name(const Strobe& strobe) const { return stream_.signals[strobe.signal].name; }
  std::uint8_t input(std::size_t entry, std::size_t port) const { return state(entry, port) == '1' ? 1 : 0; }
  /// By input port.
  std::vector<std::uint8_t> inputs(std::size_t entry) const {
    std::vector<std::uint8_t> levels(drivers_.size());
    for (std::size_t i = 0; i < levels.size(); ++i) levels[i] = input(entry, i);
    return levels;
  }
  /// Whether a port of the netlist is open: neither a level nor a pulse.
  bool leaves_open(std::size_t entry) const {
    for (std::size_t i = 0; i < drivers_.size(); ++i)
      if (is_open(entry, i)) return true;
    return false;
  }
  /// By input port, with what `fill` gives where the entry leaves one open.
  std::vector<Word> inputs(std::size_t entry, const std::function<Word()>& fill) const {
    std::vector<Word> levels(drivers_.size());
    for (std::size_t i = 0; i < levels.size(); ++i) {
      if (is_open(entry, i))
        levels[i] = fill();
      else if (input(entry, i) != 0)
        levels[i].part.fill(~std::uint64_t{0});
    }
    return levels;
  }
  bool clocks(std::size_t entry) const {
    for (std::size_t i = 0; i < drivers_.size(); ++i) {
      if (view_.clock_ports[i] != 0 && state(entry, i) == 'P') return true;
    }
    return false;
  }

 private:
  bool is_open(std::size_t entry, std::size_t port) const { return is_open_input(state(entry, port)); }
  char state(std::size_t entry, std::size_t port) const {
    return drivers_[port] < stream_.signals.size() ? stream_.cycles[entry].states[drivers_[port]] : '0';
  }

  const CaptureView& view_;
  const CycleStream& stream_;
  std::vector<std::size_t> drivers_;  // by input port, the signal; the number of signals where none is
  std::vector<Strobe> strobes_;
};

// A place in the vectors.
struct Place {
  std::size_t entry = 0;
  std::uint64_t within = 0, cycle = 0;  // cycles of the entry, of all
};

// Machines and the faults they have.
struct Batch {
  Machines machines;
  std::vector<std::size_t> faults;  // of machine i + 1
  std::string wrong;                // the first strobe that the good machine fails
};

// In which machines a strobe of the cycle fails.
Word failing(Batch& batch, const Vectors& vectors, const Place& place) {
  const std::string& states = vectors.cycles()[place.entry].states;
  Word all, found;
  all.part.fill(~std::uint64_t{0});
  for (const Vectors::Strobe& strobe : vectors.strobes()) {
    const char expected = states[strobe.signal];
    if (expected != 'H' && expected != 'L') continue;
    const Word wrong = batch.machines.unlike(strobe.port, expected == 'H', all);
    if (wrong.bit(0) && batch.wrong.empty())
      batch.wrong = fmt::format("cycle {}: {}: found {}, expected {}", place.cycle, vectors.name(strobe),
                                expected == 'H' ? 0 : 1, expected);
    for (std::size_t i = 0; i < found.part.size(); ++i) found.part[i] |= wrong.part[i];
  }
  return found;
}

// So many cycles from a place on, or to the end.
void run(Batch& batch, const Vectors& vectors, Place place, std::uint64_t cycles,
         std::vector<std::uint64_t>& first_cycle) {
  constexpr std::uint64_t kDropEvery = 64;  // cycles; dropping goes over all lines
  Machines& m = batch.machines;
  Word gone;
  bool fresh = false;
  for (; place.entry < vectors.cycles().size() && cycles != 0; ++place.entry, place.within = 0) {
    if (place.within == 0) m.set_inputs(vectors.inputs(place.entry));
    const std::uint64_t count = vectors.cycles()[place.entry].count;
    const bool clocks = vectors.clocks(place.entry);
    bool look = true;  // other strobes
    for (; place.within < count && cycles != 0; ++place.within, ++place.cycle, --cycles) {
      m.count_own_changes(place.cycle % kCountEvery == 0);
      if (m.ports_changed() || look) {
        const Word fails = failing(batch, vectors, place);
        for (std::size_t k = 0; k < batch.faults.size() && fails.any(); ++k) {
          std::uint64_t& first = first_cycle[batch.faults[k]];
          if (!fails.bit(k + 1) || first != FunctionalGrade::kUndetected) continue;
          first = place.cycle;
          gone.set(k + 1, true);
          fresh = true;
        }
      }
      look = false;
      if (clocks) m.clock();
      if (fresh && place.cycle % kDropEvery == 0) {
        m.drop(gone);
        fresh = false;
      }
    }
    if (place.within < count) break;
  }
  m.drop(gone);
}

Place after(const Vectors& vectors, Place place, std::uint64_t cycles) {
  while (place.entry < vectors.cycles().size() && cycles != 0) {
    const std::uint64_t left = vectors.cycles()[place.entry].count - place.within,
                        part = std::min(left, cycles);
    cycles -= part;
    place.cycle += part;
    place.within += part;
    if (part == left) {
      ++place.entry;
      place.within = 0;
    }
  }
  return place;
}

// One machine that goes on in another batch; without a lane, as the good machine stands.
struct Move {
  std::size_t fault;
  const Machines* from;
  std::size_t lane;
};

Batch moved(const CaptureView& view, const std::vector<Fault>& faults, std::span<const Move> moves,
            std::span<const std::uint8_t> inputs) {
  std::vector<Fault> own;
  std::vector<std::size_t> indices;
  for (const Move& move : moves) {
    own.push_back(faults[move.fault]);
    indices.push_back(move.fault);
  }
  Batch batch{Machines(view, own), std::move(indices), {}};
  for (std::size_t k = 0; k < batch.machines.flops(); ++k) {
    Word& state = batch.machines.state(k);
    if (moves[0].from->state(k).bit(0)) state.part.fill(~std::uint64_t{0});
    for (std::size_t i = 0; i < moves.size(); ++i)
      state.set(i + 1, moves[i].from->state(k).bit(moves[i].lane));
  }
  batch.machines.preset_inputs(inputs);
  batch.machines.start();
  return batch;
}

// Machines that go on: the undetected ones, less those that are to be set aside.
std::vector<Move> remaining(const std::vector<Batch>& batches, const std::vector<std::uint64_t>& first_cycle,
                            std::vector<std::size_t>& aside) {
  std::vector<Move> moves;
  for (const Batch& batch : batches) {
    for (std::size_t i = 0; i < batch.faults.size(); ++i) {
      const std::size_t fault = batch.faults[i];
      if (first_cycle[fault] == FunctionalGrade::kUndetected &&
          std::find(aside.begin(), aside.end(), fault) == aside.end())
        moves.push_back({fault, &batch.machines, i + 1});
    }
  }
  return moves;
}

// Faults whose machines ran wildest in the stage that ends.
void set_aside(std::vector<Batch>& batches, const std::vector<std::uint64_t>& first_cycle,
               std::uint64_t stage, std::vector<std::size_t>& aside) {
  for (Batch& batch : batches) {
    std::vector<std::pair<std::uint64_t, std::size_t>> changes;
    double all = 0;
    const double most = kOwnChanges * static_cast<double>(stage) / static_cast<double>(kCountEvery);
    for (std::size_t i = 0; i < batch.faults.size(); ++i) {
      if (first_cycle[batch.faults[i]] != FunctionalGrade::kUndetected) continue;
      changes.emplace_back(batch.machines.own_changes()[i + 1], batch.faults[i]);
      all += static_cast<double>(changes.back().first);
    }
    batch.machines.own_changes() = {};
    std::sort(changes.rbegin(), changes.rend());
    for (std::size_t i = 0; i < changes.size() && all > most; ++i) {
      all -= static_cast<double>(changes[i].first);
      aside.push_back(changes[i].second);
    }
  }
}

// The machines that go on, in as few batches as hold them. `always`: even if they are no fewer.
void compact(const CaptureView& view, const std::vector<Fault>& faults, std::span<const Move> moves,
             std::span<const std::uint8_t> inputs, bool always, std::vector<Batch>& batches) {
  const std::size_t wanted = (moves.size() + kMachines - 1) / kMachines;
  if (moves.empty() || (wanted >= batches.size() && !always)) return;
  std::vector<Batch> fewer;
  for (std::size_t first = 0; first < moves.size(); first += kMachines)
    fewer.push_back(
        moved(view, faults, moves.subspan(first, std::min(kMachines, moves.size() - first)), inputs));
  batches = std::move(fewer);
}

// Cycles in which an input port that resets flops becomes active.
std::vector<std::uint64_t> resets_in(const CaptureView& view, const Vectors& vectors) {
  std::vector<std::pair<std::size_t, std::uint8_t>> ports;  // and the level that resets
  for (const ScanFlop& flop : view.flops) {
    const auto line = flop.has_reset ? view.node_of_net.find(flop.reset) : view.node_of_net.end();
    if (line == view.node_of_net.end()) continue;
    for (std::size_t i = 0; i < view.input_ports.size(); ++i) {
      const std::pair<std::size_t, std::uint8_t> port{i, flop.reset_low ? 0 : 1};
      if (view.circuit.inputs()[i] == line->second &&
          std::find(ports.begin(), ports.end(), port) == ports.end())
        ports.push_back(port);
    }
  }
  std::vector<std::uint64_t> found;
  std::uint64_t cycle = 0;
  for (std::size_t entry = 0; entry < vectors.cycles().size(); cycle += vectors.cycles()[entry++].count) {
    for (const auto& [port, level] : ports) {
      if (entry == 0 || vectors.input(entry, port) != level || vectors.input(entry - 1, port) == level)
        continue;
      found.push_back(cycle);
      break;
    }
  }
  return found;
}

// Lines of the good machine that rose, fell.
void note_toggles(const CaptureView& view, const Machines& machines, std::vector<std::uint8_t>& moves) {
  for (const Site& site : view.circuit.sites()) {
    if (site.node != kNoNode && site.pin == kStem) moves[site.node] |= machines.moves(site.node);
  }
}

ToggleCoverage toggle_coverage(const Circuit& circuit, const std::vector<std::uint8_t>& moves) {
  const std::vector<std::int8_t> constant =
      constants(circuit, std::vector<std::int8_t>(circuit.inputs().size(), -1));
  ToggleCoverage result;
  for (std::size_t i = 0; i < circuit.sites().size(); ++i) {
    const Site& site = circuit.sites()[i];
    if (site.node == kNoNode || site.pin != kStem) continue;
    if (constant[site.node] >= 0) {
      ++result.tied;
      continue;
    }
    ++result.lines;
    if (moves[site.node] == (Machines::kRose | Machines::kFell))
      result.moving.push_back(site.node);
    else
      result.idle.push_back(i);
  }
  result.toggled = result.moving.size();
  return result;
}

}  // namespace

std::size_t FunctionalGrade::detected() const {
  return first_cycle.size() -
         static_cast<std::size_t>(std::count(first_cycle.begin(), first_cycle.end(), kUndetected));
}

FunctionalGrade grade_functional(const CaptureView& view, const CycleStream& stream,
                                 const std::vector<Fault>& faults, unsigned threads, PowerUp power_up,
                                 const Progress& progress) {
  const Vectors vectors(view, stream);
  const std::size_t entries = stream.cycles.size();
  FunctionalGrade grade;
  grade.first_cycle.assign(faults.size(), FunctionalGrade::kUndetected);
  grade.cycles = cycle_count(stream);
  std::vector<std::uint8_t> toggles(view.circuit.size(), 0);
  const std::vector<std::uint64_t> resets = resets_in(view, vectors);
  for (std::size_t first = 0; first == 0 || first < faults.size(); first += kBatches * kMachines) {
    std::vector<Batch> batches;
    for (std::size_t at = first; at == first || (at < faults.size() && batches.size() < kBatches);
         at += kMachines) {
      std::vector<std::size_t> indices(std::min(kMachines, faults.size() - at));
      std::iota(indices.begin(), indices.end(), at);
      batches.push_back(
          {Machines(view, std::span(faults).subspan(at, indices.size())), std::move(indices), {}});
      Machines& m = batches.back().machines;
      for (std::size_t k = 0; power_up == PowerUp::ones && k < m.flops(); ++k)
        m.state(k).part.fill(~std::uint64_t{0});
      if (entries != 0) m.preset_inputs(vectors.inputs(0));
      m.start();
    }
    std::vector<std::size_t> aside;
    std::uint64_t length = kFirstStage;
    for (Place place; place.entry < entries;) {
      // To the next reset at the most.
      const auto reset = std::upper_bound(resets.begin(), resets.end(), place.cycle);
      const std::uint64_t stage = reset == resets.end() ? length : std::min(length, *reset - place.cycle);
      std::atomic<std::size_t> next{0};
      const auto work = [&] {
        for (std::size_t b = next++; b < batches.size(); b = next++)
          run(batches[b], vectors, place, stage, grade.first_cycle);
      };
      {
        std::vector<std::jthread> pool;
        for (unsigned i = 1; i < std::min<std::size_t>(threads, batches.size()); ++i) pool.emplace_back(work);
        work();
      }
      note_toggles(view, batches[0].machines, toggles);
      if (grade.wrong.empty()) grade.wrong = batches[0].wrong;
      place = after(vectors, place, stage);
      if (place.entry < entries) {
        const bool in_reset = std::binary_search(resets.begin(), resets.end(), place.cycle);
        const std::size_t known = aside.size();
        if (stage == kLongestStage) set_aside(batches, grade.first_cycle, stage, aside);
        std::vector<Move> moves = remaining(batches, grade.first_cycle, aside);
        const bool changed = known != aside.size() || (in_reset && !aside.empty());
        for (const std::size_t fault : aside) {
          if (in_reset) moves.push_back({fault, &batches[0].machines, 0});
        }
        if (in_reset) aside.clear();
        compact(view, faults, moves, vectors.inputs(place.within != 0 ? place.entry : place.entry - 1),
                changed, batches);
      }
      length = std::min(2 * length, kLongestStage);
      const std::size_t in_round =
          std::min(kBatches * kMachines, std::max<std::size_t>(faults.size() - first, 1));
      tell(progress, "grading", first * grade.cycles + in_round * place.cycle,
           std::max<std::size_t>(faults.size(), 1) * grade.cycles);
    }
    grade.set_aside += aside.size();
  }
  grade.toggle = toggle_coverage(view.circuit, toggles);
  return grade;
}

namespace {

// Mismatches of a cycle, over all fillings.
struct Comparison {
  std::size_t strobes = 0, mismatches = 0;
  std::string first;
};

void check(const Machines& m, const Word& used, const Vectors& vectors, const std::string& states,
           Comparison& result) {
  result = {};
  for (const Vectors::Strobe& output : vectors.strobes()) {
    const char c = states[output.signal];
    if (c != 'H' && c != 'L') continue;
    ++result.strobes;
    const Word wrong = m.unlike(output.port, c == 'H', used);
    if (!wrong.any()) continue;
    ++result.mismatches;
    if (result.first.empty())
      result.first = fmt::format("{}: found {}, expected {} (filling {} of what is unknown)",
                                 vectors.name(output), c == 'H' ? 0 : 1, c, wrong.first());
  }
}

}  // namespace

ReplayResult replay_cycles(const CaptureView& view, const CycleStream& stream, unsigned random_fillings,
                           std::uint64_t seed, const Progress& progress) {
  const Vectors vectors(view, stream);
  Machines m(view, {});
  Word used;
  const std::size_t machines = std::min<std::size_t>(2 + random_fillings, kLanes);
  for (std::size_t lane = 0; lane < machines; ++lane) used.set(lane, true);
  std::mt19937_64 random(seed);
  const auto unknown = [&] {
    Word word;
    word.set(1, true);
    for (std::size_t lane = 2; lane < machines; ++lane) word.set(lane, (random() & 1) != 0);
    return word;
  };
  for (std::size_t k = 0; k < m.flops(); ++k) m.state(k) = unknown();
  if (!stream.cycles.empty()) m.preset_inputs(vectors.inputs(0, unknown));
  m.start();
  ReplayResult result;
  Comparison now;
  const std::uint64_t total = cycle_count(stream);
  for (std::size_t entry = 0; entry < stream.cycles.size(); ++entry) {
    const TestCycle& cycle = stream.cycles[entry];
    const bool clocks = vectors.clocks(entry), open = vectors.leaves_open(entry);
    if (!open) m.set_inputs(vectors.inputs(entry));
    bool look = true;  // other strobes
    for (std::uint64_t c = 0; c < cycle.count; ++c, ++result.cycles) {
      if (open) m.set_inputs(vectors.inputs(entry, unknown));
      if (m.ports_changed() || look) check(m, used, vectors, cycle.states, now);
      look = false;
      if (result.cycles % kTellEvery == 0) tell(progress, "replay", result.cycles, total);
      result.strobes += now.strobes;
      if (now.mismatches != 0 && result.mismatches == 0)
        result.first = fmt::format("cycle {}: {}", result.cycles, now.first);
      result.mismatches += now.mismatches;
      if (clocks) m.clock();
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
