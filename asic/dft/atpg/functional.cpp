// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/functional.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
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
constexpr std::uint64_t kFirstStage = 1 << 16, kLongestStage = 1 << 20;  // clocks between two looks at that
// A few machines that run wild without a sign at the outputs would cost more than all others. In the longest
// stages one clock in kCountEvery is looked at; the wildest are set aside, until what remains changes no more
// than kOwnChanges lines a clock. They begin again with the next reset.
constexpr std::uint64_t kCountEvery = 61;
constexpr double kOwnChanges = 15;

// A place in the stretches.
struct Place {
  std::size_t stretch = 0;
  std::uint64_t clock_of_stretch = 0, clock = 0;
};

// Machines and the faults they have.
struct Batch {
  Machines machines;
  std::vector<std::size_t> faults;  // of machine i + 1
};

// So many clocks from a place on, or to the end.
void run(Batch& batch, const std::vector<FunctionalStretch>& stretches, Place place, std::uint64_t clocks,
         std::vector<std::uint64_t>& first_clock) {
  constexpr std::uint64_t kDropEvery = 64;  // clocks; dropping goes over all lines
  Machines& m = batch.machines;
  Word gone;
  bool fresh = false;
  for (; place.stretch < stretches.size() && clocks != 0; ++place.stretch, place.clock_of_stretch = 0) {
    const FunctionalStretch& stretch = stretches[place.stretch];
    if (place.clock_of_stretch == 0) m.set_inputs(stretch.inputs);
    for (; place.clock_of_stretch < stretch.clocks && clocks != 0;
         ++place.clock_of_stretch, ++place.clock, --clocks) {
      m.count_own_changes(place.clock % kCountEvery == 0);
      m.clock();
      if (m.ports_changed()) {
        const Word differs = m.different();
        for (std::size_t k = 0; k < batch.faults.size() && differs.any(); ++k) {
          std::uint64_t& first = first_clock[batch.faults[k]];
          if (!differs.bit(k + 1) || first != FunctionalGrade::kUndetected) continue;
          first = place.clock;
          gone.set(k + 1, true);
          fresh = true;
        }
      }
      if (fresh && place.clock % kDropEvery == 0) {
        m.drop(gone);
        fresh = false;
      }
    }
    if (place.clock_of_stretch < stretch.clocks) break;
  }
  m.drop(gone);
}

