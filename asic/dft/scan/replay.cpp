// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <random>
#include <set>
#include <span>
#include <sstream>

#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/workers.hpp"
#include "asic/dft/scan/simulator.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/first_line.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

// A piece of the stream that one lane runs, and from where on its strobes count.
struct Piece {
  std::size_t begin, compare_from, end;
};

std::vector<Piece> pieces_of(const CycleStream& stream, const std::string& scan_enable) {
  const std::size_t total = stream.cycles.size();
  std::vector<std::size_t> rises;
  std::size_t enable = 0;
  while (enable < stream.signals.size() && stream.signals[enable].name != scan_enable) ++enable;
  if (enable < stream.signals.size()) {
    for (std::size_t i = 0; i < total; ++i) {
      if (stream.cycles[i].states[enable] == '1' && (i == 0 || stream.cycles[i - 1].states[enable] != '1'))
        rises.push_back(i);
    }
  }
  if (rises.size() < 2) return {{0, 0, total}};
  std::vector<std::size_t> loaded;  // first cycle behind each load
  for (const std::size_t rise : rises) {
    std::size_t i = rise;
    while (i < total && stream.cycles[i].states[enable] == '1') ++i;
    loaded.push_back(i);
  }
  std::vector<Piece> pieces{{0, 0, loaded[0]}};
  for (std::size_t k = 0; k + 1 < rises.size(); ++k) pieces.push_back({rises[k], loaded[k], loaded[k + 1]});
  if (loaded.back() < total) pieces.push_back({rises.back(), loaded.back(), total});
  return pieces;
}

// Neither 0, 1 nor a clock pulse: the stream says nothing of this input.
bool is_open(char state) { return state != '0' && state != '1' && state != 'P'; }

// Lanes of a word: piece k of a batch with fill f.
constexpr std::size_t kPieces = kLanes / kFills;
constexpr std::size_t lane_of(std::size_t piece, std::size_t fill) { return piece * kFills + fill; }

struct Done {
  ReplayResult result;
  std::size_t first_cycle = ~std::size_t{0};  // with a mismatch
};

// Pieces that one word runs, each with every fill.
struct Batch {
  std::span<const Piece> pieces;
  std::mt19937_64 random;
  std::vector<Word> values, states;  // by node, by flop
  Done done;
};

class Player {
 public:
  Player(const CaptureView& view, const CycleStream& stream, std::uint64_t seed, const ReplayFault& fault)
      : view_(view), stream_(stream), fault_(fault), seed_(seed) {
    require_runnable(stream);
    for (const std::string& name : view.input_ports) input_.push_back(signal(name, true));
    for (std::size_t i = 0; i < stream.signals.size(); ++i) {
      if (stream.signals[i].is_input) continue;
      const auto port = std::find(view.output_ports.begin(), view.output_ports.end(), stream.signals[i].name);
      if (port == view.output_ports.end())
        throw UserError(fmt::format("{}: found output signal {}, expected an output port of the netlist",
                                    stream.title, stream.signals[i].name));
      output_.emplace_back(
          i, view.circuit.outputs()[static_cast<std::size_t>(port - view.output_ports.begin())]);
    }
    require_clocks(view, stream);
    for (std::size_t f = 0; f < view.flops.size(); ++f) {
      const auto node = view.node_of_net.find(view.flops[f].reset);
      reset_node_.push_back(view.flops[f].has_reset && node != view.node_of_net.end() ? node->second
                                                                                      : kNoNode);
      if (fault.line && resets_by(view, f, fault.line->node, fault.line->pin)) stuck_reset_ = f;
    }
    for (std::size_t piece = 0; piece < kPieces; ++piece) {
      zeros_.set(lane_of(piece, 0), true);
      ones_.set(lane_of(piece, 1), true);
    }
  }

