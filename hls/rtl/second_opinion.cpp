// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/second_opinion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <random>
#include <regex>
#include <sstream>
#include <vector>

#include "base/error.hpp"
#include "base/output_file.hpp"
#include "base/temporary_folder.hpp"
#include "hls/subprocess.hpp"

namespace meltstage::hls {
namespace {

constexpr const char* kClock = "clk_i";

enum class Level : std::uint8_t { kLow, kHigh, kUnknown };

Level inverted(Level level) {
  return level == Level::kUnknown ? level : level == Level::kLow ? Level::kHigh : Level::kLow;
}
Level both(Level a, Level b) {
  if (a == Level::kLow || b == Level::kLow) return Level::kLow;
  return a == Level::kHigh && b == Level::kHigh ? Level::kHigh : Level::kUnknown;
}

// The gates with values of three levels; flops begin unknown.
class Gates {
 public:
  explicit Gates(const Rtl& rtl)
      : rtl_(rtl),
        level_(1 + rtl.gates.inputs.size() + rtl.gates.ands.size(), Level::kUnknown),
        held_(rtl.flops.size(), Level::kUnknown) {
    level_[0] = Level::kLow;
  }

  Level of(std::uint32_t literal) const {
    return (literal & 1) != 0 ? inverted(level_[literal / 2]) : level_[literal / 2];
  }
  void set(std::uint32_t literal, Level level) {
    level_[literal / 2] = (literal & 1) != 0 ? inverted(level) : level;
  }
  // Everything that follows from pins and flops. A flop in reset shows its reset value at once, which may
  // reset others; a product may be an operand of another one.
  void settle() {
    for (std::size_t round = 0; round < rtl_.products.size() + rtl_.flops.size() + 2; ++round) {
      for (std::size_t i = 0; i < rtl_.gates.ands.size(); ++i)
        level_[1 + rtl_.gates.inputs.size() + i] = both(of(rtl_.gates.ands[i].a), of(rtl_.gates.ands[i].b));
      if (!flops_and_products_change()) return;
    }
  }
  void clock() {
    std::vector<Level> next;
    for (const RtlFlop& flop : rtl_.flops) next.push_back(selected(flop, of(flop.next)));
    held_ = std::move(next);
  }

 private:
  Level selected(const RtlFlop& flop, Level otherwise) const {
    const Level reset = of(flop.in_reset);
    if (reset == Level::kUnknown) return of(flop.reset_value) == otherwise ? otherwise : Level::kUnknown;
    return reset == Level::kHigh ? of(flop.reset_value) : otherwise;
  }
  bool change(std::uint32_t literal, Level level) {
    if (of(literal) == level) return false;
    set(literal, level);
    return true;
  }
  bool flops_and_products_change() {
    bool changed = false;
    for (std::size_t i = 0; i < rtl_.flops.size(); ++i)
      changed |= change(rtl_.flops[i].now, selected(rtl_.flops[i], held_[i]));
    for (const RtlProduct& product : rtl_.products) {
      const auto a = number(product.a), b = number(product.b);
      for (std::size_t i = 0; i < product.result.size(); ++i)
        if (product.result[i] != 0)
          changed |= change(product.result[i], !a || !b                  ? Level::kUnknown
                                               : (*a * *b >> i & 1) != 0 ? Level::kHigh
                                                                         : Level::kLow);
    }
    return changed;
  }
  std::optional<std::uint64_t> number(const std::vector<std::uint32_t>& bits) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bits.size(); ++i) {
      const Level level = of(bits[i]);
      if (level == Level::kUnknown) return std::nullopt;
      if (level == Level::kHigh) value |= std::uint64_t{1} << i;
    }
    return value;
  }

  const Rtl& rtl_;
  std::vector<Level> level_;  // by node
  std::vector<Level> held_;   // by flop
};

std::string bit_of(const std::string& port, unsigned width, unsigned bit) {
  return width == 1 ? port : fmt::format("{}[{}]", port, bit);
}

// Inputs but the clock and outputs, the highest bit of the first port first.
std::vector<std::string> bits_of(const Rtl& rtl, bool inputs) {
  std::vector<std::string> bits;
  for (const auto& [name, port] : rtl.netlist.ports) {
    if (port.is_input != inputs || name == kClock) continue;
    for (unsigned bit = port.width; bit-- > 0;) bits.push_back(bit_of(name, port.width, bit));
  }
  return bits;
}

std::string test_bench(const Rtl& rtl, const std::string& top, std::size_t clocks) {
  std::string declarations, connections, in, out;
  const auto join = [](std::string& list, const std::string& name) {
    list += (list.empty() ? "" : ", ") + name;
  };
  for (const auto& [name, port] : rtl.netlist.ports) {
    declarations += fmt::format("  {} [{}:0] {};\n", port.is_input ? "reg" : "wire", port.width - 1, name);
    join(connections, fmt::format(".{0}({0})", name));
    if (name != kClock) join(port.is_input ? in : out, name);
  }
  return fmt::format(
      "module hls_bench;\n{0}  {1} dut ({2});\n  reg [{3}:0] pins [0:{4}];\n  integer i;\n  initial begin\n"
      "    $readmemb(\"pins.txt\", pins);\n    clk_i = 0;\n    for (i = 0; i <= {4}; i = i + 1) begin\n"
      "      {{{5}}} = pins[i];\n      #1 $display(\"%b\", {{{6}}});\n      clk_i = 1;\n      #1 clk_i = "
      "0;\n      #1 ;\n"
      "    end\n  end\nendmodule\n",
      declarations, top, connections, bits_of(rtl, true).size() - 1, clocks - 1, in, out);
}

