// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/scan_grade.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <utility>

#include "asic/dft/core/machines.hpp"
#include "asic/dft/core/workers.hpp"
#include "asic/dft/scan/scan_ways.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

namespace {

constexpr std::size_t kDrawn = 50;  // ways to fill unknowns beside all 0 and all 1
// Most faults show right behind the first strobe; the others begin again together, for so many times as long.
constexpr std::uint64_t kFirstLook = 16, kLonger = 64;
// Lines times cycles times words of machines of one look at the most, after the first; and so many times as
// long as the one before it is at least.
constexpr double kMostWork = 8e9;
constexpr std::uint64_t kLeastLonger = 4;
constexpr std::size_t kAllDrawn = 4096;  // so many defects are all looked at with these

// A stream by the ports of a view.
class Ports {
 public:
  struct Strobe {
    std::size_t signal, port;
  };
  Ports(const CaptureView& view, const CycleStream& stream) {
    for (const std::string& name : view.input_ports) inputs_.push_back(signal(stream, name, true));
    for (std::size_t o = 0; o < view.output_ports.size(); ++o) {
      for (std::size_t s = 0; s < stream.signals.size(); ++s) {
        if (!stream.signals[s].is_input && stream.signals[s].name == view.output_ports[o])
          strobes_.push_back({s, o});
      }
    }
  }
  /// By input port, the signal.
  const std::vector<std::size_t>& inputs() const { return inputs_; }
  const std::vector<Strobe>& strobes() const { return strobes_; }

  static std::size_t signal(const CycleStream& stream, const std::string& name, bool input) {
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      if (stream.signals[s].name == name && stream.signals[s].is_input == input) return s;
    }
    throw UserError(fmt::format("{}: found no {} signal {}, expected every port of the netlist", stream.title,
                                input ? "input" : "output", name));
  }

 private:
  std::vector<std::size_t> inputs_;
  std::vector<Strobe> strobes_;
};

// Some defects with `fills` machines each, from lane 1 on: unknowns all 0 and all 1, or drawn.
class StreamRun {
 public:
  StreamRun(const CaptureView& view, const CycleStream& stream, const Ports& ports,
            const std::vector<Defect>& defects, std::span<const std::uint32_t> which, bool drawn)
      : view_(view), stream_(stream), ports_(ports), fills_(drawn ? kDrawn : 2), random_(which.front()) {
    std::vector<Fault> faults;
    std::vector<std::pair<std::size_t, std::size_t>> stopped;  // flop, lane
    for (const std::uint32_t d : which) {
      for (std::size_t f = 0; f < fills_; ++f) {
        faults.push_back(defects[d].line);
        if (drawn) drawn_.set(faults.size(), true);
        if (!drawn && f == 1) ones_.set(faults.size(), true);
        for (const std::size_t flop : defects[d].stopped) stopped.emplace_back(flop, faults.size());
      }
    }
    machines_.emplace(view, faults);
    for (const auto& [flop, lane] : stopped) machines_->stop_clock(flop, lane);
    first_.assign(which.size(), kNotShown);
    sure_.assign(which.size(), 0);
    open_ = which.size();
  }

  // So many cycles.
  void run(std::uint64_t cycles) {
    for (std::size_t k = 0; k < machines_->flops(); ++k) machines_->state(k) = unknown();
    if (!stream_.cycles.empty())
      machines_->preset_inputs(std::span<const Word>(levels(stream_.cycles[0].states)));
    machines_->start();
    std::uint64_t number = 0;
    for (const TestCycle& cycle : stream_.cycles) {
      const bool clocks = has_clock(cycle.states);
      machines_->set_inputs(std::span<const Word>(levels(cycle.states)));
      bool look = true;  // other strobes
      for (std::uint64_t c = 0; c < cycle.count; ++c, ++number) {
        if (machines_->ports_changed() || look) compare(cycle.states, number);
        if (open_ == 0 || number >= cycles) return;
        look = false;
        if (clocks) machines_->clock();
      }
    }
  }
  /// By defect of this run.
  const std::vector<std::uint64_t>& first() const { return first_; }
  /// Whether the machines of a defect that has shown failed together, in one state.
  bool is_sure(std::size_t defect) const { return sure_[defect] != 0; }

