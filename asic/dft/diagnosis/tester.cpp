// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/tester.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <utility>

#include "asic/dft/core/lanes.hpp"
#include "asic/dft/core/patterns.hpp"
#include "asic/dft/scan/replay.hpp"
#include "base/error.hpp"

namespace meltstage::dft {
namespace {

// Cycles that one lane of each chip runs.
struct Stretch {
  std::size_t begin, end;
};

std::vector<Stretch> stretches_of(const CaptureView& view, const CycleStream& stream,
                                  const std::string& scan_enable) {
  const std::size_t total = stream.cycles.size();
  std::vector<Stretch> stretches;
  const auto cut = [&](std::size_t at) {
    const std::size_t begin = stretches.empty() ? 0 : stretches.back().end;
    if (at > begin) stretches.push_back({begin, at});
  };
  if (view.flops.empty()) {
    for (std::size_t i = 0; i < total; ++i) cut(i + 1);
    return stretches;
  }
  const auto enable = static_cast<std::size_t>(
      std::find(stream.signals.begin(), stream.signals.end(), TestSignal{scan_enable, true}) -
      stream.signals.begin());
  if (enable < stream.signals.size()) {
    for (std::size_t i = 1; i < total; ++i) {
      if (stream.cycles[i].states[enable] == '1' && stream.cycles[i - 1].states[enable] != '1') cut(i);
    }
  }
  cut(total);
  return stretches;
}

Lanes blend(const Lanes& mask, const Lanes& where, const Lanes& elsewhere) {
  return (where & mask) | (elsewhere & ~mask);
}

// A defect, and what its line is driven to, was driven to in the cycle before, and is found at.
struct AtWork {
  ChipDefect defect;
  Word chip = {};  // lanes of the chip that has it
  Word driven = {}, before = {};
  Word other_driven = {}, other_before = {};  // of a bridge's second line

  bool is_stem(Node node) const { return defect.line == Line{node, kStem}; }
};

// The level of a bridge's line `own`, as both are driven.
Lanes bridged(DefectKind kind, const Lanes& own, const Lanes& other) {
  switch (kind) {
    case DefectKind::dominated_by:
      return other;
    case DefectKind::wired_and:
      return own & other;
    default:
      return own | other;
  }
}

class Tester {
 public:
  Tester(const CaptureView& view, const CycleStream& stream, const std::string& scan_enable,
         const std::vector<TestedChip>& chips)
      : view_(view),
        circuit_(view.circuit),
        stream_(stream),
        lanes_(kLanes / chips.size()),
        fails_(chips.size()),
        values_(circuit_.size()),
        driven_(circuit_.inputs().size()),
        marked_(circuit_.size(), 0) {
    require_runnable(stream);
    require_clocks(view, stream);
    for (const std::string& name : view.input_ports) input_.push_back(signal(name));
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      if (stream.signals[s].is_input) continue;
      const auto port = std::find(view.output_ports.begin(), view.output_ports.end(), stream.signals[s].name);
      if (port == view.output_ports.end())
        throw UserError(fmt::format("{}: found output signal {}, expected an output port of the netlist",
                                    stream.title, stream.signals[s].name));
      output_.emplace_back(s, circuit_.outputs()[static_cast<std::size_t>(port - view.output_ports.begin())]);
    }
    for (std::size_t c = 0; c < chips.size(); ++c) {
      random_.emplace_back(chips[c].seed);
      for (const ChipDefect& defect : chips[c].defects) {
        require_no_clock(defect);
        require_apart(defect, chips[c].defects);
        AtWork& added = defects_.emplace_back(AtWork{.defect = defect});
        added.chip.set(c * lanes_, lanes_, true);
        marked_[defect.line.node] = 1;
        if (is_bridge(defect.kind)) marked_[defect.other.node] = 1;
      }
    }
    for (std::size_t f = 0; f < view.flops.size(); ++f) {
      const auto node = view.node_of_net.find(view.flops[f].reset);
      reset_node_.push_back(view.flops[f].has_reset && node != view.node_of_net.end() ? node->second
                                                                                      : kNoNode);
      reset_defects_.emplace_back();
      for (const AtWork& defect : defects_)
        if (resets_by(view, f, defect.defect.line.node, defect.defect.line.pin))
          reset_defects_.back().push_back(&defect);
      for (std::size_t c = 0; c < chips.size(); ++c) state(f).set(c * lanes_, (random_[c]() & 1) != 0);
    }
    choose_nodes(scan_enable);
  }

