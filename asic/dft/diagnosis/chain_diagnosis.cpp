// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/chain_diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "asic/dft/core/patterns.hpp"
#include "asic/dft/diagnosis/tester.hpp"
#include "base/error.hpp"

namespace meltstage::dft {
namespace {

std::size_t signal_of(const CycleStream& stream, const std::string& name, bool input) {
  const auto found = std::find(stream.signals.begin(), stream.signals.end(), TestSignal{name, input});
  if (found == stream.signals.end())
    throw UserError(fmt::format(
        "{}: found no signal {}, expected the scan enable and the ports of every chain", stream.title, name));
  return static_cast<std::size_t>(found - stream.signals.begin());
}

// Clocks with the scan enable on, without a break; cycles.
using Shift = std::vector<std::size_t>;

std::vector<Shift> shifts_of(const CycleStream& stream, std::size_t enable) {
  std::vector<Shift> shifts;
  bool shifting = false;
  for (std::size_t i = 0; i < stream.cycles.size(); ++i) {
    const std::string& states = stream.cycles[i].states;
    if (states[enable] == '1' && !shifting) shifts.emplace_back();
    shifting = states[enable] == '1';
    if (shifting && states.find('P') != std::string::npos) shifts.back().push_back(i);
  }
  return shifts;
}

// What a chain does to that which is shifted through it.
enum class Damage { none, stuck, slow, garbled };

// What came out of a chain, as far as it was compared and logged.
class Readings {
 public:
  Readings(const CycleStream& stream, const std::vector<Shift>& shifts, const ScanChain& chain,
           const FailLog& log)
      : cells_(chain.cells.size()) {
    const std::size_t out = signal_of(stream, chain.out, false);
    std::set<std::uint64_t> failed;
    for (const FailedStrobe& fail : log.fails)
      if (fail.signal == out) failed.insert(fail.cycle);
    const std::uint64_t known_to =
        log.truncated && !log.fails.empty() ? log.fails.back().cycle : ~std::uint64_t{0};
    for (const Shift& shift : shifts) {
      for (std::size_t j = 0; j < shift.size(); ++j) {
        const char expected = stream.cycles[shift[j]].states[out];
        const bool fails = failed.count(shift[j]) != 0, level = (expected == 'H') != fails;
        if ((expected != 'H' && expected != 'L') || (shift[j] >= known_to && !fails)) continue;
        if (j >= cells_) {
          through_.push_back({expected == 'H', level, j == cells_});
          continue;
        }
        Cell& cell = of_cell_[cells_ - 1 - j];
        ++(fails ? cell.failed : cell.met);
        cell.seen[level ? 1 : 0] = true;
      }
    }
  }

  // By what has gone through the whole chain, such as the bits of a chain test. A slow cell spoils edges of
  // one direction alone, and not those before which the chain stood still for a cycle.
  Damage damage() const {
    bool fails = false, low = false, high = false, slow_up = true, slow_down = true;
    for (std::size_t i = 0; i < through_.size(); ++i) {
      const auto [expected, level, first] = through_[i];
      (level ? high : low) = true;
      if (expected == level) continue;
      fails = true;
      const bool edge = first || i == 0 || through_[i - 1].expected != expected;
      slow_up = slow_up && edge && expected;
      slow_down = slow_down && edge && !expected;
    }
    if (!fails) return Damage::none;
    return low != high ? Damage::stuck : slow_up || slow_down ? Damage::slow : Damage::garbled;
  }

  // Cells from the first on of which one level alone was seen. A stuck one is among them, the last where
  // those behind it have captured both levels.
  std::size_t constant_cells() const {
    std::size_t most = 0;
    for (const int level : {0, 1}) {
      std::size_t i = 0;
      while (i < cells_ && !of_cell_[i].seen[1 - level]) ++i;
      most = std::max(most, i);
    }
    return most;
  }