  ReplayResult run(std::span<const Piece> pieces, const Progress& progress) const {
    std::vector<Done> done((pieces.size() + kPieces - 1) / kPieces);
    std::atomic<std::size_t> next{0};
    in_parallel([&](unsigned worker) {
      for (std::size_t b = next++; b < done.size(); b = next++) {
        if (worker == 0) tell(progress, "replay", b, done.size());
        const std::size_t first = b * kPieces;
        Batch batch{pieces.subspan(first, std::min(kPieces, pieces.size() - first)),
                    std::mt19937_64(seed_ + b),
                    std::vector<Word>(view_.circuit.size()),
                    {},
                    {}};
        run(batch);
        done[b] = std::move(batch.done);
      }
    });
    ReplayResult all;
    all.cycles = stream_.cycles.size();
    std::size_t first_cycle = ~std::size_t{0};
    for (Done& batch : done) {
      all.strobes += batch.result.strobes;
      all.mismatches += batch.result.mismatches;
      for (std::size_t f = 0; f < kFills; ++f) all.by_fill[f] += batch.result.by_fill[f];
      if (batch.first_cycle >= first_cycle) continue;
      first_cycle = batch.first_cycle;
      all.first = std::move(batch.result.first);
    }
    return all;
  }

 private:
  std::size_t signal(const std::string& name, bool input) const {
    for (std::size_t i = 0; i < stream_.signals.size(); ++i) {
      if (stream_.signals[i].name == name && stream_.signals[i].is_input == input) return i;
    }
    throw UserError(fmt::format("{}: found no input signal {}, expected every input port of the netlist",
                                stream_.title, name));
  }
  void evaluate(Batch& batch) const {
    if (fault_.line)
      simulate_faulty(view_.circuit, *fault_.line, batch.values);
    else
      simulate_values(view_.circuit, batch.values);
  }
  // Asynchronous resets; true when a state changed.
  bool apply_resets(Batch& batch) const {
    bool changed = false;
    for (std::size_t f = 0; f < view_.flops.size(); ++f) {
      if (reset_node_[f] == kNoNode) continue;
      for (std::size_t p = 0; p < kLanes / 64; ++p) {
        const std::uint64_t stuck = fault_.line && fault_.line->stuck ? ~std::uint64_t{0} : 0;
        const std::uint64_t net = stuck_reset_ == f ? stuck : batch.values[reset_node_[f]].part[p];
        std::uint64_t& word = batch.states[f].part[p];
        const std::uint64_t active = view_.flops[f].reset_low ? ~net : net;
        const std::uint64_t next = view_.flops[f].reset_value ? word | active : word & ~active;
        changed = changed || next != word;
        word = next;
      }
    }
    return changed;
  }
  void put_states(Batch& batch) const {
    for (std::size_t f = 0; f < batch.states.size(); ++f)
      batch.values[view_.circuit.inputs()[view_.input_ports.size() + f]] = batch.states[f];
  }
  // An unknown: by lane what its fill says.
  Word unknown(Batch& batch) const {
    Word word;
    for (std::size_t p = 0; p < word.part.size(); ++p)
      word.part[p] = (batch.random() & ~zeros_.part[p]) | ones_.part[p];
    return word;
  }