  std::vector<FailLog> run(const std::vector<Stretch>& stretches, const Progress& progress) {
    std::vector<FailLog> logs(fails_.size());
    for (std::size_t first = 0; first < stretches.size(); first += lanes_) {
      tell(progress, "testing", first, stretches.size());
      run_side_by_side(std::span(stretches).subspan(first, std::min(lanes_, stretches.size() - first)));
      for (std::size_t c = 0; c < logs.size(); ++c)
        logs[c].fails.insert(logs[c].fails.end(), fails_[c].begin(), fails_[c].end());
    }
    for (FailLog& log : logs) std::sort(log.fails.begin(), log.fails.end());
    return logs;
  }

 private:
  std::size_t signal(const std::string& name) const {
    const auto found = std::find(stream_.signals.begin(), stream_.signals.end(), TestSignal{name, true});
    if (found == stream_.signals.end())
      throw UserError(fmt::format("{}: found no input signal {}, expected every input port of the netlist",
                                  stream_.title, name));
    return static_cast<std::size_t>(found - stream_.signals.begin());
  }
  Word& state(std::size_t flop) { return driven_[view_.input_ports.size() + flop]; }

  void require_apart(const ChipDefect& defect, const std::vector<ChipDefect>& all) const {
    const auto touches = [&](const ChipDefect& d) {
      return d.line == defect.line || (is_bridge(d.kind) && d.other == defect.line);
    };
    if (std::count_if(all.begin(), all.end(), touches) > 1)
      throw UserError(fmt::format("defect \"{}\": found another defect of the same line, expected one",
                                  defect_name(circuit_, defect)));
  }
  // Clocks have no levels here, only pulses.
  void require_no_clock(const ChipDefect& defect) const {
    if (is_clock(view_, defect.line) || (is_bridge(defect.kind) && is_clock(view_, defect.other)))
      throw UserError(fmt::format("defect \"{}\": found a clock, expected lines that carry data",
                                  defect_name(circuit_, defect)));
  }

  // While a netlist shifts, most of its logic leads nowhere: only what moves the chains and the ports is
  // evaluated then.
  void choose_nodes(const std::string& scan_enable) {
    for (Node node = 0; node < circuit_.size(); ++node) all_nodes_.push_back(node);
    const auto enable = std::find(view_.input_ports.begin(), view_.input_ports.end(), scan_enable);
    if (enable == view_.input_ports.end()) return;
    enable_ = input_[static_cast<std::size_t>(enable - view_.input_ports.begin())];
    const std::vector<std::int8_t> known = constants(circuit_, levels_in_shift(), marked_);
    std::vector<std::uint8_t> needed(circuit_.size(), 0);
    for (const Node node : circuit_.outputs()) needed[node] = 1;
    for (const Node node : reset_node_)
      if (node != kNoNode) needed[node] = 1;
    for (Node node = static_cast<Node>(circuit_.size()); node-- > 0;) {
      if (marked_[node] != 0) needed[node] = 1;
      if (needed[node] == 0) continue;
      if (known[node] >= 0) {
        levels_.emplace_back(node, known[node] != 0);
        continue;
      }
      shift_nodes_.push_back(node);
      const auto fanin = circuit_.fanin(node);
      const bool chooses = circuit_.kind(node) == Gate::mux && known[fanin[2]] >= 0 && marked_[node] == 0;
      for (std::size_t i = 0; i < fanin.size(); ++i)
        if (!chooses || i == 2 || i == static_cast<std::size_t>(known[fanin[2]])) needed[fanin[i]] = 1;
    }
    std::reverse(shift_nodes_.begin(), shift_nodes_.end());
  }
  // By input of the circuit, its level where that is the same in all cycles of a load.
  std::vector<std::int8_t> levels_in_shift() const {
    std::vector<std::int8_t> levels(circuit_.inputs().size(), -1);
    for (std::size_t i = 0; i < input_.size(); ++i) {
      std::set<char> seen;
      for (const TestCycle& cycle : stream_.cycles)
        if (cycle.states[*enable_] == '1') seen.insert(cycle.states[input_[i]]);
      seen.erase('P');  // low where it is looked at
      if (seen.size() > 1 || (seen.size() == 1 && *seen.begin() != '0' && *seen.begin() != '1')) continue;
      levels[i] = !seen.empty() && *seen.begin() == '1' ? 1 : 0;
    }
    return levels;
  }

