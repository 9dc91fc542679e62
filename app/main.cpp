// SPDX-License-Identifier: Apache-2.0
// The `meltstage` command: what a print, a chip and a machine need. Other verbs are programs beside it, so
// that each brings only the libraries that it uses.
#include "app/verbs.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::app;
  constexpr Verb kVerbs[] = {{"init", add_init_command},         {"coordinates", add_coordinates_command},
                             {"print", add_print_command},       {"report", add_report_command},
                             {"chip", add_chip_command},         {"windows", add_windows_command},
                             {"window", add_window_command},     {"gcode", add_gcode_command},
                             {"accuracy", add_accuracy_command}, {"doctor", add_doctor_command}};
  constexpr VerbElsewhere kElsewhere[] = {
      {"conformal", "Print on a measured surface (docs/motion/conformal.md)", "meltstage-conformal"},
      {"dft", "Scan, test patterns and sign-off vectors for a flat netlist (docs/make/test-vectors.md)",
       "meltstage-dft"},
      {"hls",
       "A pure C++ function as a circuit, and the proof that RTL is the same one (docs/verify/proof.md)",
       "meltstage-hls"},
      {"live", "Show and operate a chip in a browser (docs/start/live.md)", "meltstage-live"},
      {"page", "Write the chip as a page that runs in a browser (docs/start/chip-in-a-page.md)",
       "meltstage-page"},
      {"regress", "Run a suite of tests and seeds on model and RTL (docs/verify/regress.md)",
       "meltstage-regress"},
      {"bench", "Measure and print the figures of a part, with what is wanted", "meltstage-bench"}};
  return run_verbs(argc, argv, kVerbs, kElsewhere);
}