 private:
  Word unknown() {
    Word word = ones_;
    for (std::size_t p = 0; p < word.part.size() && fills_ != 2; ++p)
      word.part[p] |= random_() & drawn_.part[p];
    return word;
  }
  // By input port.
  std::vector<Word> levels(const std::string& states) {
    std::vector<Word> words(ports_.inputs().size());
    for (std::size_t i = 0; i < words.size(); ++i) {
      const char c = states[ports_.inputs()[i]];
      if (c == '1') words[i].part.fill(~std::uint64_t{0});
      if (c != '0' && c != '1' && c != 'P') words[i] = unknown();
    }
    return words;
  }
  bool has_clock(const std::string& states) const {
    for (std::size_t i = 0; i < ports_.inputs().size(); ++i) {
      if (view_.clock_ports[i] != 0 && states[ports_.inputs()[i]] == 'P') return true;
    }
    return false;
  }
  void compare(const std::string& states, std::uint64_t number) {
    Word all;
    all.part.fill(~std::uint64_t{0});
    bool fresh = false;
    const Word before = failed_;
    for (const Ports::Strobe& strobe : ports_.strobes()) {
      const char expected = states[strobe.signal];
      if (expected != 'H' && expected != 'L') continue;
      const Word wrong = machines_->unlike(strobe.port, expected == 'H', all);
      for (std::size_t p = 0; p < wrong.part.size(); ++p) {
        fresh = fresh || (wrong.part[p] & ~failed_.part[p]) != 0;
        failed_.part[p] |= wrong.part[p];
      }
    }
    if (!fresh) return;
    for (std::size_t d = 0; d < first_.size(); ++d) {
      if (first_[d] != kNotShown) continue;
      bool fails = true;
      for (std::size_t f = 0; f < fills_; ++f) fails = fails && failed_.bit(1 + d * fills_ + f);
      if (!fails) continue;
      first_[d] = number;
      const std::size_t lane = 1 + d * fills_;
      sure_[d] = !before.bit(lane) && !before.bit(lane + 1) && same_states(lane) ? 1 : 0;
      --open_;
    }
  }
  bool same_states(std::size_t lane) const {
    for (std::size_t k = 0; k < machines_->flops(); ++k) {
      const Word& state = std::as_const(*machines_).state(k);
      if (state.bit(lane) != state.bit(lane + 1)) return false;
    }
    return true;
  }

  const CaptureView& view_;
  const CycleStream& stream_;
  const Ports& ports_;
  std::size_t fills_;
  std::mt19937_64 random_;
  std::optional<Machines> machines_;
  Word ones_, drawn_, failed_;
  std::vector<std::uint64_t> first_;
  std::vector<std::uint8_t> sure_;
  std::size_t open_ = 0;
};

}  // namespace

namespace {

// The first cycle that compares something.
std::uint64_t first_strobe(const CycleStream& stream) {
  std::uint64_t number = 0;
  for (const TestCycle& cycle : stream.cycles) {
    if (cycle.states.find_first_of("HL") != std::string::npos) break;
    number += cycle.count;
  }
  return number;
}

}  // namespace

std::vector<std::uint64_t> shown_by_stream(const CaptureView& view, const CycleStream& stream,
                                           const std::vector<Defect>& defects, const Progress& progress) {
  const Ports ports(view, stream);
  std::vector<std::uint64_t> first(defects.size(), kNotShown);
  std::vector<std::uint8_t> unsure(defects.size(), 0);
  const auto words = [](std::size_t count, bool drawn) {
    const std::size_t together = (kLanes - 1) / (drawn ? kDrawn : 2);
    return (count + together - 1) / together;
  };
  const auto run = [&](const std::vector<std::uint32_t>& which, bool drawn, std::uint64_t cycles) {
    const std::size_t together = (kLanes - 1) / (drawn ? kDrawn : 2), runs = words(which.size(), drawn);
    std::atomic<std::size_t> next{0};
    in_parallel([&](unsigned worker) {
      for (std::size_t r = next++; r < runs; r = next++) {
        if (worker == 0) tell(progress, drawn ? "looking at unknowns" : "running faults", r, runs);
        const std::span<const std::uint32_t> part =
            std::span(which).subspan(r * together, std::min(together, which.size() - r * together));
        StreamRun machines(view, stream, ports, defects, part, drawn);
        machines.run(cycles);
        for (std::size_t d = 0; d < part.size(); ++d) {
          const std::uint64_t shown = machines.first()[d];
          first[part[d]] = drawn && shown != kNotShown ? std::max(shown, first[part[d]]) : shown;
          unsure[part[d]] = !drawn && shown != kNotShown && !machines.is_sure(d) ? 1 : 0;
        }
      }
    });
  };
  const auto affordable = [&](std::size_t runs) {
    const double lines =
        static_cast<double>(std::max<std::size_t>(view.circuit.size(), 1) * std::max<std::size_t>(runs, 1));
    return static_cast<std::uint64_t>(kMostWork / lines);
  };
  const std::uint64_t total = cycle_count(stream), strobe = first_strobe(stream);
  std::vector<std::uint32_t> open = every(defects.size());
  // The second look sees the loads and unloads of a reset test, too.
  std::uint64_t looked = 0;
  for (std::uint64_t more = kFirstLook; !open.empty() && looked < total; more = kLonger * more + 4 * strobe) {
    std::uint64_t cycles = std::min(total, strobe + more);
    if (looked != 0) cycles = std::min(cycles, affordable(words(open.size(), false)));
    if (cycles < total && cycles < kLeastLonger * looked) break;
    run(open, false, cycles);
    std::erase_if(open, [&](std::uint32_t d) { return first[d] != kNotShown; });
    looked = std::max<std::uint64_t>(cycles, 1);
  }
  std::vector<std::uint32_t> again;
  std::uint64_t last = 0;
  for (std::uint32_t d = 0; d < defects.size(); ++d) {
    const bool look = unsure[d] != 0 || defects.size() <= kAllDrawn;
    if (!look || first[d] == kNotShown) continue;
    again.push_back(d);
    last = std::max(last, first[d]);
  }
  const bool whole = affordable(words(again.size(), true)) >= total;
  run(again, true, whole ? total : std::min(total, last + 1));
  return first;
}