  // All that goes from one cycle to the next.
  std::vector<Word*> carried() {
    std::vector<Word*> words;
    for (std::size_t f = 0; f < view_.flops.size(); ++f) words.push_back(&state(f));
    for (AtWork& defect : defects_) {
      words.push_back(&defect.before);
      words.push_back(&defect.other_before);
    }
    return words;
  }

  // Of each chip lane k + 1 begins as lane k ends. Its first lane begins as its last lane of the stretches
  // before ended, which stands in its first lane of what is carried; so it does afterwards.
  void run_side_by_side(std::span<const Stretch> stretches) {
    const std::vector<Word*> words = carried();
    std::vector<Word> begin;
    for (const Word* word : words) {
      Word& same = begin.emplace_back();  // a guess for the other lanes
      for (std::size_t c = 0; c < fails_.size(); ++c) same.set(c * lanes_, lanes_, word->bit(c * lanes_));
    }
    for (bool settled = false; !settled;) {
      for (std::size_t i = 0; i < words.size(); ++i) *words[i] = begin[i];
      run_once(stretches);
      settled = true;
      for (std::size_t i = 0; i < words.size(); ++i) {
        Word next = begin[i];
        for (std::size_t c = 0; c < fails_.size(); ++c) {
          for (std::size_t k = 1; k < stretches.size(); ++k)
            next.set(c * lanes_ + k, words[i]->bit(c * lanes_ + k - 1));
        }
        settled = settled && next == begin[i];
        begin[i] = next;
      }
    }
    for (Word* word : words) {
      for (std::size_t c = 0; c < fails_.size(); ++c)
        word->set(c * lanes_, word->bit(c * lanes_ + stretches.size() - 1));
    }
  }

  void run_once(std::span<const Stretch> stretches) {
    for (auto& fails : fails_) fails.clear();
    std::size_t steps = 0;
    for (const Stretch& stretch : stretches) steps = std::max(steps, stretch.end - stretch.begin);
    for (std::size_t t = 0; t < steps; ++t) {
      Word running, clocked;
      drive(stretches, t, running, clocked);
      const bool shifts = all_shift(stretches, t);
      do {
        evaluate(shifts);
      } while (apply_resets(running));  // a flop that is reset may reset others
      compare(stretches, t);
      clock(clocked);
      for (AtWork& defect : defects_) {
        lanes(defect.before) = blend(lanes(running), lanes(defect.driven), lanes(defect.before));
        lanes(defect.other_before) =
            blend(lanes(running), lanes(defect.other_driven), lanes(defect.other_before));
      }
    }
  }

  bool all_shift(std::span<const Stretch> stretches, std::size_t t) const {
    return enable_ && std::all_of(stretches.begin(), stretches.end(), [&](const Stretch& stretch) {
             return stretch.begin + t >= stretch.end ||
                    stream_.cycles[stretch.begin + t].states[*enable_] == '1';
           });
  }
  // Inputs of the t-th cycle of each stretch. A lane that has come to its end stands still.
  void drive(std::span<const Stretch> stretches, std::size_t t, Word& running, Word& clocked) {
    for (std::size_t c = 0; c < fails_.size(); ++c) {
      for (std::size_t k = 0; k < stretches.size(); ++k) {
        const std::size_t lane = c * lanes_ + k;
        const bool runs = stretches[k].begin + t < stretches[k].end;
        if (runs) running.set(lane, true);
        const std::string& states =
            stream_.cycles[std::min(stretches[k].begin + t, stretches[k].end - 1)].states;
        for (std::size_t i = 0; i < input_.size(); ++i) {
          const char level = states[input_[i]];
          if (level == '0' || level == '1' || level == 'P')
            driven_[i].set(lane, level == '1');
          else if (runs)
            driven_[i].set(lane, (random_[c]() & 1) != 0);
          if (level == 'P' && view_.clock_ports[i] != 0 && runs) clocked.set(lane, true);
        }
      }
    }
  }