  void run(Batch& batch) const {
    for (std::size_t f = 0; f < view_.flops.size(); ++f) batch.states.push_back(unknown(batch));
    std::size_t steps = 0;
    for (const Piece& piece : batch.pieces) steps = std::max(steps, piece.end - piece.begin);
    for (std::size_t t = 0; t < steps; ++t) {
      const Word clocked = drive(batch, t);
      put_states(batch);
      evaluate(batch);
      while (apply_resets(batch)) {  // a flop that is reset may reset others
        put_states(batch);
        evaluate(batch);
      }
      compare(batch, t);
      clock(batch, clocked);
    }
  }
  // Inputs of the t-th cycle of each piece; the lanes that are clocked.
  Word drive(Batch& batch, std::size_t t) const {
    Word clocked;
    for (std::size_t i = 0; i < input_.size(); ++i) {
      Word& word = batch.values[view_.circuit.inputs()[i]];
      word = unknown(batch);
      for (std::size_t k = 0; k < batch.pieces.size(); ++k) {
        const std::size_t at = batch.pieces[k].begin + t;
        const char state = at < batch.pieces[k].end ? stream_.cycles[at].states[input_[i]] : '0';
        if (!is_open(state)) word.set(lane_of(k, 0), kFills, state == '1');
        if (state == 'P' && view_.clock_ports[i] != 0) clocked.set(lane_of(k, 0), kFills, true);
      }
    }
    return clocked;
  }
  void compare(Batch& batch, std::size_t t) const {
    Done& done = batch.done;
    for (std::size_t k = 0; k < batch.pieces.size(); ++k) {
      const Piece& piece = batch.pieces[k];
      const std::size_t at = piece.begin + t;
      if (at < piece.compare_from || at >= piece.end) continue;
      const std::string& now = stream_.cycles[at].states;
      for (const auto& [s, node] : output_) {
        if (now[s] != 'H' && now[s] != 'L') continue;
        ++done.result.strobes;
        std::size_t wrong = 0;
        for (std::size_t f = 0; f < kFills; ++f) {
          if (batch.values[node].bit(lane_of(k, f)) == (now[s] == 'H')) continue;
          ++done.result.by_fill[f];
          ++wrong;
        }
        if (wrong == 0) continue;
        ++done.result.mismatches;
        if (at >= done.first_cycle) continue;
        done.first_cycle = at;
        done.result.first = fmt::format("cycle {} ({}): {}: found {}, expected {}", at, label_before(at),
                                        stream_.signals[s].name,
                                        wrong != kFills ? "what hangs on an unknown"
                                        : now[s] == 'H' ? "0"
                                                        : "1",
                                        now[s]);
      }
    }
  }
  std::string label_before(std::size_t at) const {
    for (std::size_t i = at + 1; i-- > 0;) {
      if (!stream_.cycles[i].label.empty()) return stream_.cycles[i].label;
    }
    return "start";
  }
  void clock(Batch& batch, const Word& clocked) const {
    const std::size_t outs = view_.output_ports.size();
    for (std::size_t f = 0; f < batch.states.size(); ++f) {
      if (fault_.dead_clock && *fault_.dead_clock == f) continue;
      const Word& next = batch.values[view_.circuit.outputs()[outs + f]];
      Word& state = batch.states[f];
      for (std::size_t p = 0; p < kLanes / 64; ++p)
        state.part[p] = (state.part[p] & ~clocked.part[p]) | (next.part[p] & clocked.part[p]);
    }
  }

  const CaptureView& view_;
  const CycleStream& stream_;
  const ReplayFault& fault_;
  std::uint64_t seed_;
  std::vector<std::size_t> input_;                    // signal of each input port
  std::vector<std::pair<std::size_t, Node>> output_;  // signal and node of each output port
  std::vector<Node> reset_node_;
  std::optional<std::size_t> stuck_reset_;
  Word zeros_, ones_;  // lanes of fills 0 and 1
};

std::string escaped(const std::string& name) { return "\\" + name + " "; }

std::string verilog_expression(const Expression& e) {
  const char* joint = e.op == Expression::Op::all ? " & " : e.op == Expression::Op::any ? " | " : " ^ ";
  switch (e.op) {
    case Expression::Op::zero:
      return "1'b0";
    case Expression::Op::one:
      return "1'b1";
    case Expression::Op::pin:
      return e.pin;
    case Expression::Op::inv:
      return "~(" + verilog_expression(e.args[0]) + ")";
    default:
      break;
  }
  std::string text;
  for (const Expression& arg : e.args) text += (text.empty() ? "(" : joint) + verilog_expression(arg);
  return text + ")";
}

}  // namespace

void require_clocks(const CaptureView& view, const CycleStream& stream) {
  for (std::size_t i = 0; i < view.input_ports.size(); ++i) {
    const auto signal =
        std::find(stream.signals.begin(), stream.signals.end(), TestSignal{view.input_ports[i], true});
    if (signal == stream.signals.end()) continue;
    const auto s = static_cast<std::size_t>(signal - stream.signals.begin());
    const bool is_clock = view.clock_ports[i] != 0;
    const bool is_read = !view.circuit.fanout(view.circuit.inputs()[i]).empty();
    if (!is_clock && (view.flops.empty() || !is_read)) continue;
    std::uint64_t at = 0;
    for (const TestCycle& cycle : stream.cycles) {
      const char state = cycle.states[s];
      if (is_clock && state != '0' && state != 'P')
        throw UserError(fmt::format("{}: found {} of the clock {} in cycle {}, expected 0 or a pulse",
                                    stream.title, state, view.input_ports[i], at));
      if (!is_clock && state == 'P')
        throw UserError(
            fmt::format("{}: found a pulse of {} in cycle {}, which clocks no flop, expected it "
                        "to keep its level through the cycle",
                        stream.title, view.input_ports[i], at));
      at += cycle.count;
    }
  }
}

