// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/formats.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "asic/dft/scan/replay.hpp"

namespace meltstage::dft {

namespace {

// Equal cycles in a row, at most `most`, a label only on the first.
template <class Write>
void runs(const CycleStream& stream, std::uint64_t most, const Write& write) {
  for (std::size_t i = 0; i < stream.cycles.size();) {
    std::uint64_t count = 0;
    std::size_t end = i;
    do {
      count += stream.cycles[end++].count;
    } while (end < stream.cycles.size() && stream.cycles[end].states == stream.cycles[i].states &&
             stream.cycles[end].label.empty());
    TestCycle cycle = stream.cycles[i];
    for (; count != 0; cycle.label.clear()) {
      const std::uint64_t part = std::min(count, most);
      write(cycle, part);
      count -= part;
    }
    i = end;
  }
}

bool pulsed(const CycleStream& stream, std::size_t s) {
  return std::any_of(stream.cycles.begin(), stream.cycles.end(),
                     [&](const TestCycle& c) { return c.states[s] == 'P'; });
}

// Names that a tester's language takes: letters, digits, underscores.
std::string pin_name(std::string name) {
  name.erase(std::remove(name.begin(), name.end(), ']'), name.end());
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
}

// In the order of the signals; where two would be one, the later one has a number behind its name.
std::vector<std::string> pin_names(const CycleStream& stream) {
  std::set<std::string> taken;
  for (const TestSignal& signal : stream.signals) taken.insert(pin_name(signal.name));
  std::vector<std::string> names;
  std::set<std::string> given;
  for (const TestSignal& signal : stream.signals) {
    std::string name = pin_name(signal.name);
    if (!given.insert(name).second) {
      const std::string plain = name;
      for (int number = 2; !taken.insert(name = fmt::format("{}_{}", plain, number)).second;) ++number;
      given.insert(name);
    }
    names.push_back(std::move(name));
  }
  return names;
}

// A line for each signal whose name another one has already.
std::string renamed_told(const CycleStream& stream, const std::vector<std::string>& names,
                         std::string_view comment) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] != pin_name(stream.signals[i].name))
      text += fmt::format("{} {} is the port {}\n", comment, names[i], stream.signals[i].name);
  return text;
}

std::string code_of(std::size_t i) {  // printable identifiers of VCD
  std::string code;
  do {
    code += static_cast<char>('!' + i % 94);
    i /= 94;
  } while (i != 0);
  return code;
}

// Times of a dump in ps; changes in order.
struct Dump {
  std::string text;
  long long stamped = -1;

  void at(double ns) {
    const long long ps = std::llround(ns * 1000.0);
    if (ps == stamped) return;
    stamped = ps;
    text += fmt::format("#{}\n", ps);
  }
};

template <class Change>
std::string dump(const CycleStream& stream, std::string header, const Change& change) {
  Dump dump{std::move(header)};
  std::string shown(stream.signals.size(), '\0');
  const auto set = [&](std::size_t s, char value, double ns) {
    if (shown[s] == value) return;
    dump.at(ns);
    shown[s] = value;
    dump.text += change(s, value);
  };
  const TestTiming& t = stream.timing;
  std::uint64_t cycle = 0;
  const auto show = [&](const std::string& now) {
    const double start = static_cast<double>(cycle) * t.period_ns;
    const auto each = [&](bool inputs, const auto& body) {
      for (std::size_t s = 0; s < now.size(); ++s) {
        if (stream.signals[s].is_input == inputs) body(s);
      }
    };
    each(true, [&](std::size_t s) { set(s, now[s] == '1' ? '1' : '0', start + t.drive_ns); });
    if (cycle == 0) each(false, [&](std::size_t s) { set(s, 'x', start + t.drive_ns); });
    each(false, [&](std::size_t s) {
      set(s, now[s] == 'H' ? '1' : now[s] == 'L' ? '0' : 'x', start + t.strobe_ns);
    });
    each(true, [&](std::size_t s) {
      if (now[s] == 'P') set(s, '1', start + t.clock_rise_ns);
    });
    each(true, [&](std::size_t s) {
      if (now[s] == 'P') set(s, '0', start + t.clock_fall_ns);
    });
    ++cycle;
  };
  for (const TestCycle& now : stream.cycles) {
    for (std::uint64_t i = 0; i < now.count; ++i) show(now.states);
  }
  dump.at(static_cast<double>(cycle) * t.period_ns);
  return dump.text;
}