  // Bridges are seen as their lines were driven in the pass before, until that stays as it is.
  void evaluate(bool shifts) {
    constexpr int kMostPasses = 16;
    for (int pass = 0; pass < kMostPasses; ++pass) {
      if (!changes_bridges(shifts)) return;
    }
    throw UserError(
        "bridges that act on each other: found no levels at which they rest, expected defects "
        "that do");
  }
  bool changes_bridges(bool shifts) {
    std::vector<Word> seen;
    for (const AtWork& defect : defects_) {
      seen.push_back(defect.driven);
      seen.push_back(defect.other_driven);
    }
    for (std::size_t i = 0; i < driven_.size(); ++i) values_[circuit_.inputs()[i]] = driven_[i];
    if (shifts)
      for (const auto& [node, level] : levels_) lanes(values_[node]) = level ? ~Lanes{} : Lanes{};
    for (const Node node : shifts ? shift_nodes_ : all_nodes_) {
      const auto fanin = circuit_.fanin(node);
      dft::evaluate(
          circuit_.kind(node), fanin.size(),
          [&](std::size_t i) -> const Lanes& {
            if (marked_[node] != 0) return input_of(node, i);
            return lanes(values_[fanin[i]]);
          },
          lanes(values_[node]));
      if (marked_[node] != 0) disturb_stem(node);
    }
    for (std::size_t d = 0; d < defects_.size(); ++d) {
      if (is_bridge(defects_[d].defect.kind) &&
          (seen[2 * d] != defects_[d].driven || seen[2 * d + 1] != defects_[d].other_driven))
        return true;
    }
    return false;
  }
  // What a pin sees of its driver.
  const Lanes& input_of(Node node, std::size_t pin) {
    const Word& value = values_[circuit_.fanin(node)[pin]];
    at_pin_ = value;
    for (AtWork& defect : defects_) {
      if (defect.defect.line != Line{node, static_cast<std::int32_t>(pin)}) continue;
      defect.driven = value;
      lanes(at_pin_) = blend(lanes(defect.chip), found(defect), lanes(at_pin_));
    }
    pins_.resize(std::max(pins_.size(), pin + 1));
    pins_[pin] = at_pin_;
    return lanes(pins_[pin]);
  }
  void disturb_stem(Node node) {
    const Word driven = values_[node];
    Lanes& value = lanes(values_[node]);
    for (AtWork& defect : defects_) {
      if (defect.is_stem(node)) {
        defect.driven = driven;
        value = blend(lanes(defect.chip), found(defect), value);
      } else if (is_bridge(defect.defect.kind) && defect.defect.other.node == node) {
        defect.other_driven = driven;
        if (defect.defect.kind != DefectKind::dominated_by)
          value = blend(lanes(defect.chip),
                        bridged(defect.defect.kind, lanes(defect.other_driven), lanes(defect.driven)), value);
      }
    }
  }
  // The level of a line with a defect.
  static Lanes found(const AtWork& defect) {
    const Lanes& driven = lanes(defect.driven);
    switch (defect.defect.kind) {
      case DefectKind::stuck_at_0:
        return Lanes{};
      case DefectKind::stuck_at_1:
        return ~Lanes{};
      case DefectKind::slow_to_rise:
        return driven & lanes(defect.before);
      case DefectKind::slow_to_fall:
        return driven | lanes(defect.before);
      default:
        return bridged(defect.defect.kind, driven, lanes(defect.other_driven));
    }
  }

