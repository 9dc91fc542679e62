// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/scan_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>

#include "asic/dft/core/fault_simulator.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

namespace {

// Position of a name among inputs or outputs.
std::size_t index_of(const std::vector<TestSignal>& signals, const std::string& name) {
  const auto found =
      std::find_if(signals.begin(), signals.end(), [&](const TestSignal& s) { return s.name == name; });
  return static_cast<std::size_t>(found - signals.begin());
}

char compare_char(bool value) { return value ? 'H' : 'L'; }

class Maker {
 public:
  Maker(const ScanDesign& design, const CaptureView& view, const std::string& title)
      : design_(design), view_(view) {
    test_.title = title;
    for (const std::string& name : view.input_ports) test_.signals.push_back({name, true});
    for (const std::string& name : view.output_ports) test_.signals.push_back({name, false});
    test_.chains = design.chains;
    test_.clock = design.clock;
    test_.reset = design.reset;
    test_.reset_low = design.reset_low;
    test_.scan_enable = design.scan_enable;
    test_.idle_inputs.assign(view.input_ports.size(), '0');
    for (const auto& [name, value] : capture_holds(design))
      test_.idle_inputs[index_of(test_.signals, name)] = value ? '1' : '0';
    for (std::size_t k = 0; k < view.flops.size(); ++k) flop_[view.flops[k].name] = k;
  }

  ScanTest captures(const std::vector<Pattern>& patterns) {
    const std::vector<Node>& outputs = view_.circuit.outputs();
    const auto ports = static_cast<std::ptrdiff_t>(view_.output_ports.size());
    return make(Action::capture, view_.circuit, patterns, {outputs.begin(), outputs.begin() + ports},
                {outputs.begin() + ports, outputs.end()});
  }
  ScanTest launches(const TransitionView& transitions, const std::vector<Pattern>& patterns) {
    return make(Action::launch, transitions.circuit, patterns, {}, transitions.circuit.outputs());
  }

 private:
  // `ports` and `flops`: what they show and take at the end of a pattern; without `ports` they aren't
  // compared.
  ScanTest make(Action action, const Circuit& circuit, const std::vector<Pattern>& patterns,
                const std::vector<Node>& ports, const std::vector<Node>& flops) {
    add_chain_test();
    if (!design_.reset.empty()) add_reset_test();
    std::vector<Word> values;
    std::size_t first = 0;
    for (const PatternBlock& block : blocks_of(patterns, circuit.inputs().size())) {
      simulate(circuit, block, values);
      for (std::size_t lane = 0; lane < block.count; ++lane) {
        const auto value = [&](Node node) { return values[node].bit(lane); };
        const Pattern& pattern = patterns[first + lane];
        ScanPattern entry = loaded(action, pattern, first + lane);
        entry.unload = unload([&](std::size_t flop) { return value(flops[flop]); });
        entry.outputs = no_compare();
        for (std::size_t i = 0; i < ports.size(); ++i) entry.outputs[i] = compare_char(value(ports[i]));
        test_.patterns.push_back(std::move(entry));
      }
      first += block.count;
    }
    return std::move(test_);
  }

  // One character a chain cell from a value a flop; leading zeros (or trailing X) make all chains as long as
  // the longest.
  template <class Value>
  std::vector<std::string> load(const Value& value) const {
    std::vector<std::string> strings;
    for (const ScanChain& chain : test_.chains) {
      std::string bits(test_.chain_length() - chain.cells.size(), '0');
      for (std::size_t i = chain.cells.size(); i-- > 0;) bits += value(flop_.at(chain.cells[i])) ? '1' : '0';
      strings.push_back(std::move(bits));
    }
    return strings;
  }
  template <class Value>
  std::vector<std::string> unload(const Value& value) const {
    std::vector<std::string> strings;
    for (const ScanChain& chain : test_.chains) {
      std::string bits;
      for (std::size_t i = chain.cells.size(); i-- > 0;)
        bits += compare_char(value(flop_.at(chain.cells[i])));
      strings.push_back(bits + std::string(test_.chain_length() - chain.cells.size(), 'X'));
    }
    return strings;
  }
  std::string no_compare() const { return std::string(view_.output_ports.size(), 'X'); }

