// SPDX-License-Identifier: Apache-2.0
#include "running_case.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace meltstage::tb {

std::unique_ptr<Device> in_lockstep(const chip::Chip& start) {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  std::string name = fmt::format("{}.{}", test->test_suite_name(), test->name());
  std::replace(name.begin(), name.end(), '/', '.');
  return in_lockstep(start, {name, 1, fmt::format("ctest -R '{}'", name)});
}

}  // namespace meltstage::tb
