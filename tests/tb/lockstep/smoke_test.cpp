// SPDX-License-Identifier: Apache-2.0
// Model and RTL side by side from reset through a first heating.
#include <gtest/gtest.h>

#include "tb/lockstep/lockstep.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/head.hpp"

namespace meltstage::tb {
namespace {

TEST(Smoke, HeatsInLockstep) {
  Head head({.seed = 7});
  Lockstep run(make_verilated_rtl(), {"smoke", 7, "ctest -R Smoke.HeatsInLockstep"});
  chip::Outputs out = run.model().outputs({});
  const std::uint16_t values[] = {1100};
  head.host().submit(read_input_registers(1, 0, 24));
  head.host().submit(write_multiple_registers(1, 0x101, values));
  bool ran = false;
  for (std::uint64_t cycle = 0; cycle < 6'000'000; ++cycle) {
    if (cycle == 4'500'000) head.host().submit(write_single_register(1, 0x100, 0xA501));
    chip::Inputs in = head.step(cycle, out);
    in.rst_n = cycle >= 10;
    out = run.step(in);
    ran |= out.heater;
  }
  int good = 0;
  while (auto result = head.host().take_result()) {
    EXPECT_EQ(result->outcome == ModbusOutcome::data, true)
        << "request " << result->id << " exception " << int{result->exception_code} << result->problem;
    good += result->outcome == ModbusOutcome::data;
  }
  EXPECT_EQ(good, 3);
  EXPECT_TRUE(ran);
  const Compared compared = run.finish();
  EXPECT_EQ(compared.frames, 3u);
  EXPECT_GT(compared.samples, 2u);
}

}  // namespace
}  // namespace meltstage::tb