  // 0011 through every chain. One that is too short to hold it sees it in four loads, each a step further.
  void add_chain_test() {
    std::size_t shortest = test_.chain_length();
    for (const ScanChain& chain : test_.chains) shortest = std::min(shortest, chain.cells.size());
    const std::size_t loads = shortest < 5 ? 4 : 1;
    for (std::size_t step = 0; step < loads; ++step) {
      std::vector<std::uint8_t> state(view_.flops.size());
      for (const ScanChain& chain : test_.chains) {
        for (std::size_t i = 0; i < chain.cells.size(); ++i)
          state[flop_.at(chain.cells[chain.cells.size() - 1 - i])] = (i + step) % 4 >= 2 ? 1 : 0;
      }
      const auto value = [&](std::size_t flop) { return state[flop] != 0; };
      test_.patterns.push_back({Action::none, load(value), unload(value), "", no_compare(),
                                step == 0 ? "chain test" : fmt::format("chain test {}", step + 1)});
    }
  }
  void add_reset_test() {
    const auto value = [&](std::size_t flop) { return view_.flops[flop].reset_value; };
    ScanPattern pattern{Action::reset, load([&](std::size_t flop) { return !value(flop); }),
                        unload(value), "",
                        no_compare(),  "reset test"};
    for (std::size_t c = 0; c < test_.chains.size();
         ++c) {  // a flop without a reset keeps what it was loaded with
      for (std::size_t i = 0; i < test_.chains[c].cells.size(); ++i) {
        const auto& cells = test_.chains[c].cells;
        if (!view_.flops[flop_.at(cells[cells.size() - 1 - i])].has_reset) pattern.unload[c][i] = 'X';
      }
    }
    test_.patterns.push_back(std::move(pattern));
  }
  ScanPattern loaded(Action action, const Pattern& pattern, std::size_t number) {
    const std::size_t ports = view_.input_ports.size();
    ScanPattern entry;
    entry.action = action;
    entry.label = fmt::format("pattern {}", number);
    entry.load = load([&](std::size_t flop) { return pattern[ports + flop] != 0; });
    for (std::size_t i = 0; i < ports; ++i)
      entry.inputs += view_.clock_ports[i] != 0 ? 'P' : pattern[i] != 0 ? '1' : '0';
    return entry;
  }

  const ScanDesign& design_;
  const CaptureView& view_;
  ScanTest test_;
  std::unordered_map<std::string, std::size_t> flop_;
};

}  // namespace

std::size_t ScanTest::chain_length() const {
  std::size_t length = 0;
  for (const ScanChain& chain : chains) length = std::max(length, chain.cells.size());
  return length;
}

std::size_t ScanTest::input_count() const {
  return static_cast<std::size_t>(
      std::count_if(signals.begin(), signals.end(), [](const TestSignal& s) { return s.is_input; }));
}