  // Asynchronous resets; true when a state changed.
  bool apply_resets(const Word& running) {
    bool changed = false;
    for (std::size_t f = 0; f < view_.flops.size(); ++f) {
      if (reset_node_[f] == kNoNode) continue;
      const Lanes net = reset_of(f);
      const Lanes active = (view_.flops[f].reset_low ? ~net : net) & lanes(running);
      Lanes& now = lanes(state(f));
      const Lanes next = view_.flops[f].reset_value ? now | active : now & ~active;
      changed = changed || !is_zero(next ^ now);
      now = next;
    }
    return changed;
  }
  Lanes reset_of(std::size_t flop) const {
    Lanes level = lanes(values_[reset_node_[flop]]);
    for (const AtWork* defect : reset_defects_[flop])
      level = blend(lanes(defect->chip), found(*defect), level);
    return level;
  }

  void compare(std::span<const Stretch> stretches, std::size_t t) {
    for (std::size_t k = 0; k < stretches.size(); ++k) {
      const std::size_t at = stretches[k].begin + t;
      if (at >= stretches[k].end) continue;
      const std::string& states = stream_.cycles[at].states;
      for (const auto& [s, node] : output_) {
        if (states[s] != 'H' && states[s] != 'L') continue;
        for (std::size_t c = 0; c < fails_.size(); ++c)
          if (values_[node].bit(c * lanes_ + k) != (states[s] == 'H')) fails_[c].push_back({at, s});
      }
    }
  }
  void clock(const Word& clocked) {
    const std::size_t outs = view_.output_ports.size();
    for (std::size_t f = 0; f < view_.flops.size(); ++f)
      lanes(state(f)) = blend(lanes(clocked), lanes(values_[circuit_.outputs()[outs + f]]), lanes(state(f)));
  }

  const CaptureView& view_;
  const Circuit& circuit_;
  const CycleStream& stream_;
  std::size_t lanes_;                             // of each chip
  std::vector<std::vector<FailedStrobe>> fails_;  // by chip
  std::vector<std::mt19937_64> random_;           // likewise
  std::vector<Word> values_, driven_;             // by node; by input of the circuit, before any defect
  std::vector<std::uint8_t> marked_;              // nodes with a defect at them or at an input of theirs
  std::vector<AtWork> defects_;
  std::optional<std::size_t> enable_;  // signal
  std::vector<Node> all_nodes_, shift_nodes_;
  std::vector<std::pair<Node, bool>> levels_;              // of nodes that stand still in a shift
  std::vector<std::size_t> input_;                         // signal of each input port
  std::vector<std::pair<std::size_t, Node>> output_;       // signal and node of each output port
  std::vector<Node> reset_node_;                           // by flop
  std::vector<std::vector<const AtWork*>> reset_defects_;  // by flop: of its reset pin
  Word at_pin_;
  std::vector<Word> pins_;
};

}  // namespace

bool is_clock(const CaptureView& view, const Line& line) {
  const Node source = source_of(view.circuit, line);
  for (std::size_t i = 0; i < view.input_ports.size(); ++i)
    if (view.clock_ports[i] != 0 && source == view.circuit.inputs()[i]) return true;
  return false;
}

std::vector<Line> data_lines(const CaptureView& view) {
  std::vector<Line> lines;
  for (const Site& site : view.circuit.sites())
    if (site.node != kNoNode && !is_clock(view, {site.node, site.pin}))
      lines.push_back({site.node, site.pin});
  return lines;
}

std::vector<FailLog> test_chips(const CaptureView& view, const CycleStream& stream,
                                const std::string& scan_enable, const std::vector<TestedChip>& chips,
                                const Progress& progress) {
  if (chips.empty()) return {};
  const CycleStream single = unrolled(stream);
  return Tester(view, single, scan_enable, chips).run(stretches_of(view, single, scan_enable), progress);
}

FailLog test_chip(const CaptureView& view, const CycleStream& stream, const std::string& scan_enable,
                  const TestedChip& chip, const Progress& progress) {
  return test_chips(view, stream, scan_enable, {chip}, progress)[0];
}

FailLog kept_in_memory(FailLog log, std::size_t room) {
  if (log.fails.size() <= room) return log;
  log.fails.resize(room);
  log.truncated = true;
  return log;
}

}  // namespace meltstage::dft
