// SPDX-License-Identifier: Apache-2.0
// LinuxCNC's interpreter as a second opinion on our programs.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <vector>

namespace meltstage::motion {

/// What it printed of a program, and how it ended: 0 is good.
struct Rs274Run {
  int status = -1;
  std::string text;
};
Rs274Run run_rs274(const std::string& program);

/// A move as the interpreter understood it.
struct CanonicalMove {
  std::string what;  ///< STRAIGHT_TRAVERSE, STRAIGHT_FEED or STRAIGHT_PROBE
  Eigen::Vector3d linear_mm, rotary_deg;
  bool pressure = false;  ///< motion output 0
};

struct Interpreted {
  std::string error;  ///< none: empty
  std::vector<CanonicalMove> moves;
  std::vector<Eigen::Vector3d> offsets_mm;  ///< tool offsets in their order
  std::size_t count(const std::string& what) const {
    return static_cast<std::size_t>(
        std::count_if(moves.begin(), moves.end(), [&](const CanonicalMove& m) { return m.what == what; }));
  }
};

/// Runs a program through rs274.
Interpreted interpret(const std::string& program);

}  // namespace meltstage::motion
