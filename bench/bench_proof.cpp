// SPDX-License-Identifier: Apache-2.0
// The model proved to be the RTL, by `meltstage hls` as a user runs it: bits, time, what becomes of changed
// gates; and with PDK_ROOT the area of the chip that is generated from the model beside the one by hand.
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <regex>
#include <string>

#include "base/error.hpp"
#include "bench/bench.hpp"
#include "bench/data_file.hpp"
#include "bench/process_output.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;

constexpr double kMostMinutes = 10.0;
constexpr double kMostArea = 1.25;  // generated / by hand
constexpr const char* kCells = "ihp-sg13g2/libs.ref/sg13g2_stdcell/lib/sg13g2_stdcell_typ_1p20V_25C.lib";

std::smatch found_in(const std::string& output, const char* pattern, const std::string& command) {
  std::smatch match;
  if (!std::regex_search(output, match, std::regex(pattern)))
    throw UserError(
        fmt::format("bench proof: found no figures in what this prints: {}\n{}", command, output));
  return match;
}

double number(const std::smatch& match, std::size_t group) { return std::stod(match[group].str()); }

void add_proof(const fs::path& root, const BenchOptions& options, std::vector<BenchRow>& rows) {
  const fs::path program = fs::read_symlink("/proc/self/exe").replace_filename("meltstage-hls");
  if (!fs::exists(program))
    throw UserError(fmt::format(
        "{}: isn't there, expected it beside this program; ./run --build meltstage-hls", program.string()));
  const unsigned mutants = options.quick ? 4 : 60;
  const std::string command = fmt::format(
      "cd '{}' && '{}' hls prove cmodel/*.cpp hls/chip/clock.cpp --option=-I. --rtl rtl/tc.f --top tc_top "
      "--tie scan_en_i=0 --mutants {} --seed {}{}",
      root.string(), program.string(), mutants, options.seed,
      options.quick ? " --block u_quality u_sysctrl pins" : "");
  tell(options.progress, "proving", 0, 1);
  const std::string output = output_of(command);
  const std::smatch proof =
      found_in(output, R"((?:proved|refuted|not decided): (\d+) of (\d+) bits equal[^;]*; (\d+) s)", command);
  const std::string what = options.quick ? "QUALITY, SYSCTRL, pins" : "whole chip";
  rows.push_back({what + ": bits", number(proof, 2), "", {}, {}});
  rows.push_back({what + ": proved", 100.0 * number(proof, 1) / number(proof, 2), "%", 100.0, {}});
  rows.push_back({what + ": time", number(proof, 3) / 60.0, "min", {}, kMostMinutes});
  if (number(proof, 1) < number(proof, 2)) return;  // mutants of what is no proof tell nothing
  const std::smatch counts =
      found_in(output, R"((\d+) refuted, (\d+) change nothing, (\d+) not decided; (\d+) s)", command);
  rows.push_back({"changed gates: refuted", number(counts, 1), "", {}, {}});
  rows.push_back({"changed gates: shown to change nothing", number(counts, 2), "", {}, {}});
  rows.push_back({"changed gates: not decided", number(counts, 3), "", {}, 0.0});
  rows.push_back({"changed gates: time for each", number(counts, 4) / mutants, "s", {}, {}});
}

// Both are synthesised without scan; what is made is kept in build/silicon.
void add_area(const fs::path& root, const std::string& pdk, const BenchOptions& options,
              std::vector<BenchRow>& rows) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path();
  const auto synthesised = [&](const std::string& side, const fs::path& rtl) {
    tell(options.progress, "synthesising the chip " + side, 0, 1);
    const fs::path build = root / "build/silicon" / side;
    const fs::path netlist = build / "sg13g2/tc_top/netlist.v";
    const std::string command =
        fmt::format("make -s -C '{}' TECH=sg13g2 scan_tops= SOURCES='{}' BUILD='{}' '{}' >&2",
                    (root / "asic/flow").string(), (rtl / "tc.f").string(), build.string(), netlist.string());
    if (std::system(command.c_str()) != 0)
      throw UserError(fmt::format("bench proof: the flow stopped (its line is above); by hand: {}", command));
    return netlist;
  };
  const fs::path by_hand = synthesised("by_hand", root / "rtl");
  const fs::path generated = synthesised("generated", program.parent_path() / "hls/chip");
  const std::string command =
      fmt::format("'{}' '{}' '{}' '{}'", (root / "hls/chip/cells.py").string(),
                  (fs::path(pdk) / kCells).string(), by_hand.string(), generated.string());
  const std::smatch chip = found_in(output_of(command), R"(\| the chip \|.*\| ([\d.]+) \|)", command);
  rows.push_back({"area of the cells, generated / by hand", number(chip, 1), "", {}, kMostArea});
}

}  // namespace

std::vector<BenchRow> bench_proof(const BenchOptions& options) {
  const fs::path root = checkout_with("hls/chip/clock.cpp");
  std::vector<BenchRow> rows;
  add_proof(root, options, rows);
  if (const char* pdk = std::getenv("PDK_ROOT"); pdk != nullptr && !options.quick)
    add_area(root, pdk, options, rows);
  return rows;
}

}  // namespace meltstage::app