ReplayResult replay(const CaptureView& view, const CycleStream& stream, const std::string& scan_enable,
                    std::uint64_t seed, const ReplayFault& fault, const Progress& progress) {
  const CycleStream single = unrolled(stream);
  return Player(view, single, seed, fault).run(pieces_of(single, scan_enable), progress);
}

void name_as_ports(CycleStream& stream, const Netlist& netlist) {
  std::set<std::string> ports;
  for (const Port& port : netlist.ports) {
    for (std::size_t i = 0; i < port.bits.size(); ++i) ports.insert(port.bit_name(i));
  }
  const auto rename = [&](std::string& name) {
    const std::size_t bracket = name.find('[');
    if (bracket == std::string::npos || name.back() != ']' || ports.count(name) != 0) return;
    const std::string split =
        name.substr(0, bracket) + "_" + name.substr(bracket + 1, name.size() - bracket - 2);
    if (ports.count(split) != 0) name = split;
  };
  for (TestSignal& signal : stream.signals) rename(signal.name);
  for (ScanChain& chain : stream.chains) {
    rename(chain.in);
    rename(chain.out);
  }
}

std::string cell_models(const Netlist& netlist, const CellLibrary& library) {
  std::set<std::string> used;
  for (const Instance& instance : netlist.instances) used.insert(instance.type);
  std::string text;
  for (const std::string& type : used) {
    const auto found = library.find(type);
    if (found == library.end())
      throw UserError(fmt::format("{}: found type {}, expected a cell of the library", netlist.file, type));
    const Cell& cell = found->second;
    std::string ports, body;
    for (const CellPin& pin : cell.pins) {
      ports += (ports.empty() ? "" : ", ") + std::string(pin.is_output ? "output " : "input ") + pin.name;
      if (pin.is_output && pin.function)
        body += fmt::format("  assign {} = {};\n", pin.name, verilog_expression(*pin.function));
    }
    if (cell.flop) {
      const Flop& flop = *cell.flop;
      const auto edge = [](const Expression& e) {
        return e.op == Expression::Op::inv ? "negedge " + verilog_expression(e.args[0])
                                           : "posedge " + verilog_expression(e);
      };
      std::string events = edge(flop.clocked_on), resets, state_n = "~" + flop.state;
      if (flop.clear && flop.preset) {  // while both are active
        const auto level = [](char state) { return state == 'L' ? "1'b0" : state == 'H' ? "1'b1" : "1'bx"; };
        const std::string both =
            fmt::format("({}) & ({})", verilog_expression(*flop.clear), verilog_expression(*flop.preset));
        resets = fmt::format("    if ({}) {} <= {}; else\n", both, flop.state, level(flop.state_of_both));
        state_n = fmt::format("{} ? {} : ~{}", both, level(flop.state_n_of_both), flop.state);
      }
      if (flop.clear) {
        events += " or " + edge(*flop.clear);
        resets += fmt::format("    if ({}) {} <= 1'b0; else\n", verilog_expression(*flop.clear), flop.state);
      }
      if (flop.preset) {
        events += " or " + edge(*flop.preset);
        resets += fmt::format("    if ({}) {} <= 1'b1; else\n", verilog_expression(*flop.preset), flop.state);
      }
      body = fmt::format("  reg {};\n  wire {} = {};\n  always @({})\n{}    {} <= {};\n", flop.state,
                         flop.state_n, state_n, events, resets, flop.state,
                         verilog_expression(flop.next_state)) +
             body;
    }
    if (cell.gate) {
      const ClockGate& gate = *cell.gate;
      body = fmt::format("  reg open;\n  always @* if (!{}) open = {}{};\n  assign {} = {} & open;\n",
                         gate.clock, gate.enable, gate.test.empty() ? "" : " | " + gate.test, gate.out,
                         gate.clock);
    }
    text += fmt::format("module {}({});\n{}endmodule\n", escaped(type), ports, body);
  }
  return text;
}

std::string icarus_vectors(const CycleStream& stream) {
  std::string text;
  for (const TestCycle& cycle :
       stream.cycles) {  // two digits a signal: value, and whether it is a clock pulse or compared
    std::string line;
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      const char c = cycle.states[s];
      if (stream.signals[s].is_input)
        line += c == '1' ? "10" : c == 'P' ? "01" : is_open(c) ? "x0" : "00";
      else
        line += c == 'L' ? "01" : c == 'H' ? "11" : "00";
    }
    line += '\n';
    for (std::uint64_t i = 0; i < cycle.count; ++i) text += line;
  }
  return text;
}