  // The cell behind which strobes fail at another rate than before it: most likely so, with one rate on each
  // side.
  std::size_t change_of_rate() const {
    Cell all, before;
    for (const Cell& cell : of_cell_) {
      all.failed += cell.failed;
      all.met += cell.met;
    }
    std::size_t best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < cells_; ++i) {
      before.failed += of_cell_[i].failed;
      before.met += of_cell_[i].met;
      const double likelihood = log_likelihood(before.failed, before.met) +
                                log_likelihood(all.failed - before.failed, all.met - before.met);
      if (likelihood <= most) continue;
      most = likelihood;
      best = i;
    }
    return best;
  }

 private:
  struct Cell {
    std::size_t failed = 0, met = 0;
    std::array<bool, 2> seen{};
  };
  struct Bit {
    bool expected, level;
    bool first;  // in its shift: what went before it is not known
  };
  static double log_likelihood(std::size_t failed, std::size_t met) {
    const auto part = [&](std::size_t n) {
      return n == 0 ? 0.0
                    : static_cast<double>(n) *
                          std::log(static_cast<double>(n) / static_cast<double>(failed + met));
    };
    return part(failed) + part(met);
  }

  std::size_t cells_;
  std::vector<Cell> of_cell_ = std::vector<Cell>(cells_);
  std::vector<Bit> through_;
};

// The drivers of these lines, and on from there what leads nowhere else.
void add_drivers(const Circuit& circuit, std::set<Line>& lines) {
  constexpr std::size_t kMostLines = 300;
  std::vector<Line> open(lines.begin(), lines.end());
  while (!open.empty() && lines.size() < kMostLines) {
    const Node driver = source_of(circuit, open.back());
    const bool is_first = open.back().pin != kStem;
    open.pop_back();
    if (is_first) lines.insert({driver, kStem});
    const bool branches = circuit.fanout(driver).size() > 1;  // its inputs are the last that are looked at
    if (branches && !is_first) continue;
    for (std::size_t i = 0; i < circuit.fanin(driver).size(); ++i) {
      const Line input = stem_of(circuit, {driver, static_cast<std::int32_t>(i)});
      if (lines.insert(input).second && !branches) open.push_back(input);
    }
  }
}

// Lines by which cells of a chain hang together.
class ShiftPath {
 public:
  ShiftPath(const CaptureView& view, const ScanChain& chain) : view_(view) {
    std::unordered_map<std::string, std::size_t> flop;
    for (std::size_t f = 0; f < view.flops.size(); ++f) flop[view.flops[f].name] = f;
    for (const std::string& cell : chain.cells) {
      const auto found = flop.find(cell);
      if (found == flop.end())
        throw UserError(
            fmt::format("chain {}: found cell {}, expected a flop of the netlist", chain.name, cell));
      flops_.push_back(found->second);
    }
    const auto& inputs = view.input_ports;
    const auto& outputs = view.output_ports;
    in_ = static_cast<std::size_t>(std::find(inputs.begin(), inputs.end(), chain.in) - inputs.begin());
    out_ = static_cast<std::size_t>(std::find(outputs.begin(), outputs.end(), chain.out) - outputs.begin());
  }

  // Where the way to cell k begins: cell k - 1, or the chain's input.
  Line begin_of(std::size_t k) const {
    const std::size_t input = k == 0 ? in_ : view_.input_ports.size() + flops_[k - 1];
    return {view_.circuit.inputs()[input], kStem};
  }

  // Lines of the logic between cell k - 1 and cell k, k's own reset among them; 0: behind the chain's input,
  // the number of cells: before its output.
  void add_between(std::size_t k, std::set<Line>& lines) const {
    const Circuit& circuit = view_.circuit;
    const Node from = begin_of(k).node;
    const Node to = k == flops_.size() ? circuit.outputs()[out_]
                                       : circuit.outputs()[view_.output_ports.size() + flops_[k]];
    const std::vector<bool> behind = reached_from(circuit, from), before = cone_of(circuit, to);
    for (const Site& site : circuit.sites()) {
      if (site.node == kNoNode) continue;
      // On the way, or an input of a gate on it.
      const bool on_the_way = behind[site.node] && before[site.node];
      const bool is_own_reset = k < flops_.size() && resets_by(view_, flops_[k], site.node, site.pin);
      if (on_the_way || is_own_reset) lines.insert(stem_of(circuit, {site.node, site.pin}));
    }
  }

