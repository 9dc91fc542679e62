// SPDX-License-Identifier: Apache-2.0
// The program that prints jobs with [alignment]: `meltstage print` with the camera's libraries (OpenCV,
// Ceres).
#include "app/print/print_command.hpp"
#include "tb/printer/board_alignment.hpp"

int main(int argc, char** argv) {
  using namespace meltstage;
  constexpr app::Verb kVerbs[] = {{"print", [](CLI::App& cli, const std::string& typed) {
                                     return app::add_print_command_with(cli, typed, tb::align_board);
                                   }}};
  return app::run_verbs(argc, argv, kVerbs, {});
}