Place after(const std::vector<FunctionalStretch>& stretches, Place place, std::uint64_t clocks) {
  while (place.stretch < stretches.size() && clocks != 0) {
    const std::uint64_t left = stretches[place.stretch].clocks - place.clock_of_stretch,
                        part = std::min(left, clocks);
    clocks -= part;
    place.clock += part;
    place.clock_of_stretch += part;
    if (part == left) {
      ++place.stretch;
      place.clock_of_stretch = 0;
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
  Batch batch{Machines(view, own), std::move(indices)};
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
std::vector<Move> remaining(const std::vector<Batch>& batches, const std::vector<std::uint64_t>& first_clock,
                            std::vector<std::size_t>& aside) {
  std::vector<Move> moves;
  for (const Batch& batch : batches) {
    for (std::size_t i = 0; i < batch.faults.size(); ++i) {
      const std::size_t fault = batch.faults[i];
      if (first_clock[fault] == FunctionalGrade::kUndetected &&
          std::find(aside.begin(), aside.end(), fault) == aside.end())
        moves.push_back({fault, &batch.machines, i + 1});
    }
  }
  return moves;
}

// Faults whose machines ran wildest in the stage that ends.
void set_aside(std::vector<Batch>& batches, const std::vector<std::uint64_t>& first_clock,
               std::uint64_t stage, std::vector<std::size_t>& aside) {
  for (Batch& batch : batches) {
    std::vector<std::pair<std::uint64_t, std::size_t>> changes;
    double all = 0;
    const double most = kOwnChanges * static_cast<double>(stage) / static_cast<double>(kCountEvery);
    for (std::size_t i = 0; i < batch.faults.size(); ++i) {
      if (first_clock[batch.faults[i]] != FunctionalGrade::kUndetected) continue;
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

// Stretches in which an input port that resets flops becomes active.
std::vector<std::size_t> resets_in(const CaptureView& view, const std::vector<FunctionalStretch>& stretches) {
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
  std::vector<std::size_t> found;
  for (std::size_t s = 1; s < stretches.size(); ++s) {
    for (const auto& [port, level] : ports) {
      if (stretches[s].inputs[port] != level || stretches[s - 1].inputs[port] == level) continue;
      found.push_back(s);
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
  return first_clock.size() -
         static_cast<std::size_t>(std::count(first_clock.begin(), first_clock.end(), kUndetected));
}

FunctionalGrade grade_functional(const CaptureView& view, const std::vector<FunctionalStretch>& stretches,
                                 const std::vector<Fault>& faults, unsigned threads, PowerUp power_up,
                                 const Progress& progress) {
  FunctionalGrade grade;
  grade.first_clock.assign(faults.size(), FunctionalGrade::kUndetected);
  for (const FunctionalStretch& stretch : stretches) grade.clocks += stretch.clocks;
  std::vector<std::uint8_t> toggles(view.circuit.size(), 0);
  std::vector<std::uint64_t> resets;  // clocks
  {
    std::vector<std::uint64_t> begins{0};
    for (const FunctionalStretch& stretch : stretches) begins.push_back(begins.back() + stretch.clocks);
    for (const std::size_t s : resets_in(view, stretches)) resets.push_back(begins[s]);
  }
  for (std::size_t first = 0; first == 0 || first < faults.size(); first += kBatches * kMachines) {
    std::vector<Batch> batches;
    for (std::size_t at = first; at == first || (at < faults.size() && batches.size() < kBatches);
         at += kMachines) {
      std::vector<std::size_t> indices(std::min(kMachines, faults.size() - at));
      std::iota(indices.begin(), indices.end(), at);
      batches.push_back({Machines(view, std::span(faults).subspan(at, indices.size())), std::move(indices)});
      Machines& m = batches.back().machines;
      for (std::size_t k = 0; power_up == PowerUp::ones && k < m.flops(); ++k)
        m.state(k).part.fill(~std::uint64_t{0});
      m.start();
    }
    std::vector<std::size_t> aside;
    std::uint64_t length = kFirstStage;
    for (Place place; place.stretch < stretches.size();) {
      // To the next reset at the most.
      const auto reset = std::upper_bound(resets.begin(), resets.end(), place.clock);
      const std::uint64_t stage = reset == resets.end() ? length : std::min(length, *reset - place.clock);
      std::atomic<std::size_t> next{0};
      const auto work = [&] {
        for (std::size_t b = next++; b < batches.size(); b = next++)
          run(batches[b], stretches, place, stage, grade.first_clock);
      };
      {
        std::vector<std::jthread> pool;
        for (unsigned i = 1; i < std::min<std::size_t>(threads, batches.size()); ++i) pool.emplace_back(work);
        work();
      }
      note_toggles(view, batches[0].machines, toggles);
      place = after(stretches, place, stage);
      if (place.stretch < stretches.size()) {
        const bool in_reset = std::binary_search(resets.begin(), resets.end(), place.clock);
        const std::size_t known = aside.size();
        if (stage == kLongestStage) set_aside(batches, grade.first_clock, stage, aside);
        std::vector<Move> moves = remaining(batches, grade.first_clock, aside);
        const bool changed = known != aside.size() || (in_reset && !aside.empty());
        for (const std::size_t fault : aside) {
          if (in_reset) moves.push_back({fault, &batches[0].machines, 0});
        }
        if (in_reset) aside.clear();
        compact(view, faults, moves,
                stretches[place.clock_of_stretch != 0 ? place.stretch : place.stretch - 1].inputs, changed,
                batches);
      }
      length = std::min(2 * length, kLongestStage);
      const std::size_t in_round =
          std::min(kBatches * kMachines, std::max<std::size_t>(faults.size() - first, 1));
      tell(progress, "grading", first * grade.clocks + in_round * place.clock,
           std::max<std::size_t>(faults.size(), 1) * grade.clocks);
    }
    grade.set_aside += aside.size();
  }
  grade.toggle = toggle_coverage(view.circuit, toggles);
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
      throw UserError(fmt::format("{}: found no input signal {}, expected every input port of the netlist",
                                  stream.title, port));
  }
  return signals;
}

struct Expected {
  std::size_t signal, port;
};

// Mismatches of a cycle, over all power-up states.
struct Comparison {
  std::size_t strobes = 0, mismatches = 0;
  std::string first;
};

void check(const Machines& m, const Word& used, const std::vector<Expected>& outputs,
           const std::string& states, const CycleStream& stream, Comparison& result) {
  result = {};
  for (const Expected& output : outputs) {
    const char c = states[output.signal];
    if (c != 'H' && c != 'L') continue;
    ++result.strobes;
    const Word wrong = m.unlike(output.port, c == 'H', used);
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
                           std::uint64_t seed, const Progress& progress) {
  const std::vector<std::size_t> signals = drivers(view, stream);
  std::vector<Expected> outputs;
  for (std::size_t i = 0; i < view.output_ports.size(); ++i) {
    const std::size_t s = signal_of(stream, view.output_ports[i], false);
    if (s < stream.signals.size()) outputs.push_back({s, i});
  }
  const auto named = static_cast<std::size_t>(std::count_if(stream.signals.begin(), stream.signals.end(),
                                                            [](const TestSignal& s) { return !s.is_input; }));
  if (outputs.size() != named)
    throw UserError(fmt::format("{}: found {} output signals that the netlist has, expected all {}",
                                stream.title, outputs.size(), named));
  Machines m(view, {});
  Word used;
  const std::size_t machines = std::min<std::size_t>(2 + random_power_ups, kLanes);
  for (std::size_t lane = 0; lane < machines; ++lane) used.set(lane, true);
  std::mt19937_64 random(seed);
  for (std::size_t k = 0; k < m.flops(); ++k) {
    m.state(k).set(1, true);
    for (std::size_t lane = 2; lane < machines; ++lane) m.state(k).set(lane, (random() & 1) != 0);
  }
  m.start();
  ReplayResult result;
  Comparison now;
  std::vector<std::uint8_t> inputs(signals.size());
  const std::uint64_t total = cycle_count(stream);
  for (const TestCycle& cycle : stream.cycles) {
    bool clocked = false;
    for (std::size_t i = 0; i < signals.size(); ++i) {
      const char c = signals[i] < stream.signals.size() ? cycle.states[signals[i]] : '0';
      inputs[i] = c == '1' ? 1 : 0;
      clocked = clocked || c == 'P';
    }
    m.set_inputs(inputs);
    bool look = true;  // other strobes
    for (std::uint64_t c = 0; c < cycle.count; ++c, ++result.cycles) {
      if (m.ports_changed() || look) check(m, used, outputs, cycle.states, stream, now);
      look = false;
      if (result.cycles % kTellEvery == 0) tell(progress, "replay", result.cycles, total);
      result.strobes += now.strobes;
      if (now.mismatches != 0 && result.mismatches == 0)
        result.first = fmt::format("cycle {}: {}", result.cycles, now.first);
      result.mismatches += now.mismatches;
      if (clocked) m.clock();
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