namespace {

// Lines whose change may disturb what chains shift, or a reset.
class Disturbing {
 public:
  Disturbing(const CaptureView& view, const ScanDesign& design)
      : circuit_(view.circuit), shifting_(view.circuit.inputs().size(), -1), testing_(shifting_) {
    for (std::size_t i = 0; i < view.input_ports.size(); ++i) {
      const std::string& name = view.input_ports[i];
      if (view.clock_ports[i] != 0) shifting_[i] = testing_[i] = 0;
      if (name == design.test_mode) shifting_[i] = testing_[i] = 1;
      if (name == design.scan_enable) shifting_[i] = 1;
      if (name == design.reset) shifting_[i] = design.reset_low ? 1 : 0;
    }
    shift_constant_ = constants(circuit_, shifting_);
    test_constant_ = constants(circuit_, testing_);
    Marks &shifted = shifted_, &resets = resets_;
    shifted.assign(circuit_.size(), 0);
    resets.assign(circuit_.size(), 0);
    for (std::size_t o = 0; o < circuit_.outputs().size(); ++o) {
      const bool chain_end =
          o >= view.output_ports.size() ||
          std::any_of(design.chains.begin(), design.chains.end(),
                      [&](const ScanChain& chain) { return chain.out == view.output_ports[o]; });
      if (chain_end) shifted[circuit_.outputs()[o]] = 1;
    }
    for (const ScanFlop& flop : view.flops) {
      const auto line = flop.has_reset ? view.node_of_net.find(flop.reset) : view.node_of_net.end();
      if (line == view.node_of_net.end()) continue;
      resets[line->second] = 1;
      for (const Node reader : circuit_.fanout(line->second)) {
        if (circuit_.name(reader) == flop.name) reset_readers_.insert({reader, line->second});
      }
    }
    mark_readers(resets);
    shift_ = reaching(shifted, shift_constant_);
    reset_ = reaching(resets, test_constant_);
  }

  bool disturbs(const Fault& fault) const {
    return changes(fault, shift_constant_, shift_, shifted_) || disturbs_reset(fault);
  }
  const std::vector<std::int8_t>& constants_in_shift() const { return shift_constant_; }
  bool disturbs_reset(const Fault& fault) const {
    if (fault.pin != kStem &&
        reset_readers_.count({fault.node, circuit_.fanin(fault.node)[static_cast<std::size_t>(fault.pin)]}) !=
            0)
      return true;
    return changes(fault, test_constant_, reset_, resets_);
  }

 private:
  using Marks = std::vector<std::uint8_t>;