namespace {

constexpr std::uint64_t kTold = 1000;       // steps of the progress
constexpr std::uint64_t kMostUntold = 100;  // cycles in a step: a large netlist takes seconds for them
constexpr const char* kDone = "done ";

// `instance`: the device under test, with its ports at s0, s1 ... by signal.
std::string bench_of(const std::string& instance, const CycleStream& stream,
                     const std::filesystem::path& sdf) {
  require_runnable(stream);
  std::string text = "`timescale 1ns/1ps\nmodule bench;\n";
  const std::size_t width = 2 * stream.signals.size();
  const auto value_bit = [&](std::size_t s) { return fmt::format("v[{}]", width - 1 - 2 * s); };
  const auto flag_bit = [&](std::size_t s) { return fmt::format("v[{}]", width - 2 - 2 * s); };
  text += fmt::format("  reg [{}:0] v;\n  integer file, got, strobes = 0, mismatches = 0, cycle = 0;\n",
                      width - 1);
  for (std::size_t s = 0; s < stream.signals.size(); ++s)
    text += fmt::format("  {} s{};\n", stream.signals[s].is_input ? "reg" : "wire", s);
  text += "  " + instance;
  TestTiming t = stream.timing;
  if (!has_strobe(stream)) t.strobe_ns = t.drive_ns;
  if (!has_pulse(stream)) t.clock_rise_ns = t.clock_fall_ns = t.strobe_ns;
  if (!sdf.empty()) text += fmt::format("  initial $sdf_annotate(\"{}\", dut);\n", sdf.string());
  text +=
      "  initial begin\n    file = $fopen(\"vectors.txt\", \"r\");\n    got = $fscanf(file, \"%b\\n\", "
      "v);\n    while (got == 1) begin\n";
  std::string drive, rise, fall, check;
  for (std::size_t s = 0; s < stream.signals.size(); ++s) {
    if (stream.signals[s].is_input) {
      drive += fmt::format("      s{} = {};\n", s, value_bit(s));
      rise += fmt::format("      if ({}) s{} = 1'b1;\n", flag_bit(s), s);
      fall += fmt::format("      if ({}) s{} = 1'b0;\n", flag_bit(s), s);
    } else {
      check += fmt::format(
          "      if ({0}) begin strobes = strobes + 1; if (s{1} !== {2}) begin mismatches = mismatches + 1; "
          "if (mismatches == 1) $display(\"cycle %0d: {3}: found "
          "%b, expected %b\", cycle, s{1}, {2}); end end\n",
          flag_bit(s), s, value_bit(s), stream.signals[s].name);
    }
  }
  text += fmt::format("      #{};\n{}      #{};\n{}      #{};\n{}      #{};\n{}      #{};\n", t.drive_ns,
                      drive, t.strobe_ns - t.drive_ns, check, t.clock_rise_ns - t.strobe_ns, rise,
                      t.clock_fall_ns - t.clock_rise_ns, fall, t.period_ns - t.clock_fall_ns);
  return text +
         fmt::format(
             "      cycle = cycle + 1;\n      if (cycle % {} == 0) begin $display(\"{}%0d\", "
             "cycle); $fflush; end\n",
             std::clamp<std::uint64_t>(cycle_count(stream) / kTold, 1, kMostUntold), kDone) +
         "      got = $fscanf(file, \"%b\\n\", v);\n    end\n    $display(\"%0d "
         "cycles, %0d strobes, %0d mismatches\", cycle, strobes, "
         "mismatches);\n    $finish;\n  end\nendmodule\n";
}

// Reads the line that the bench ends with.
std::optional<ReplayResult> verdict_in(const std::string& line) {
  ReplayResult result;
  int end = 0;
  if (std::sscanf(line.c_str(), "%zu cycles, %zu strobes, %zu mismatches%n", &result.cycles, &result.strobes,
                  &result.mismatches, &end) != 3 ||
      static_cast<std::size_t>(end) != line.size())
    return std::nullopt;
  return result;
}

std::string seconds(std::chrono::milliseconds time) {
  return fmt::format("{:g} s", static_cast<double>(time.count()) / 1000);
}

// What the bench in `work` says of the Verilog in `source`; `files` are compiled. `complaint` reads what
// Icarus says beside the verdict.
ReplayResult verdict_of_icarus(const std::filesystem::path& work, const std::string& source,
                               const std::vector<std::string>& files, std::uint64_t cycles,
                               const IcarusLimits& limits, const Progress& progress,
                               const std::function<void(const std::string&)>& complaint) {
  tell(progress, "compiling", 0, 1);
  // what it leaves goes with the folder
  std::vector<std::string> compile = {
      "env", "TMPDIR=" + work.string(), "iverilog", "-g2012", "-s", "bench", "-o", "bench.vvp"};
  compile.insert(compile.end(), files.begin(), files.end());
  const ProgramEnd compiled =
      run_program(compile, work, limits.compile, [](const std::string&) { return false; });
  if (compiled.stopped)
    throw UserError(
        fmt::format("{}: Icarus was stopped: it had not compiled it after {}, expected Verilog "
                    "that is done by then",
                    source, seconds(limits.compile)));
  complaint(compiled.output);
  if (compiled.status != 0)
    throw UserError(fmt::format("{}: Icarus can't compile it (exit status {}): {}", source, compiled.status,
                                shown(first_line(compiled.output))));
  std::uint64_t done = 0;
  std::optional<ReplayResult> verdict;
  const std::size_t mark = std::strlen(kDone);
  const ProgramEnd ran =
      run_program({"vvp", "-n", "bench.vvp"}, work, limits.silence, [&](const std::string& line) {
        if (const auto found = verdict_in(line)) verdict = found;
        if (line.compare(0, mark, kDone) != 0) return false;
        const std::uint64_t now = std::strtoull(line.c_str() + mark, nullptr, 10);
        if (now <= done || now > cycles) return false;
        done = now;
        tell(progress, "replay in Icarus", done, cycles);
        return true;
      });
  if (ran.stopped)
    throw UserError(
        fmt::format("{}: Icarus was stopped: nothing went on for {} behind cycle {} of {}, expected Verilog "
                    "in which time "
                    "goes on; is there a loop without a delay?",
                    source, seconds(limits.silence), done, cycles));
  complaint(ran.output);
  if (!verdict || verdict->cycles != cycles)
    throw UserError(fmt::format(
        "{}: Icarus ended behind cycle {} of {} (exit status {}){}{}, expected Verilog that runs to the "
        "end of the vectors, without $finish and $stop",
        source, done, cycles, ran.status, ran.output.empty() ? " without a word" : ": ",
        shown(first_line(ran.output))));
  if (verdict->mismatches != 0) {
    const std::size_t first = std::min(ran.output.find("cycle "), ran.output.size());
    verdict->first = ran.output.substr(first, ran.output.find('\n', first) - first);
  }
  return *verdict;
}

void write_work(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw UserError(fmt::format("{}: can't be written", path.string()));
}

// Icarus 11 passes over them without a word.
void refuse_wire_delays(const std::filesystem::path& sdf) {
  std::istringstream file(read_file(sdf, "an SDF file"));
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.find("(INTERCONNECT ") != std::string::npos)
      throw UserError(
          fmt::format("{}:{}: found INTERCONNECT, which Icarus leaves out, expected the delays of wires in "
                      "the paths behind them; asic/flow/fold_wires.py FILE OUT puts them there",
                      sdf.string(), number));
  }
}

