// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/chain_diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
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

// What came out of a chain: '0', '1', or '?' where it was not compared or not logged.
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
      std::string unload(cells_, '?');
      for (std::size_t j = 0; j < shift.size(); ++j) {
        const char expected = stream.cycles[shift[j]].states[out];
        if ((expected != 'H' && expected != 'L') || shift[j] >= known_to) continue;
        const bool fails = failed.count(shift[j]) != 0;
        const char found = (expected == 'H') != fails ? '1' : '0';
        if (j < cells_) {
          unload[cells_ - 1 - j] = found;
        } else {  // it has gone through the whole chain
          through_ += found;
          is_broken_ = is_broken_ || fails;
        }
      }
      unloads_.push_back(std::move(unload));
    }
  }
  bool is_broken() const { return is_broken_; }

  // Number of cells from the first on of which nothing but `level` was seen.
  std::size_t constant(char level) const {
    if (through_.find(level == '0' ? '1' : '0') != std::string::npos) return 0;
    return cells_before(
        [&](const std::string& unload, std::size_t i) { return unload[i] == '?' || unload[i] == level; });
  }
  // The same of a bit that stands alone: one of `level` between two others.
  std::size_t without_single(char level) const {
    return cells_before([&](const std::string& unload, std::size_t i) {
      if (i < 2) return true;
      const char other = level == '1' ? '0' : '1';
      return !(unload[i - 2] == other && unload[i - 1] == level && unload[i] == other);
    });
  }

 private:
  template <class Holds>
  std::size_t cells_before(const Holds& holds) const {
    for (std::size_t i = 0; i < cells_; ++i)
      if (!std::all_of(unloads_.begin(), unloads_.end(), [&](const std::string& u) { return holds(u, i); }))
        return i;
    return cells_;
  }

  std::size_t cells_;
  std::vector<std::string> unloads_;  // by cell
  std::string through_;
  bool is_broken_ = false;
};

// The drivers of these lines, and on from there what leads nowhere else.
void add_drivers(const Circuit& circuit, std::set<Line>& lines) {
  constexpr std::size_t kMostLines = 300;
  std::vector<Line> open(lines.begin(), lines.end());
  while (!open.empty() && lines.size() < kMostLines) {
    const Node driver = source_of(circuit, open.back());
    const bool is_first = open.back().pin != kStem;
    open.pop_back();
    if (is_first && lines.insert({driver, kStem}).second && circuit.fanout(driver).size() > 1) continue;
    if (circuit.fanout(driver).size() > 1) continue;
    for (std::size_t i = 0; i < circuit.fanin(driver).size(); ++i) {
      const Line input = stem_of(circuit, {driver, static_cast<std::int32_t>(i)});
      if (lines.insert(input).second) open.push_back(input);
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

  // Lines of the logic between cell k - 1 and cell k, k's own reset among them; 0: behind the chain's input,
  // the number of cells: before its output.
  void add_between(std::size_t k, std::set<Line>& lines) const {
    const Circuit& circuit = view_.circuit;
    const Node from =
        k == 0 ? circuit.inputs()[in_] : circuit.inputs()[view_.input_ports.size() + flops_[k - 1]];
    const Node to = k == flops_.size() ? circuit.outputs()[out_]
                                       : circuit.outputs()[view_.output_ports.size() + flops_[k]];
    std::vector<bool> behind(circuit.size(), false), before(circuit.size(), false);
    behind[from] = true;
    for (Node node = from; node <= to; ++node)
      for (const Node next : circuit.fanout(node)) behind[next] = behind[next] || behind[node];
    before[to] = true;
    for (Node node = to + 1; node-- > from;)
      if (before[node])
        for (const Node driver : circuit.fanin(node)) before[driver] = true;
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
      for (const DefectKind kind : kinds) chips.push_back({{{kind, line}}});
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
    if (!readings.is_broken()) continue;
    const std::size_t stuck = std::max(readings.constant('0'), readings.constant('1'));
    const std::size_t slow = std::max(readings.without_single('0'), readings.without_single('1'));
    const std::size_t reach = stuck > 0 ? stuck : slow;
    BrokenChain found{.chain = c, .cell = reach == 0 ? 0 : reach - 1, .suspects = {}};
    const ShiftPath path(view, stream.chains[c]);
    std::set<Line> lines;
    for (std::size_t k = found.cell; k <= std::min(found.cell + 1, stream.chains[c].cells.size()); ++k)
      path.add_between(k, lines);
    const std::vector<DefectKind> kinds =
        stuck > 0 ? std::vector{DefectKind::stuck_at_0, DefectKind::stuck_at_1}
                  : std::vector{DefectKind::slow_to_rise, DefectKind::slow_to_fall};
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