  // Lines by which cell k is reset.
  void add_reset(std::size_t k, std::set<Line>& lines) const {
    const Circuit& circuit = view_.circuit;
    for (const Site& site : circuit.sites())
      if (site.node != kNoNode && resets_by(view_, flops_[k], site.node, site.pin))
        lines.insert({site.node, site.pin});
    add_drivers(circuit, lines);
  }

 private:
  const CaptureView& view_;
  std::vector<std::size_t> flops_;  // by cell
  std::size_t in_ = 0, out_ = 0;
};

// Failed strobes before a cycle.
std::vector<FailedStrobe> fails_before(const FailLog& log, std::uint64_t cycle) {
  std::vector<FailedStrobe> fails;
  for (const FailedStrobe& fail : log.fails)
    if (fail.cycle < cycle) fails.push_back(fail);
  return fails;
}

// From which agreement on nothing further is tried.
constexpr double kAlike = 0.999;

double agreement(const std::vector<FailedStrobe>& a, const std::vector<FailedStrobe>& b) {
  std::vector<FailedStrobe> both;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  const std::size_t any = a.size() + b.size() - both.size();
  return any == 0 ? 1.0 : static_cast<double>(both.size()) / static_cast<double>(any);
}

// Defects tried on the first loads of a stream.
class Trial {
 public:
  Trial(const CaptureView& view, const CycleStream& stream, std::string scan_enable,
        const std::vector<Shift>& shifts, const FailLog& log)
      : view_(view), beginning_(stream), scan_enable_(std::move(scan_enable)) {
    if (shifts.size() > kLoads) beginning_.cycles.resize(shifts[kLoads - 1].front());
    looked_at_ = beginning_.cycles.size();
    if (log.truncated && !log.fails.empty()) looked_at_ = std::min(looked_at_, log.fails.back().cycle);
    seen_ = fails_before(log, looked_at_);
  }

  std::vector<ChainSuspect> of(const std::set<Line>& lines, const std::vector<DefectKind>& kinds,
                               const Progress& progress) const {
    std::vector<TestedChip> chips;
    for (const Line& line : lines)
      for (const DefectKind kind : kinds)
        if (!is_clock(view_, line)) chips.push_back({{{kind, line}}});
    std::vector<ChainSuspect> suspects;
    for (std::size_t first = 0; first < chips.size(); first += kChips) {
      tell(progress, "trying defects", first, chips.size());
      const std::size_t end = std::min(first + kChips, chips.size());
      const std::vector<TestedChip> tried(chips.begin() + static_cast<std::ptrdiff_t>(first),
                                          chips.begin() + static_cast<std::ptrdiff_t>(end));
      const std::vector<FailLog> logs = test_chips(view_, beginning_, scan_enable_, tried);
      for (std::size_t i = 0; i < tried.size(); ++i)
        suspects.push_back({tried[i].defects[0], agreement(fails_before(logs[i], looked_at_), seen_)});
    }
    std::stable_sort(suspects.begin(), suspects.end(),
                     [](const ChainSuspect& a, const ChainSuspect& b) { return a.agreement > b.agreement; });
    return suspects;
  }

 private:
  // As many loads as 512 lanes hold of so many chips at once.
  static constexpr std::size_t kLoads = 8, kChips = kLanes / kLoads;
  const CaptureView& view_;
  CycleStream beginning_;
  std::string scan_enable_;
  std::uint64_t looked_at_ = 0;
  std::vector<FailedStrobe> seen_;
};

// Ways between two cells, of those before `end`, behind whose first cell a defect fails most as the chip
// does: the nearer a guess, the more alike its log, so in a long chain every sixteenth is tried, then those
// around the best.
std::vector<std::size_t> likely_ways(const ShiftPath& path, std::size_t end,
                                     const std::vector<DefectKind>& kinds, const Trial& trial,
                                     const Progress& progress) {
  constexpr std::size_t kStep = 16, kShort = 64;
  std::vector<std::size_t> best{end - 1};
  for (std::size_t step = end > kShort ? kStep : 1, first = 0, last = end; step != 0;) {
    std::map<Line, std::size_t> way_of;
    std::set<Line> lines;
    for (std::size_t k = first; k < last; k += step) {
      way_of[path.begin_of(k)] = k;
      lines.insert(path.begin_of(k));
    }
    const std::vector<ChainSuspect> suspects = trial.of(lines, kinds, progress);
    if (suspects.empty()) break;  // none is alike at all
    best.clear();
    for (const ChainSuspect& suspect : suspects) {
      const std::size_t way = way_of.at(suspect.defect.line);
      if (suspect.agreement < suspects[0].agreement) break;
      if (std::find(best.begin(), best.end(), way) == best.end()) best.push_back(way);
    }
    first = best[0] - std::min(best[0], kStep);
    last = std::min(best[0] + kStep, end);
    step = step == kStep ? 1 : 0;
  }
  return best;
}

}  // namespace

