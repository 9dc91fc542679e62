// SPDX-License-Identifier: Apache-2.0
// The model stepped from Python, beside the same loop in C++.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "bench/bench.hpp"
#include "bench/process_output.hpp"

namespace meltstage::app {

std::vector<BenchRow> bench_python(const BenchOptions&) {
  namespace fs = std::filesystem;
  constexpr double kLeastRatio = 0.9;
  const fs::path program =
      fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "python" / "speed.py";
  if (!fs::exists(program))
    throw UserError(
        fmt::format("{}: isn't there, expected it in the build; ./run bench python", program.string()));
  const std::string told = output_of(fmt::format("/usr/bin/python3 -B '{}' --json", program.string()));
  const auto speed = nlohmann::json::parse(told, nullptr, false);
  if (!speed.is_object())
    throw UserError(fmt::format("{}: found \"{}\", expected its figures", program.string(), told));
  const double python_ns = speed.at("python_ns"), cpp_ns = speed.at("cpp_ns");
  return {{"a clock of the model, by Chip.step() in Python", python_ns, "ns", {}, {}},
          {"the same loop in C++", cpp_ns, "ns", {}, {}},
          {"speed of Python, C++ = 1", cpp_ns / python_ns, "", kLeastRatio, {}}};
}

}  // namespace meltstage::app