Captures captures_of(const CaptureView& view, const CycleStream& counted, const std::string& scan_enable) {
  const CycleStream stream = unrolled(counted);
  const std::size_t enable = index_of(stream.signals, scan_enable), ports = view.input_ports.size(),
                    outs = view.output_ports.size();
  if (enable == stream.signals.size())
    throw UserError(
        fmt::format("{}: found no signal {}, expected the scan enable", stream.title, scan_enable));
  std::unordered_map<std::string, std::size_t> flop;
  for (std::size_t k = 0; k < view.flops.size(); ++k) flop[view.flops[k].name] = k;
  struct Place {
    std::size_t in, out;
    std::vector<std::size_t> flops;
    std::vector<std::uint8_t> inverses;
  };
  std::vector<Place> chains;
  for (const ScanChain& chain : stream.chains) {
    Place place{
        index_of(stream.signals, chain.in), index_of(stream.signals, chain.out), {}, chain.inverses()};
    for (const std::string& cell : chain.cells) {
      const auto found = flop.find(cell);
      if (found == flop.end())
        throw UserError(
            fmt::format("{}: found scan cell {}, expected a flop of the netlist", stream.title, cell));
      place.flops.push_back(found->second);
    }
    chains.push_back(std::move(place));
  }
  std::vector<std::size_t> signal_of_input, signal_of_output;
  for (const std::string& name : view.input_ports) signal_of_input.push_back(index_of(stream.signals, name));
  for (const std::string& name : view.output_ports)
    signal_of_output.push_back(index_of(stream.signals, name));
  for (const std::size_t s : signal_of_input) {
    if (s == stream.signals.size())
      throw UserError(
          fmt::format("{}: found not every input port of the netlist, expected all", stream.title));
  }
  const std::size_t clock = static_cast<std::size_t>(
      std::find(view.clock_ports.begin(), view.clock_ports.end(), 1) - view.clock_ports.begin());
  if (clock == ports) throw UserError(fmt::format("{}: found no clock port, expected one", stream.title));
  const auto pulses = [&](std::size_t i) { return stream.cycles[i].states[signal_of_input[clock]] == 'P'; };
  const auto shifts = [&](std::size_t i) { return stream.cycles[i].states[enable] == '1'; };
  const auto compares = [&](std::size_t i, std::size_t signal) {
    const char c = stream.cycles[i].states[signal];
    return c == 'H' || c == 'L';
  };
  Captures captures;
  captures.compared_at = signal_of_output;
  captures.compared_at.resize(view.circuit.outputs().size(), stream.signals.size());
  for (const Place& chain : chains)
    for (const std::size_t f : chain.flops) captures.compared_at[outs + f] = chain.out;
  for (std::size_t at = 0; at < stream.cycles.size(); ++at) {
    if (shifts(at) || !pulses(at) || at == 0 || !shifts(at - 1)) continue;  // the capture right behind a load
    Pattern pattern(view.circuit.inputs().size(), 0), before = pattern;
    std::vector<std::uint32_t> compared_in(view.circuit.outputs().size(), Captures::kNotCompared);
    for (std::size_t i = 0; i < ports; ++i) {
      pattern[i] = stream.cycles[at].states[signal_of_input[i]] == '1' ? 1 : 0;
      before[i] = stream.cycles[at - 1].states[signal_of_input[i]] == '1' ? 1 : 0;
    }
    for (std::size_t i = 0; i < outs; ++i) {
      if (signal_of_output[i] != stream.signals.size() && compares(at, signal_of_output[i]))
        compared_in[i] = static_cast<std::uint32_t>(at);
    }
    for (const Place& chain : chains) {
      std::size_t cell = 0;
      for (std::size_t i = at; i-- > 0 && shifts(i) && cell < chain.flops.size();) {
        if (!pulses(i)) continue;
        const std::uint8_t shifted = stream.cycles[i].states[chain.in] == '1' ? 1 : 0;
        pattern[ports + chain.flops[cell]] = shifted ^ chain.inverses[cell];
        ++cell;
      }
      for (std::size_t k = 0; k < chain.flops.size(); ++k) {
        const std::size_t next = std::min(k + 1, chain.flops.size() - 1);
        before[ports + chain.flops[k]] =
            pattern[ports + chain.flops[next]] ^ chain.inverses[next] ^ chain.inverses[k];
      }
      cell = chain.flops.size();
      for (std::size_t i = at + 1; i < stream.cycles.size() && cell > 0; ++i) {
        if (!pulses(i)) continue;
        if (!shifts(i)) break;
        --cell;
        if (compares(i, chain.out)) compared_in[outs + chain.flops[cell]] = static_cast<std::uint32_t>(i);
      }
    }
    Pattern& compared = captures.compared.emplace_back();
    for (const std::uint32_t cycle : compared_in) compared.push_back(cycle != Captures::kNotCompared ? 1 : 0);
    captures.patterns.push_back(std::move(pattern));
    captures.before.push_back(std::move(before));
    captures.compared_in.push_back(std::move(compared_in));
  }
  return captures;
}

