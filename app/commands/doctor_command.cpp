// SPDX-License-Identifier: Apache-2.0
// `meltstage doctor`: what the verbs need on this machine, what is there, and what to do about the rest.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "app/json_output.hpp"
#include "app/verbs.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;

enum class State { good, absent, bad };
constexpr std::string_view kStateNames[] = {"ok", "-", "missing"};

struct Finding {
  State state;
  std::string what, found, used_by, advice;
};

// A program of ours, which lies beside this one.
struct Part {
  const char *program, *package, *verbs;
};
constexpr Part kParts[] = {{"meltstage-aligned", "meltstage-vision", "print of a job with [alignment]"},
                           {"meltstage-conformal", "meltstage", "conformal"},
                           {"meltstage-regress", "meltstage", "regress"},
                           {"meltstage-dft", "meltstage", "dft"},
                           {"meltstage-hls", "meltstage-hls", "hls"},
                           {"meltstage-page", "meltstage", "page"},
                           {"meltstage-live", "meltstage", "live"}};

// A program of others that a verb starts. Without it `part` lacks something.
struct Tool {
  const char *program, *package, *part, *used_by;
};
constexpr Tool kTools[] = {{"yosys", "yosys", "meltstage-hls", "hls prove: reads the RTL"},
                           {"iverilog", "iverilog", "meltstage-hls", "hls prove: a second reader of the RTL"},
                           {"berkeley-abc", "berkeley-abc", "meltstage-hls", "hls: sweeps circuits"},
                           {"clang++-14", "clang-14", "meltstage-hls", "hls: reads the C++"},
                           {"vvp", "iverilog", "meltstage-dft", "dft replay --on icarus"},
                           {"chromium", "chromium", "meltstage-bench", "bench page"}};

fs::path own_folder() { return fs::read_symlink("/proc/self/exe").parent_path(); }

std::optional<fs::path> in_path(std::string_view program) {
  const char* list = std::getenv("PATH");
  std::string_view left = list == nullptr ? "" : list;
  while (!left.empty()) {
    const std::size_t end = std::min(left.find(':'), left.size());
    const fs::path candidate = fs::path(left.substr(0, end)) / program;
    std::error_code none;
    if (fs::is_regular_file(candidate, none) && access(candidate.c_str(), X_OK) == 0) return candidate;
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  return std::nullopt;
}

bool is_built(std::string_view part) {
  std::error_code none;
  return fs::exists(own_folder() / part, none);
}

// From a build of the sources, and not from a package.
bool is_checkout() {
  std::error_code none;
  return fs::exists(own_folder().parent_path() / "CMakeCache.txt", none);
}

Finding look_for(const Part& part) {
  if (is_built(part.program)) return {State::good, part.program, "beside meltstage", part.verbs, ""};
  if (is_checkout())
    return {State::absent, part.program, "not built", part.verbs,
            fmt::format("./run --build {}", part.program)};
  return {State::absent, part.program, "not installed", part.verbs,
          fmt::format("the package {}", part.package)};
}

Finding look_for(const Tool& tool) {
  if (const auto path = in_path(tool.program))
    return {State::good, tool.program, path->string(), tool.used_by, ""};
  return {is_built(tool.part) ? State::bad : State::absent, tool.program, "not in PATH", tool.used_by,
          fmt::format("apt-get install {}", tool.package)};
}

Finding look_for_slurm() {
  if (const auto path = in_path("sbatch"))
    return {State::good, "sbatch", path->string(), "--slurm of windows and regress", ""};
  return {State::absent, "sbatch", "not in PATH", "--slurm of windows and regress",
          "apt-get install slurm-wlm"};
}

// Adapters and boards on USB; a machine without one is as good.
std::vector<Finding> look_for_ports() {
  std::vector<Finding> list;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator("/dev", none)) {
    const std::string path = entry.path().string();
    if (!path.starts_with("/dev/ttyUSB") && !path.starts_with("/dev/ttyACM")) continue;
    const bool usable = access(path.c_str(), R_OK | W_OK) == 0;
    list.push_back({usable ? State::good : State::bad, path, usable ? "yours to use" : "no permission",
                    "chip --port", usable ? "" : "sudo adduser $USER dialout, then log in again"});
  }
  if (list.empty())
    list.push_back({State::absent, "serial port", "no /dev/ttyUSB or /dev/ttyACM", "chip --port",
                    "plug an adapter in, or: meltstage chip serve --port /tmp/chip"});
  return list;
}

Finding look_at_temporary_folder() {
  std::error_code failed;
  const fs::path folder = fs::temp_directory_path(failed);
  if (failed || access(folder.c_str(), W_OK) != 0)
    return {State::bad, "temporary folder", failed ? failed.message() : folder.string() + " is read-only",
            "dft, hls, regress", "set TMPDIR to a folder of yours"};
  const auto free_gib = static_cast<double>(fs::space(folder, failed).available) / (1 << 30);
  return {free_gib < 1.0 ? State::bad : State::good, "temporary folder",
          fmt::format("{}, {:.1f} GiB free", folder.string(), free_gib), "dft, hls, regress",
          free_gib < 1.0 ? "free space, or set TMPDIR" : ""};
}

std::vector<Finding> look_at_all() {
  std::vector<Finding> list;
  for (const Part& part : kParts) list.push_back(look_for(part));
  for (const Tool& tool : kTools) list.push_back(look_for(tool));
  list.push_back(look_for_slurm());
  for (const Finding& port : look_for_ports()) list.push_back(port);
  list.push_back(look_at_temporary_folder());
  list.push_back({State::good, "cores", std::to_string(std::thread::hardware_concurrency()),
                  "-j of print, windows, regress", ""});
  return list;
}

void tell(const std::vector<Finding>& findings) {
  for (const auto& [state, what, found, used_by, advice] : findings)
    fmt::print("{:<8} {:<20} {:<26} {}{}{}\n", kStateNames[static_cast<int>(state)], what, found, used_by,
               advice.empty() ? "" : "; to have it: ", advice);
}

void tell_json(const std::vector<Finding>& findings) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& [state, what, found, used_by, advice] : findings)
    list.push_back({{"state", kStateNames[static_cast<int>(state)]},
                    {"what", what},
                    {"found", found},
                    {"used_by", used_by},
                    {"advice", advice}});
  print_json(list);
}

}  // namespace

Action add_doctor_command(CLI::App& cli, const std::string&) {
  const auto json = std::make_shared<bool>(false);
  CLI::App* command =
      cli.add_subcommand("doctor", "What the verbs need on this machine, and what is missing");
  show_example(command, "doctor");
  command->add_flag("--json", *json, kJsonHelp);
  return [json] {
    const std::vector<Finding> findings = look_at_all();
    *json ? tell_json(findings) : tell(findings);
    return std::any_of(findings.begin(), findings.end(),
                       [](const Finding& f) { return f.state == State::bad; })
               ? 1
               : 0;
  };
}

}  // namespace meltstage::app
