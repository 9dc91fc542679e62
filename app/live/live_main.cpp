// SPDX-License-Identifier: Apache-2.0
// The program behind `meltstage live`.
#include "app/verbs.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::app;
  constexpr Verb kVerbs[] = {{"live", add_live_command}};
  return run_verbs(argc, argv, kVerbs, {});
}