void attach_chains(CycleStream& stream, std::vector<ScanChain> chains, const std::string& scan_enable) {
  const auto require = [&](const std::string& name, bool input) {
    const std::size_t s = index_of(stream.signals, name);
    if (s == stream.signals.size() || stream.signals[s].is_input != input)
      throw UserError(
          fmt::format("{}: found no {} signal {}, expected the scan enable and the ports of every chain",
                      stream.title, input ? "input" : "output", name));
    return s;
  };
  if (chains.empty())
    throw UserError(fmt::format("{}: found no chains to give it, expected some", stream.title));
  const std::size_t enable = require(scan_enable, true);
  std::size_t longest = 0;
  for (const ScanChain& chain : chains) {
    require(chain.in, true);
    require(chain.out, false);
    longest = std::max(longest, chain.cells.size());
  }
  std::uint64_t at = 0, begin = 0, shifts = 0;
  std::size_t loads = 0;
  bool shifting = false;
  const auto finish_load = [&] {
    if (shifting && shifts < longest)
      throw UserError(
          fmt::format("{}: found {} clocks with {} at 1 from cycle {} on, expected at least {}, the "
                      "cells of the longest chain",
                      stream.title, shifts, scan_enable, begin, longest));
    shifting = false;
  };
  for (TestCycle& cycle : stream.cycles) {
    if (cycle.states[enable] != '1') {
      finish_load();
    } else {
      if (!shifting) {
        shifting = true;
        begin = at;
        shifts = 0;
        if (cycle.label.empty()) cycle.label = fmt::format("load {}", loads);
        ++loads;
      }
      if (cycle.states.find('P') != std::string::npos) shifts += cycle.count;
    }
    at += cycle.count;
  }
  finish_load();
  if (loads == 0)
    throw UserError(fmt::format("{}: found no cycle with {} at 1, expected scan patterns; leave --chains out",
                                stream.title, scan_enable));
  stream.chains = std::move(chains);
}

ScanTest make_scan_test(const ScanDesign& design, const CaptureView& view,
                        const std::vector<Pattern>& patterns, const std::string& title) {
  return Maker(design, view, title).captures(patterns);
}

ScanTest make_transition_test(const ScanDesign& design, const CaptureView& view,
                              const TransitionView& transitions, const std::vector<Pattern>& patterns,
                              const std::string& title) {
  return Maker(design, view, title).launches(transitions, patterns);
}

void for_each_step(const ScanTest& test, const std::function<void(const ScanStep&)>& take) {
  const std::size_t inputs = test.input_count(), clock = index_of(test.signals, test.clock),
                    enable = index_of(test.signals, test.scan_enable);
  const std::string nothing(test.signals.size() - inputs, 'X');
  const auto cycle = [&](const std::string& states, const std::string& label) { take({states, label}); };
  const std::string idle = test.idle_inputs;
  if (!test.reset.empty()) {
    std::string in_reset = idle;
    in_reset[index_of(test.signals, test.reset)] = test.reset_low ? '0' : '1';
    in_reset[clock] = 'P';
    cycle(in_reset + nothing, "test_setup");
    cycle(idle + nothing, "");
  }
  const std::vector<std::string> zeros(test.chains.size(), std::string(test.chain_length(), '0'));
  const std::vector<std::string>* unload = nullptr;
  for (std::size_t p = 0; p <= test.patterns.size(); ++p) {
    const ScanPattern* pattern = p < test.patterns.size() ? &test.patterns[p] : nullptr;
    std::string shift = idle + nothing;
    shift[enable] = '1';
    cycle(shift, pattern != nullptr ? pattern->label : "last unload");
    shift[clock] = 'P';
    take({shift, "", pattern != nullptr ? &pattern->load : &zeros, unload});
    if (pattern == nullptr) break;
    unload = &pattern->unload;
    if (pattern->action == Action::launch) cycle(pattern->inputs + nothing, "");
    if (pattern->action == Action::capture || pattern->action == Action::launch)
      cycle(pattern->inputs + pattern->outputs, "");
    if (pattern->action == Action::reset) {
      std::string states = idle + nothing;
      states[index_of(test.signals, test.reset)] = test.reset_low ? '0' : '1';
      cycle(states, "");
      cycle(idle + nothing, "");
    }
  }
}

CycleStream expand(const ScanTest& test) {
  CycleStream stream{test.title, test.signals, test.timing, {}, test.chains};
  std::vector<std::size_t> ins, outs;
  for (const ScanChain& chain : test.chains) {
    ins.push_back(index_of(test.signals, chain.in));
    outs.push_back(index_of(test.signals, chain.out));
  }
  const std::size_t length = test.chain_length();
  for_each_step(test, [&](const ScanStep& step) {
    if (step.load == nullptr) {
      stream.cycles.push_back({step.states, step.label});
      return;
    }
    std::string states = step.states;
    for (std::size_t i = 0; i < length; ++i) {
      for (std::size_t c = 0; c < test.chains.size(); ++c) {
        states[ins[c]] = (*step.load)[c][i];
        states[outs[c]] = step.unload == nullptr ? 'X' : (*step.unload)[c][i];
      }
      stream.cycles.push_back({states, ""});
    }
  });
  return stream;
}

}  // namespace meltstage::dft
