// SPDX-License-Identifier: Apache-2.0
// `meltstage gcode` and `meltstage accuracy`. Reference: docs/motion/stage.md.
#pragma once

#include <filesystem>

#include "motion/stage/gcode.hpp"

namespace meltstage::app {

struct GcodeCommand {
  std::filesystem::path job;  // the file that `meltstage print` takes
  std::filesystem::path out;
  motion::GcodeDialect dialect = motion::GcodeDialect::linuxcnc;
};

// Plans the job's path and writes its program. Throws UserError.
int write_gcode_file(const GcodeCommand& command);

struct AccuracyCommand {
  std::filesystem::path deviations;
  std::filesystem::path compensation;  // LinuxCNC's file, written if named
  bool json = false;
};

// Evaluates a positioning test after ISO 230-2 and prints it. Throws UserError.
int show_accuracy(const AccuracyCommand& command);

}  // namespace meltstage::app