// Icarus keeps one delay path for a net at two inputs of a cell, so the second input gets a net of its own.
std::string verilog_text_for_delays(Netlist netlist, const CellLibrary& library) {
  std::string assigns;
  for (Instance& instance : netlist.instances) {
    std::set<Net> seen;
    const auto cell = library.find(instance.type);
    if (cell == library.end())
      throw UserError(fmt::format("{}: cell {}: found type {}, expected a cell of the library", netlist.file,
                                  instance.name, instance.type));
    for (const CellPin& pin : cell->second.pins) {
      const auto connected = instance.pins.find(pin.name);
      if (pin.is_output || connected == instance.pins.end()) continue;
      Net& net = connected->second;
      if (net < 2 || seen.insert(net).second) continue;
      assigns += fmt::format("  assign n{} = n{};\n", netlist.next_net, net);
      net = netlist.next_net++;
    }
  }
  std::string text = verilog_text(netlist);
  return text.insert(text.rfind("endmodule"), assigns);
}

}  // namespace

std::string icarus_bench(const Netlist& netlist, const CycleStream& stream,
                         const std::filesystem::path& sdf) {
  const auto index = [&](const std::string& name) {
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      if (stream.signals[s].name == name) return fmt::format("s{}", s);
    }
    throw UserError(
        fmt::format("{}: found no signal {}, expected every port of the netlist", stream.title, name));
  };
  std::string instance = escaped(netlist.top) + "dut (";
  const char* separator = "";
  for (const Port& port : netlist.ports) {
    std::string bits;
    for (std::size_t i = port.bits.size(); i-- > 0;)
      bits += (bits.empty() ? "" : ", ") + index(port.bit_name(i));
    instance += fmt::format("{}.{}({{{}}})", separator, escaped(port.name), bits);
    separator = ", ";
  }
  return bench_of(instance + ");\n", stream, sdf);
}

