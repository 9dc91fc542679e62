// SPDX-License-Identifier: Apache-2.0
#include "app/chip/scenario_file.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "base/file.hpp"
#include "tb/scenario/scenario.hpp"

namespace meltstage::app {

std::string scenario_text(const std::filesystem::path& path) {
  std::string text = read_file(path, "a scenario", tb::kMostScenarioBytes);
  if (const auto defect = tb::parse_scenario(text).defect)
    throw UserError(fmt::format("{}:{}: found {}, expected {}", path.string(), defect->line, defect->found,
                                defect->expected));
  return text;
}

}  // namespace meltstage::app