char wgl_value(char state) { return state == 'P' || state == 'H' ? '1' : state == 'L' ? '0' : state; }

std::string wgl_signals(const std::string& title, const std::vector<TestSignal>& signals) {
  std::string text = fmt::format("waveform {}\n\nsignal\n", pin_name(title));
  for (const TestSignal& signal : signals)
    text += fmt::format("  \"{}\" : {};\n", signal.name, signal.is_input ? "input" : "output");
  return text + "end\n";
}

template <class Pulsed>
std::string wgl_timeplate(const std::vector<TestSignal>& signals, const TestTiming& t, const Pulsed& pulsed) {
  std::string text = fmt::format("\ntimeplate tp period {}nS\n", t.period_ns);
  for (std::size_t s = 0; s < signals.size(); ++s) {
    const TestSignal& signal = signals[s];
    if (!signal.is_input)
      text += fmt::format("  \"{}\" := output[0nS:X, {}nS:Q, {}nS:X];\n", signal.name, t.strobe_ns,
                          t.strobe_ns + 1);
    else if (pulsed(s))
      text += fmt::format("  \"{}\" := input[0nS:D, {}nS:S, {}nS:D];\n", signal.name, t.clock_rise_ns,
                          t.clock_fall_ns);
    else
      text += fmt::format("  \"{}\" := input[{}{}nS:S];\n", signal.name, t.drive_ns > 0 ? "0nS:P, " : "",
                          t.drive_ns);
  }
  return text + "end\n";
}

// The columns of the pattern; rows follow.
std::string wgl_pattern(const std::vector<TestSignal>& signals) {
  std::string text = "\npattern main (";
  for (std::size_t s = 0; s < signals.size(); ++s)
    text += fmt::format("{}\"{}\"", s == 0 ? "" : ", ", signals[s].name);
  return text + ")\n";
}

}  // namespace

std::string wgl_text(const CycleStream& stream) {
  std::string text = wgl_signals(stream.title, stream.signals);
  text += wgl_timeplate(stream.signals, stream.timing, [&](std::size_t s) { return pulsed(stream, s); });
  text += wgl_pattern(stream.signals);
  runs(stream, 1'000'000, [&](const TestCycle& cycle, std::uint64_t count) {
    if (!cycle.label.empty()) text += fmt::format("  {{ {} }}\n", cycle.label);
    text += count == 1 ? "  vector(tp) := [" : fmt::format("  repeat {} vector(tp) := [", count);
    for (const char c : cycle.states) {
      text += ' ';
      text += wgl_value(c);
    }
    text += " ];\n";
  });
  return text + "end\n\nend\n";
}

std::string wgl_text(const ScanTest& test) {
  std::string cells = "\nscancell\n", chains = "\nscanchain\n";
  std::string ports(test.signals.size(), '\0');  // of the chains, '-' in a scan row
  for (const ScanChain& chain : test.chains) {
    chains += fmt::format("  \"{}\" [\"{}\"", chain.name, chain.in);
    for (const std::string& cell : chain.cells) {
      cells += fmt::format("  \"{}\";\n", cell);
      chains += fmt::format(", \"{}\"", cell);
    }
    chains += fmt::format(", \"{}\"];\n", chain.out);
    for (std::size_t s = 0; s < test.signals.size(); ++s) {
      if (test.signals[s].name == chain.in || test.signals[s].name == chain.out) ports[s] = '-';
    }
  }
  std::string states = "\nscanstate\n", pattern = wgl_pattern(test.signals);
  std::size_t loads = 0;
  // Declares what the chains hold and gives the list that a scan row names it by.
  const auto declare = [&](const char* kind, const std::vector<std::string>& shifted) {
    std::string list;
    for (std::size_t c = 0; c < test.chains.size(); ++c) {
      const ScanChain& chain = test.chains[c];
      const std::string state = fmt::format("{}_{}{}", chain.name, kind, loads);
      states += fmt::format("  \"{}\" := \"{}\"(", state, chain.name);
      // The last cell's bit is shifted out first; of a load, the last bits stay in a shorter chain.
      const std::string& bits = shifted[c];
      const std::size_t length = chain.cells.size(), skipped = kind[0] == 'u' ? 0 : bits.size() - length;
      for (std::size_t i = length; i-- > 0;) states += wgl_value(bits[skipped + i]);
      states += ");\n";
      list += fmt::format("{}\"{}\":\"{}\"", c == 0 ? "" : ", ", chain.name, state);
    }
    return list;
  };
  for_each_step(test, [&](const ScanStep& step) {
    if (!step.label.empty()) pattern += fmt::format("  {{ {} }}\n", step.label);
    pattern += step.load == nullptr ? "  vector(tp) := [" : "  scan(tp) := [";
    for (std::size_t s = 0; s < step.states.size(); ++s) {
      pattern += ' ';
      pattern += step.load != nullptr && ports[s] != '\0' ? ports[s] : wgl_value(step.states[s]);
    }
    pattern += " ]";
    if (step.load != nullptr) {
      if (step.unload != nullptr)
        pattern += fmt::format(",\n    output [{}]", declare("unload", *step.unload));
      pattern += fmt::format(",\n    input [{}]", declare("load", *step.load));
      ++loads;
    }
    pattern += ";\n";
  });
  return wgl_signals(test.title, test.signals) + cells + "end\n" + chains + "end\n" +
         wgl_timeplate(test.signals, test.timing,
                       [&](std::size_t s) { return test.signals[s].name == test.clock; }) +
         states + "end\n" + pattern + "end\n\nend\n";
}