  // An inverter or buffer between a reset and its flop is a line of the reset, too.
  void mark_readers(Marks& resets) const {
    for (const auto& [reader, line] : reset_readers_) {
      const Gate kind = circuit_.kind(reader);
      if (kind == Gate::buf || kind == Gate::inv) resets[reader] = 1;
    }
  }
  // Nodes from which a way leads to those marked that the constants leave open.
  Marks reaching(Marks marks, const std::vector<std::int8_t>& constant) const {
    for (Node node = static_cast<Node>(circuit_.size()); node-- > 0;) {
      for (const Node next : circuit_.fanout(node)) {
        if (marks[node] != 0) break;
        if (marks[next] == 0) continue;
        const auto fanin = circuit_.fanin(next);
        for (std::size_t pin = 0; pin < fanin.size(); ++pin) {
          if (fanin[pin] == node && !closed(next, pin, constant, nullptr)) marks[node] = 1;
        }
      }
    }
    return marks;
  }
  // Whether a constant at another input keeps this one from the gate's output; not one that a fault changes.
  bool closed(Node gate, std::size_t pin, const std::vector<std::int8_t>& constant,
              const std::set<Node>* changed) const {
    const auto fanin = circuit_.fanin(gate);
    const Gate kind = circuit_.kind(gate);
    const auto stands = [&](std::size_t other, std::int8_t level) {
      return constant[fanin[other]] == level && (changed == nullptr || changed->count(fanin[other]) == 0);
    };
    if (kind == Gate::mux) return pin < 2 && stands(2, pin == 0 ? 1 : 0);
    if (kind != Gate::all && kind != Gate::nall && kind != Gate::any && kind != Gate::none) return false;
    const std::int8_t controlling = kind == Gate::all || kind == Gate::nall ? 0 : 1;
    for (std::size_t other = 0; other < fanin.size(); ++other) {
      if (other != pin && stands(other, controlling)) return true;
    }
    return false;
  }
  // A fault at the level that its line has there anyway changes nothing. `open`: nodes from which a way leads
  // to `ends`.
  bool changes(const Fault& fault, const std::vector<std::int8_t>& constant, const Marks& open,
               const Marks& ends) const {
    const bool stem = fault.pin == kStem;
    const Node line = stem ? fault.node : circuit_.fanin(fault.node)[static_cast<std::size_t>(fault.pin)];
    if (constant[line] == (fault.stuck ? 1 : 0)) return false;
    if (!stem && closed(fault.node, static_cast<std::size_t>(fault.pin), constant, nullptr)) return false;
    return constant[line] >= 0 ? reaches(fault.node, constant, ends) : open[fault.node] != 0;
  }
  // Whether a change of a node may reach one of the ends. What is constant but for the change closes ways as
  // long as the change does not reach that, too.
  bool reaches(Node from, const std::vector<std::int8_t>& constant, const Marks& ends) const {
    std::set<Node> changed, pending{from};
    while (!pending.empty()) {
      const Node node = *pending.begin();  // drivers before readers
      pending.erase(pending.begin());
      const auto fanin = circuit_.fanin(node);
      bool reached = node == from;
      for (std::size_t pin = 0; pin < fanin.size() && !reached; ++pin)
        reached = changed.count(fanin[pin]) != 0 && !closed(node, pin, constant, &changed);
      if (!reached) continue;
      if (ends[node] != 0) return true;
      changed.insert(node);
      for (const Node next : circuit_.fanout(node)) pending.insert(next);
    }
    return false;
  }

  const Circuit& circuit_;
  std::vector<std::int8_t> shifting_, testing_;  // by input
  std::vector<std::int8_t> shift_constant_, test_constant_;
  Marks shifted_, resets_;                         // where chains shift; resets of flops
  Marks shift_, reset_;                            // nodes from which constants leave ways open to these
  std::set<std::pair<Node, Node>> reset_readers_;  // a gate of a flop and the reset line that it reads
};

// Lines on the way of a chain. One that is stuck is all that the chain's output shows once what lies behind
// it has been shifted out, whatever else the fault does: known without a run.
class ChainLines {
 public:
  ChainLines(const CaptureView& view, const ScanDesign& design, const std::vector<std::int8_t>& constant,
             const CycleStream& stream)
      : strobed_(design.chains.size()) {
    for (std::size_t c = 0; c < design.chains.size(); ++c) walk(view, design.chains[c].out, c, constant);
    look_at(view, design, stream);
  }
  bool shows(const Fault& line) const {
    const auto place = places_.find({line.node, line.pin});
    if (place == places_.end()) return false;
    const auto& [chain, behind, inverted] = place->second;
    const std::int64_t latest = strobed_[chain][line.stuck != inverted ? 0 : 1];
    return latest >= static_cast<std::int64_t>(behind);
  }

