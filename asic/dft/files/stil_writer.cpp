// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "asic/dft/files/stil.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

// STIL's names in quotes have no way to write a quote or a line end (IEEE 1450.0-1999, 6.8).
std::string quoted(const std::string& name) {
  const auto wrong = std::find_if(name.begin(), name.end(),
                                  [](char c) { return c == '"' || static_cast<unsigned char>(c) < 0x20; });
  if (wrong != name.end())
    throw UserError(
        fmt::format("name {}: found {}, expected none that STIL can't write; rename it in the netlist",
                    shown(name), *wrong == '"' ? "a quote" : "a control character"));
  return "\"" + name + "\"";
}

std::string sum_of(const std::vector<TestSignal>& signals, bool inputs) {
  std::string text;
  for (const TestSignal& signal : signals) {
    if (signal.is_input == inputs) text += (text.empty() ? "" : " + ") + quoted(signal.name);
  }
  return text;
}

// Runs of one character as \rN c.
std::string data(const std::string& states) {
  std::string text;
  for (std::size_t i = 0; i < states.size();) {
    std::size_t end = i;
    while (end < states.size() && states[end] == states[i]) ++end;
    if (end - i > 5)
      text += fmt::format("\\r{} {} ", end - i, states[i]);
    else
      text += states.substr(i, end - i);
    i = end;
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

const ScanChain* chain_of(const std::vector<ScanChain>& chains, const std::string& port, bool in) {
  for (const ScanChain& chain : chains) {
    if ((in ? chain.in : chain.out) == port) return &chain;
  }
  return nullptr;
}

std::string head(const std::string& title, const std::vector<TestSignal>& signals,
                 const std::vector<ScanChain>& chains) {
  std::string text = fmt::format(
      "STIL 1.0 {{ Design 2005; }}\nHeader {{\n  Title \"{}\";\n  Source \"meltstage\";\n}}\nSignals {{\n",
      title);
  for (const TestSignal& signal : signals) {
    text += fmt::format("  {} {}", quoted(signal.name), signal.is_input ? "In" : "Out");
    if (chain_of(chains, signal.name, signal.is_input) != nullptr)
      text += signal.is_input ? " { ScanIn; }\n" : " { ScanOut; }\n";
    else
      text += ";\n";
  }
  text += "}\nSignalGroups {\n";
  text += fmt::format("  \"_pi\" = '{}';\n", sum_of(signals, true));
  text += fmt::format("  \"_po\" = '{}';\n", sum_of(signals, false));
  return text;
}

std::string timing_text(const TestTiming& t) {
  return fmt::format(
      "Timing {{\n  WaveformTable \"_default_WFT_\" {{\n    Period '{}ns';\n    Waveforms {{\n"
      "      \"_pi\" {{ 0 {{ '{}ns' D; }} }}\n      \"_pi\" {{ 1 {{ '{}ns' U; }} }}\n"
      "      \"_pi\" {{ P {{ '0ns' D; '{}ns' U; '{}ns' D; }} }}\n"
      "      \"_po\" {{ X {{ '0ns' X; }} }}\n      \"_po\" {{ H {{ '0ns' X; '{}ns' H; }} }}\n      \"_po\" "
      "{{ L {{ '0ns' X; '{}ns' L; }} }}\n"
      "    }}\n  }}\n}}\n",
      t.period_ns, t.drive_ns, t.drive_ns, t.clock_rise_ns, t.clock_fall_ns, t.strobe_ns, t.strobe_ns);
}

std::string burst(const std::string& pattern) {
  return fmt::format(
      "PatternBurst \"_burst_\" {{\n  PatList {{ {} {{ }} }}\n}}\nPatternExec {{\n  PatternBurst "
      "\"_burst_\";\n}}\n",
      quoted(pattern));
}

std::string list_of(const std::vector<ScanChain>& chains, bool in) {
  std::string text;
  for (const ScanChain& chain : chains)
    text += (text.empty() ? "" : " + ") + quoted(in ? chain.in : chain.out);
  return text;
}

}  // namespace

std::string stil_text(const ScanTest& test) {
  const std::size_t inputs = test.input_count(), outputs = test.signals.size() - inputs;
  std::string text = head(test.title, test.signals, test.chains);
  text +=
      fmt::format("  \"_clk\" = '{}';\n  \"_si\" = '{}' {{ ScanIn; }}\n  \"_so\" = '{}' {{ ScanOut; }}\n}}\n",
                  quoted(test.clock), list_of(test.chains, true), list_of(test.chains, false));
  text += timing_text(test.timing);
  text += "ScanStructures {\n";
  for (const ScanChain& chain : test.chains) {
    text += fmt::format(
        "  ScanChain {} {{\n    ScanLength {};\n    ScanIn {};\n    ScanOut {};\n    ScanInversion 0;\n    "
        "ScanCells",
        quoted(chain.name), chain.cells.size(), quoted(chain.in), quoted(chain.out));
    for (const std::string& cell : chain.cells) text += " " + quoted(cell);
    text += fmt::format(";\n    ScanMasterClock {};\n  }}\n", quoted(test.clock));
  }
  text += "}\n" + burst("_pattern_");
  const std::string idle =
      fmt::format("C {{ \"_pi\"={}; \"_po\"={}; }}", data(test.idle_inputs), data(std::string(outputs, 'X')));
  text += fmt::format(
      "Procedures {{\n"
      "  \"load_unload\" {{\n    W \"_default_WFT_\";\n    {}\n    \"pre_shift\": V {{ {}=1; }}\n"
      "    Shift {{ W \"_default_WFT_\"; V {{ \"_clk\"=P; \"_si\"={}; \"_so\"={}; }} }}\n  }}\n"
      "  \"multiclock_capture\" {{\n    W \"_default_WFT_\";\n    {}\n    F {{ {}=0; }}\n    V {{ "
      "\"_pi\"=\\r{} # ; \"_po\"=\\r{} # ; }}\n  }}\n",
      idle, quoted(test.scan_enable), std::string(test.chains.size(), '#'),
      std::string(test.chains.size(), '#'), idle, quoted(test.scan_enable), inputs, outputs);
  std::string setup = "  \"test_setup\" {\n    W \"_default_WFT_\";\n    " + idle + "\n";
  if (!test.reset.empty()) {
    const char active = test.reset_low ? '0' : '1', passive = test.reset_low ? '1' : '0';
    text += fmt::format(
        "  \"reset_pulse\" {{\n    W \"_default_WFT_\";\n    {}\n    V {{ {}={}; }}\n    V {{ {}={}; }}\n  "
        "}}\n",
        idle, quoted(test.reset), active, quoted(test.reset), passive);
    setup += fmt::format("    V {{ {}={}; {}=P; }}\n    V {{ {}={}; {}=0; }}\n", quoted(test.reset), active,
                         quoted(test.clock), quoted(test.reset), passive, quoted(test.clock));
  }
  text += "}\nMacroDefs {\n" + setup +
          "  }\n}\nPattern \"_pattern_\" {\n  W \"_default_WFT_\";\n  Macro \"test_setup\";\n";
  const std::vector<std::string>* unload = nullptr;
  for (std::size_t p = 0; p <= test.patterns.size(); ++p) {
    const bool last = p == test.patterns.size();
    text +=
        fmt::format("  {}: Call \"load_unload\" {{\n", quoted(last ? "last unload" : test.patterns[p].label));
    for (std::size_t c = 0; c < test.chains.size(); ++c) {
      const std::string zeros(test.chain_length(), '0'), none(test.chain_length(), 'X');
      text += fmt::format("    {}={};\n", quoted(test.chains[c].in), last ? zeros : test.patterns[p].load[c]);
      text +=
          fmt::format("    {}={};\n", quoted(test.chains[c].out), unload == nullptr ? none : (*unload)[c]);
    }
    text += "  }\n";
    if (last) break;
    unload = &test.patterns[p].unload;
    if (test.patterns[p].action == Action::launch)
      text += fmt::format("  Call \"multiclock_capture\" {{ \"_pi\"={}; \"_po\"={}; }}\n",
                          test.patterns[p].inputs, std::string(outputs, 'X'));
    if (test.patterns[p].action == Action::capture || test.patterns[p].action == Action::launch)
      text += fmt::format("  Call \"multiclock_capture\" {{ \"_pi\"={}; \"_po\"={}; }}\n",
                          test.patterns[p].inputs, test.patterns[p].outputs);
    if (test.patterns[p].action == Action::reset) text += "  Call \"reset_pulse\";\n";
  }
  return text + "}\n";
}

std::string flat_stil_text(const CycleStream& stream) {
  const auto inputs = static_cast<std::size_t>(std::count_if(stream.signals.begin(), stream.signals.end(),
                                                             [](const TestSignal& s) { return s.is_input; }));
  std::string text =
      head(stream.title, stream.signals, {}) + "}\n" + timing_text(stream.timing) + burst("_pattern_");
  text += "Pattern \"_pattern_\" {\n  W \"_default_WFT_\";\n";
  for (std::size_t i = 0; i < stream.cycles.size();) {
    const TestCycle& cycle = stream.cycles[i];
    std::uint64_t count = 0;
    std::size_t end = i;
    do {
      count += stream.cycles[end++].count;
    } while (end < stream.cycles.size() && stream.cycles[end].states == cycle.states &&
             stream.cycles[end].label.empty());
    const std::string vector = fmt::format("V {{ \"_pi\"={}; \"_po\"={}; }}", cycle.states.substr(0, inputs),
                                           cycle.states.substr(inputs));
    const std::string label = cycle.label.empty() ? "" : quoted(cycle.label) + ": ";
    text += count == 1 ? fmt::format("  {}{}\n", label, vector)
                       : fmt::format("  {}Loop {} {{ {} }}\n", label, count, vector);
    i = end;
  }
  return text + "}\n";
}

}  // namespace meltstage::dft