std::vector<BrokenChain> diagnose_chains(const CaptureView& view, const CycleStream& stream,
                                         const std::string& scan_enable, const FailLog& log,
                                         const Progress& progress) {
  std::vector<BrokenChain> broken;
  if (stream.chains.empty()) return broken;
  const std::vector<Shift> shifts = shifts_of(stream, signal_of(stream, scan_enable, true));
  const Trial trial(view, stream, scan_enable, shifts, log);
  for (std::size_t c = 0; c < stream.chains.size(); ++c) {
    const Readings readings(stream, shifts, stream.chains[c], log);
    const Damage damage = readings.damage();
    if (damage == Damage::none) continue;
    const ShiftPath path(view, stream.chains[c]);
    const std::vector<DefectKind> kinds =
        damage == Damage::slow ? std::vector{DefectKind::slow_to_rise, DefectKind::slow_to_fall}
                               : std::vector{DefectKind::stuck_at_0, DefectKind::stuck_at_1};
    const std::size_t ways = stream.chains[c].cells.size() + 1;  // 0: from the input to the first cell
    std::vector<std::size_t> likely;
    if (damage == Damage::garbled) {
      constexpr std::size_t kAround = 4;
      const std::size_t way = readings.change_of_rate() + 1;
      for (std::size_t k = way - std::min(way, kAround); k < std::min(way + kAround, ways); ++k)
        likely.push_back(k);
    } else {
      const std::size_t end = damage == Damage::stuck ? readings.constant_cells() + 1 : ways;
      likely = likely_ways(path, end, kinds, trial, progress);
    }
    BrokenChain found{.chain = c, .cell = likely[0] == 0 ? 0 : likely[0] - 1, .suspects = {}};
    std::set<Line> lines;
    for (const std::size_t k : likely) {
      if (k > 0) path.add_between(k - 1, lines);
      path.add_between(k, lines);
    }
    found.suspects = trial.of(lines, kinds, progress);
    if (found.suspects.empty() || found.suspects[0].agreement < kAlike) {
      add_drivers(view.circuit, lines);
      found.suspects = trial.of(lines, kinds, progress);
    }
    broken.push_back(std::move(found));
  }
  return broken;
}

std::vector<ChainSuspect> diagnose_resets(const CaptureView& view, const CycleStream& stream,
                                          const std::string& scan_enable, const FailLog& log,
                                          const Progress& progress) {
  const std::vector<Shift> shifts = shifts_of(stream, signal_of(stream, scan_enable, true));
  std::set<FailedStrobe> failed(log.fails.begin(), log.fails.end());
  std::set<Line> lines;
  for (const ScanChain& chain : stream.chains) {
    const std::size_t out = signal_of(stream, chain.out, false);
    const ShiftPath path(view, chain);
    for (const Shift& shift : shifts) {
      for (std::size_t j = 0; j < std::min(shift.size(), chain.cells.size()); ++j)
        if (failed.count({shift[j], out}) != 0) path.add_reset(chain.cells.size() - 1 - j, lines);
    }
  }
  return Trial(view, stream, scan_enable, shifts, log)
      .of(lines, {DefectKind::stuck_at_0, DefectKind::stuck_at_1}, progress);
}

}  // namespace meltstage::dft
