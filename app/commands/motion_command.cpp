// SPDX-License-Identifier: Apache-2.0
// `meltstage gcode` and `meltstage accuracy`. Reference: docs/motion/stage.md.
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <map>
#include <memory>

#include "app/commands/motion_files.hpp"
#include "app/json_output.hpp"
#include "app/verbs.hpp"

namespace meltstage::app {

Action add_gcode_command(CLI::App& cli, const std::string&) {
  const auto gcode = std::make_shared<GcodeCommand>();
  CLI::App* command =
      cli.add_subcommand("gcode", "Write a job as G-code for a real machine (docs/motion/stage.md)");
  show_example(command, "gcode examples/first.toml --out first.ngc");
  command->add_option("JOB", gcode->job, "Job file (TOML), as for print")->required();
  command->add_option("--out", gcode->out, "File to write")->required();
  command->add_option("--dialect", gcode->dialect, "Control that reads it (default linuxcnc)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, motion::GcodeDialect>{
          {"linuxcnc", motion::GcodeDialect::linuxcnc}, {"grbl", motion::GcodeDialect::grbl}}));
  return [gcode] { return write_gcode_file(*gcode); };
}

Action add_accuracy_command(CLI::App& cli, const std::string&) {
  const auto accuracy = std::make_shared<AccuracyCommand>();
  CLI::App* command =
      cli.add_subcommand("accuracy", "Evaluate a positioning test of an axis after ISO 230-2");
  show_example(command, "accuracy deviations.csv --compensation x.comp");
  command->add_option("DEVIATIONS", accuracy->deviations, "Measured deviations (.csv)")->required();
  command->add_option("--compensation", accuracy->compensation,
                      "Write the means as a LinuxCNC compensation file");
  command->add_flag("--json", accuracy->json, kJsonHelp);
  return [accuracy] { return show_accuracy(*accuracy); };
}

}  // namespace meltstage::app
