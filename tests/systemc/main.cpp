// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "bench.hpp"

int sc_main(int argc, char* argv[]) {
  testing::InitGoogleTest(&argc, argv);
  const meltstage::systemc::Bench bench("bench");
  return RUN_ALL_TESTS();
}