// Of these pins those that reset flops at once, and the level at which they do.
std::vector<std::pair<std::string, bool>> resets_of(const Rtl& rtl, const std::vector<std::string>& pins) {
  std::vector<std::pair<std::string, bool>> resets;
  for (const std::string& name : pins) {
    const auto pin = rtl.inputs.find(name);
    if (pin == rtl.inputs.end()) continue;
    for (const bool level : {false, true}) {
      Gates gates(rtl);
      gates.set(pin->second, level ? Level::kHigh : Level::kLow);
      gates.settle();
      if (std::any_of(rtl.flops.begin(), rtl.flops.end(), [&](const RtlFlop& flop) {
            return gates.of(flop.in_reset) == Level::kHigh && flop.in_reset > 1;
          }))
        resets.emplace_back(name, level);
    }
  }
  return resets;
}

}  // namespace

std::string compare_with_icarus(const RtlSources& sources, const Rtl& rtl, unsigned clocks,
                                std::uint64_t seed) {
  constexpr std::size_t kMostGateSteps = 50'000'000;
  const auto skipped = [](const std::string& why) { return "RTL: not run beside Icarus: " + why; };
  if (clocks == 0) return skipped("--simulate 0");
  clocks = static_cast<unsigned>(
      std::min<std::size_t>(clocks, kMostGateSteps / (rtl.gates.ands.size() + rtl.flops.size() + 1)));
  const std::vector<std::string> in = bits_of(rtl, true), out = bits_of(rtl, false);
  if (clocks < 10 || in.empty() || out.empty()) return skipped("too large, or without pins");

  const TemporaryFolder folder;
  write_whole(folder.path() / "bench.v", test_bench(rtl, sources.top, clocks));
  std::vector<std::string> call = {"-g2012",    "-DSYNTHESIS", "-s",
                                   "hls_bench", "-o",          (folder.path() / "bench").string()};
  for (const auto& include : sources.include_folders) call.push_back("-I" + include.string());
  call.push_back((folder.path() / "bench.v").string());
  for (const auto& file : sources.files) call.push_back(std::filesystem::absolute(file).string());
  if (run_tool("iverilog", "iverilog", call).status != 0) return skipped("it does not take these files");

  std::mt19937_64 random(seed);
  const auto resets = resets_of(rtl, in);
  std::vector<std::vector<bool>> pins(clocks, std::vector<bool>(in.size()));
  std::string text;
  for (unsigned i = 0; i < clocks; ++i) {
    for (std::size_t k = 0; k < in.size(); ++k) {
      pins[i][k] = random() % 2 != 0;
      for (const auto& [name, level] : resets)
        if (name == in[k]) pins[i][k] = (i < 2 || random() % 32 == 0) == level;
      text += pins[i][k] ? '1' : '0';
    }
    text += '\n';
  }
  write_whole(folder.path() / "pins.txt", text);
  const Finished run = run_tool(
      "env", "coreutils", {"-C", folder.path().string(), "vvp", "-n", (folder.path() / "bench").string()});
  std::vector<std::string> lines;
  std::istringstream said(run.output);
  for (std::string line; std::getline(said, line);)
    if (line.size() == out.size() && line.find_first_not_of("01xz") == std::string::npos)
      lines.push_back(line);
  if (run.status != 0 || lines.size() != clocks) return skipped("its run did not end as it should");

  Gates gates(rtl);
  std::size_t compared = 0;
  for (unsigned i = 0; i < clocks; ++i) {
    for (std::size_t k = 0; k < in.size(); ++k)
      if (const auto pin = rtl.inputs.find(in[k]); pin != rtl.inputs.end())
        gates.set(pin->second, pins[i][k] ? Level::kHigh : Level::kLow);
    gates.settle();
    for (std::size_t k = 0; k < out.size(); ++k) {
      const auto pin = rtl.outputs.find(out[k]);
      if (pin == rtl.outputs.end()) continue;
      const Level level = gates.of(pin->second);
      if (level == Level::kUnknown || lines[i][k] == 'x' || lines[i][k] == 'z') continue;
      ++compared;
      if ((level == Level::kHigh) != (lines[i][k] == '1'))
        throw UserError(
            fmt::format("RTL: found {} = {} as Yosys reads it and {} as Icarus does, in clock {} of a random "
                        "run from reset, "
                        "expected the same; one of them reads it otherwise than IEEE 1800 "
                        "(docs/verify/proof.md); --simulate 0 "
                        "asks Icarus nothing",
                        out[k], level == Level::kHigh ? 1 : 0, lines[i][k], i + 1));
    }
    gates.clock();
  }
  return fmt::format("RTL: as Yosys reads it, it ran like Icarus for {} clocks, {} values compared", clocks,
                     compared);
}

}  // namespace meltstage::hls
