// SPDX-License-Identifier: Apache-2.0
// profile_soak [CASES] [SEED]: random cases of every promise about profiles, 10 000 000 of each unless told.
#include <fmt/format.h>

#include <cstdlib>
#include <functional>
#include <string>

#include "tests/motion/profile/any_state_cases.hpp"
#include "tests/motion/profile/profile_cases.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::motion;
  const std::uint64_t cases = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 10'000'000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  if (cases == 0) {
    fmt::print(stderr, "profile_soak: found {} cases, expected a number above 0\n", argv[1]);
    return 2;
  }
  ScurveSeen curves;
  RetargetSeen changes;
  AnyStateSeen states;
  MovingEndSeen moving_ends;
  struct Promise {
    const char* name;
    std::function<std::string(std::mt19937_64&)> run;
  };
  const Promise promises[] = {
      {"S-curve: limits, continuity, end", [&](auto& random) { return scurve_case(random, curves); }},
      {"symmetric: textbook duration", symmetric_case},
      {"rounded to servo cycles", rounded_case},
      {"synchronized axes", synchronized_case},
      {"stop", stop_case},
      {"change of target and limits", [&](auto& random) { return retarget_case(random, changes); }},
      {"change to the old target", replan_case},
      {"to a speed, nothing is faster", [&](auto& random) { return moving_end_case(random, moving_ends); }},
      {"any state inside the limits", [&](auto& random) { return any_state_case(random, states); }},
  };
  int status = 0;
  for (const Promise& promise : promises) {
    std::mt19937_64 random(seed);
    std::uint64_t bad = 0;
    for (std::uint64_t i = 0; i < cases; ++i) {
      const std::string wrong = promise.run(random);
      if (wrong.empty()) continue;
      if (++bad <= 5) fmt::print("{}: case {}: {}\n", promise.name, i, wrong);
      status = 1;
    }
    fmt::print("{:<36} {} cases, {} bad\n", promise.name, cases, bad);
  }
  fmt::print(
      "S-curves: {} at the speed limit, {} below, {} hold both accelerations, {} one, {} none, {} refused\n",
      curves.cruise, curves.no_cruise, curves.hold_both, curves.hold_one, curves.hold_none, curves.refused);
  return status;
}