ReplayResult replay_in_icarus(const Netlist& netlist, const CellLibrary& library, const CycleStream& stream,
                              const std::filesystem::path& work, const IcarusDelays& delays,
                              const Progress& progress, const IcarusLimits& limits) {
  write_work(work / "netlist.v",
             delays.sdf.empty() ? verilog_text(netlist) : verilog_text_for_delays(netlist, library));
  write_work(
      work / "bench.v",
      icarus_bench(netlist, stream, delays.sdf.empty() ? delays.sdf : std::filesystem::absolute(delays.sdf)));
  std::vector<std::string> files = {"bench.v", "netlist.v", "cells.v"};
  if (delays.sdf.empty()) {
    write_work(work / "cells.v", cell_models(netlist, library));
  } else {
    refuse_wire_delays(delays.sdf);
    files.back() = std::filesystem::absolute(delays.cells).string();
    files.insert(files.begin(), {"-gspecify", "-Tmax"});  // OpenSTA writes no typical delays
  }
  write_work(work / "vectors.txt", icarus_vectors(stream));
  return verdict_of_icarus(
      work, netlist.file, files, cycle_count(stream), limits, progress, [&](const std::string& output) {
        // A delay that finds no path in the cells, or a file that can't be read, is told and passed over
        // there.
        const std::size_t at = std::min(output.find("SDF WARNING"), output.find("SDF ERROR"));
        if (at != std::string::npos)
          throw UserError(fmt::format("{}: found {}, expected delays of this netlist and these cells",
                                      delays.sdf.string(), output.substr(at, output.find('\n', at) - at)));
      });
}

ReplayResult replay_verilog_in_icarus(const std::filesystem::path& verilog, const CycleStream& stream,
                                      const std::filesystem::path& work, const Progress& progress,
                                      const IcarusLimits& limits) {
  std::istringstream file(read_file(verilog, "a Verilog netlist"));
  std::string top;
  for (std::string line; top.empty() && std::getline(file, line);) {
    if (line.rfind("module ", 0) == 0) top = line.substr(7, line.find_first_of(" (;", 7) - 7);
  }
  if (top.empty())
    throw UserError(
        fmt::format("{}: found no module, expected Verilog of what was read back", verilog.string()));
  std::string instance = escaped(top) + "dut (";
  for (std::size_t s = 0; s < stream.signals.size(); ++s)
    instance += fmt::format("{}.{}(s{})", s == 0 ? "" : ", ", escaped(stream.signals[s].name), s);
  write_work(work / "bench.v", bench_of(instance + ");\n", stream, {}));
  write_work(work / "vectors.txt", icarus_vectors(stream));
  return verdict_of_icarus(
      work, verilog.string(), {"-Wportbind", "bench.v", std::filesystem::absolute(verilog).string()},
      cycle_count(stream), limits, progress, [&](const std::string& output) {
        for (const char* complaint : {"is not a port of", "dangling input port"}) {
          const std::size_t at = output.find(complaint);
          if (at == std::string::npos) continue;
          const std::size_t begin = output.rfind('\n', at) + 1;
          throw UserError(fmt::format("{}: found other ports than the signals of {} ({}), expected the same",
                                      verilog.string(), stream.title,
                                      output.substr(begin, output.find('\n', at) - begin)));
        }
      });
}

}  // namespace meltstage::dft
