// SPDX-License-Identifier: Apache-2.0
// The program behind `meltstage conformal`.
#include "app/verbs.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::app;
  constexpr Verb kVerbs[] = {{"conformal", add_conformal_command}};
  return run_verbs(argc, argv, kVerbs, {});
}