 private:
  struct Place {
    std::size_t chain, behind;  // cells between the line and the output
    bool inverted;
  };

  void walk(const CaptureView& view, const std::string& out, std::size_t chain,
            const std::vector<std::int8_t>& constant) {
    const Circuit& circuit = view.circuit;
    const auto port = std::find(view.output_ports.begin(), view.output_ports.end(), out);
    if (port == view.output_ports.end()) return;
    std::map<Node, std::size_t> flop_of;
    for (std::size_t k = 0; k < view.flops.size(); ++k)
      flop_of[circuit.inputs()[view.input_ports.size() + k]] = k;
    Node node = circuit.outputs()[static_cast<std::size_t>(port - view.output_ports.begin())];
    bool inverted = false;
    for (std::size_t behind = 0; behind <= view.flops.size();) {
      if (const auto flop = flop_of.find(node); flop != flop_of.end()) {
        ++behind;
        node = circuit.outputs()[view.output_ports.size() + flop->second];
      }
      if (circuit.fanin(node).empty()) return;
      const std::int32_t pin = open_pin(circuit, constant, node);
      if (pin < 0) return;
      const Gate kind = circuit.kind(node);
      inverted ^= kind == Gate::inv || kind == Gate::nall || kind == Gate::none;
      places_.emplace(std::pair(node, pin), Place{chain, behind, inverted});
      node = circuit.fanin(node)[static_cast<std::size_t>(pin)];
      places_.emplace(std::pair(node, kStem), Place{chain, behind, inverted});
    }
  }
  // After how many shifts in a row each output is compared with each level, at the most.
  void look_at(const CaptureView& view, const ScanDesign& design, const CycleStream& stream) {
    std::vector<std::size_t> outs, clocks;
    for (const ScanChain& chain : design.chains) outs.push_back(Ports::signal(stream, chain.out, false));
    for (std::size_t i = 0; i < view.input_ports.size(); ++i) {
      if (view.clock_ports[i] != 0) clocks.push_back(Ports::signal(stream, view.input_ports[i], true));
    }
    std::vector<std::pair<std::size_t, char>> held{{Ports::signal(stream, design.scan_enable, true), '1'},
                                                   {Ports::signal(stream, design.test_mode, true), '1'}};
    if (!design.reset.empty())
      held.emplace_back(Ports::signal(stream, design.reset, true), design.reset_low ? '1' : '0');
    for (auto& levels : strobed_) levels = {-1, -1};
    std::int64_t shifts = 0;
    for (const TestCycle& cycle : stream.cycles) {
      const auto is = [&](const auto& level) { return cycle.states[level.first] == level.second; };
      if (!std::all_of(held.begin(), held.end(), is)) {
        shifts = 0;
        continue;
      }
      const bool pulses =
          std::any_of(clocks.begin(), clocks.end(), [&](std::size_t s) { return cycle.states[s] == 'P'; });
      const std::int64_t last = shifts + (pulses ? static_cast<std::int64_t>(cycle.count) - 1 : 0);
      for (std::size_t c = 0; c < outs.size(); ++c) {
        const char state = cycle.states[outs[c]];
        if (state != 'H' && state != 'L') continue;
        std::int64_t& latest = strobed_[c][state == 'H' ? 1 : 0];
        latest = std::max(latest, last);
      }
      if (pulses) shifts += static_cast<std::int64_t>(cycle.count);
    }
  }

  std::map<std::pair<Node, std::int32_t>, Place> places_;
  std::vector<std::array<std::int64_t, 2>> strobed_;  // by chain, with L and with H; -1: never
};

}  // namespace