std::string evcd_text(const CycleStream& stream) {
  std::string header = "$version\n  meltstage\n$end\n$timescale\n  1 ps\n$end\n$scope module dut $end\n";
  for (std::size_t s = 0; s < stream.signals.size(); ++s)
    header += fmt::format("$var port 1 <{} {} $end\n", s, stream.signals[s].name);
  header += "$upscope $end\n$enddefinitions $end\n";
  return dump(stream, header, [&](std::size_t s, char value) {
    const char state = stream.signals[s].is_input ? (value == '1' ? 'U' : 'D')
                       : value == '1'             ? 'H'
                       : value == '0'             ? 'L'
                                                  : 'X';
    const bool low = state == 'D' || state == 'L', high = state == 'U' || state == 'H';
    return fmt::format("p{} {} {} <{}\n", state, high ? 0 : 6, low ? 0 : 6, s);
  });
}

std::string vcd_text(const CycleStream& stream) {
  std::string header = "$version meltstage $end\n$timescale 1 ps $end\n$scope module dut $end\n";
  for (std::size_t s = 0; s < stream.signals.size(); ++s)
    header += fmt::format("$var wire 1 {} {} $end\n", code_of(s), stream.signals[s].name);
  header += "$upscope $end\n$enddefinitions $end\n";
  return dump(stream, header,
              [&](std::size_t s, char value) { return fmt::format("{}{}\n", value, code_of(s)); });
}

std::string atp_text(const CycleStream& stream) {
  const std::vector<std::string> names = pin_names(stream);
  std::string text = renamed_told(stream, names, "//") + "import tset tp0;\n\nvector ($tset";
  for (const std::string& name : names) text += ", " + name;
  text += ")\n{\nstart_label pattern_st:\n";
  runs(stream, 65535, [&](const TestCycle& cycle, std::uint64_t count) {
    if (!cycle.label.empty()) text += fmt::format("// {}\n", cycle.label);
    text += count == 1 ? "> tp0" : fmt::format("repeat {} > tp0", count);
    for (const char c : cycle.states) {
      text += ' ';
      text += c == 'P' ? '1' : c;
    }
    text += ";\n";
  });
  return text + "}\n";
}

std::string avc_text(const CycleStream& stream) {
  const std::vector<std::string> names = pin_names(stream);
  std::string text = renamed_told(stream, names, "#") + "FORMAT";
  for (const std::string& name : names) text += " " + name;
  text += ";\n";
  runs(stream, 65535, [&](const TestCycle& cycle, std::uint64_t count) {
    text += fmt::format("R{} tp0 {}", count, cycle.states);
    text += cycle.label.empty() ? ";\n" : fmt::format("; # {}\n", cycle.label);
  });
  return text;
}

std::string mem_text(const CycleStream& stream) { return icarus_vectors(stream); }

}  // namespace meltstage::dft