std::vector<FaultClass> scan_classes(const CaptureView& view, const ScanDesign& design, const FaultList& list,
                                     const std::vector<FaultClass>& of_class, const CycleStream& stream,
                                     bool all_by_stream, const Progress& progress) {
  const Disturbing disturbing(view, design);
  std::vector<FaultClass> reported = reported_classes(list, of_class);
  std::vector<Defect> defects;
  std::map<std::uint32_t, std::size_t> defect_of_class;
  std::map<std::pair<std::uint32_t, std::vector<std::size_t>>, std::size_t> defect_of_clock;
  std::vector<std::size_t> defect_of(reported.size(), ~std::size_t{0});  // by fault
  const ChainLines chains(view, design, disturbing.constants_in_shift(), stream);
  std::vector<std::uint8_t> in_chain(list.classes.size(), 0);
  for (std::size_t f = 0; f < reported.size(); ++f) {
    const Site& site = view.circuit.sites()[f / 2];
    if (list.class_of[f] != FaultList::kNoClass && view.stopped.count(f / 2) == 0 &&
        chains.shows({site.node, site.pin, f % 2 != 0}))
      in_chain[list.class_of[f]] = 1;
  }
  for (std::size_t f = 0; f < reported.size(); ++f) {
    const std::uint32_t c = list.class_of[f];
    const auto clock = view.stopped.find(f / 2);
    if (clock != view.stopped.end()) {
      const auto [known, fresh] = defect_of_clock.emplace(std::pair(c, clock->second), defects.size());
      if (fresh) defects.push_back({c == FaultList::kNoClass ? Fault{} : list.classes[c], clock->second});
      defect_of[f] = known->second;
      continue;
    }
    if (c == FaultList::kNoClass) continue;
    if (in_chain[c] != 0) {
      if (reported[f] != FaultClass::DS) reported[f] = all_by_stream ? FaultClass::DS : FaultClass::DI;
      continue;
    }
    const Fault& line = list.classes[c];
    const bool disturbs = all_by_stream || disturbing.disturbs(line);
    // What no change of its line can show needs no run, unless a reset acts without a clock.
    const bool redundant =
        (of_class[c] == FaultClass::UR || of_class[c] == FaultClass::UT) && !disturbing.disturbs_reset(line);
    if (!disturbs || redundant) continue;
    const auto [known, fresh] = defect_of_class.emplace(c, defects.size());
    if (fresh) defects.push_back({line, {}});
    defect_of[f] = known->second;
  }
  const std::vector<std::uint64_t> shown = shown_by_stream(view, stream, defects, progress);
  for (std::size_t f = 0; f < reported.size(); ++f) {
    if (defect_of[f] == ~std::size_t{0}) continue;
    const bool detected = shown[defect_of[f]] != kNotShown;
    const bool clock = view.stopped.count(f / 2) != 0;
    if (detected && reported[f] != FaultClass::DS)
      reported[f] = all_by_stream ? FaultClass::DS : FaultClass::DI;
    if (!detected && (reported[f] == FaultClass::DS || clock)) reported[f] = FaultClass::NO;
  }
  return reported;
}

bool is_captures_alone(const CaptureView& view, const ScanDesign& design, const CycleStream& stream) {
  const Ports ports(view, stream);
  const std::size_t enable = Ports::signal(stream, design.scan_enable, true);
  std::vector<std::size_t> clocks;
  std::size_t reset = stream.signals.size(), longest = 0;
  for (std::size_t i = 0; i < view.input_ports.size(); ++i) {
    if (view.clock_ports[i] != 0) clocks.push_back(ports.inputs()[i]);
    if (view.input_ports[i] == design.reset) reset = ports.inputs()[i];
  }
  std::set<std::size_t> ends;
  for (const ScanChain& chain : design.chains) {
    ends.insert(Ports::signal(stream, chain.out, false));
    longest = std::max(longest, chain.cells.size());
  }
  const char at_rest = design.reset_low ? '1' : '0';
  std::size_t shifts = 0;
  bool shifted_before = false;
  std::size_t unsure = 0;  // shifts after which the chains hold what is not a capture's or load's any more
  for (const TestCycle& cycle : stream.cycles) {
    const bool pulses =
        std::any_of(clocks.begin(), clocks.end(), [&](std::size_t s) { return cycle.states[s] == 'P'; });
    const bool shift = cycle.states[enable] == '1';
    const bool resets = reset < stream.signals.size() && cycle.states[reset] != at_rest;
    bool of_chain = false, of_other = false;
    for (const Ports::Strobe& strobe : ports.strobes()) {
      if (cycle.states[strobe.signal] != 'H' && cycle.states[strobe.signal] != 'L') continue;
      (ends.count(strobe.signal) != 0 ? of_chain : of_other) = true;
    }
    if (shift) {
      if (resets || of_other || (of_chain && unsure != 0)) return false;
      if (!shifted_before) shifts = 0;
      if (pulses) {
        shifts += cycle.count;
        unsure -= std::min<std::size_t>(unsure, cycle.count);
      }
    } else {
      const bool capture = pulses && cycle.count == 1 && shifted_before && shifts >= longest && !resets;
      if (pulses && !capture) unsure = longest;
      if ((of_other || of_chain) && !capture) return false;
    }
    shifted_before = shift;
  }
  return true;
}

}  // namespace meltstage::dft
