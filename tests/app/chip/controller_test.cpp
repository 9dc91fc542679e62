// SPDX-License-Identifier: Apache-2.0
// The driver as a library, on the model and on the RTL.
#include "host/controller.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "tests/app/chip/served_chip.hpp"

namespace meltstage::host {
namespace {

namespace spec = chip::spec;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Connection connection(const ServedChip& chip) {
  Connection c;
  c.device = chip.port();
  c.timeout_s = 10.0;  // the RTL is slow on a busy machine
  return c;
}

class Driver : public ::testing::TestWithParam<const char*> {
 protected:
  ServedChip chip_{GetParam()};
  Controller controller_{connection(chip_)};
};

TEST_P(Driver, KnowsItsChip) {
  const Identity identity = controller_.identity();
  EXPECT_EQ(identity.text, spec::kIdentBytes.substr(spec::kIdentServer.start, spec::kIdentServer.length));
  EXPECT_EQ(identity.device_id, spec::kDeviceId);
  EXPECT_EQ(identity.map_crc, spec::kMapCrc);
  EXPECT_NO_THROW(controller_.check_identity());
}

TEST_P(Driver, ReadsInTheOrderAskedFor) {
  const std::vector<const Register*> wanted{&find_register("T_MAX"), &find_register("DEVICE_ID"),
                                            &find_register("KP"), &find_register("T_MAX")};
  const auto words = controller_.read(wanted);
  ASSERT_EQ(words.size(), 4u);
  EXPECT_EQ(words[0], spec::kHolding[spec::kRegTMax].reset);
  EXPECT_EQ(words[1], spec::kDeviceId);
  EXPECT_EQ(words[2], spec::kHolding[spec::kRegKp].reset);
  EXPECT_EQ(words[3], words[0]);
}

// More neighbours than a frame holds (16), and others far off: all or none.
TEST_P(Driver, WritesMoreThanAFrameAllOrNone) {
  std::vector<Setting> settings;
  for (const Register& r : registers()) {
    if (!r.writable || r.address < spec::kHoldingBase + spec::kRegKp ||
        r.address > spec::kHoldingBase + spec::kRegTs)
      continue;
    settings.push_back({&r, to_unit(r, static_cast<std::uint16_t>(r.max))});
  }
  settings.push_back({&find_register("SETPOINT"), 90.0});
  controller_.write(settings);
  for (const Setting& s : settings) EXPECT_EQ(controller_.read(*s.reg), s.value) << s.reg->name;

  settings.back().value = 149.0;  // above T_MAX - 5 degC: the chip refuses, after the other frames
  settings.front().value = 0.0;
  EXPECT_THAT([&] { controller_.write(settings); },
              ThrowsMessage<BusError>(HasSubstr("nothing was changed")));
  EXPECT_NE(controller_.read(*settings.front().reg), 0.0);
  EXPECT_NEAR(controller_.read(find_register("SETPOINT")), 90.0, 1e-9);
  EXPECT_EQ(controller_.status().bits >> spec::kStatusHold & 1, 0) << "Hold was left on";
}

// The refusal drops what is staged; what an earlier write staged is active before.
TEST_P(Driver, ARefusalLeavesEarlierWritesAlone) {
  const Register &highest = find_register("T_MAX"), &lowest = find_register("T_MIN"),
                 &setpoint = find_register("SETPOINT");
  controller_.write(std::vector<Setting>{{&highest, 120.0}});
  EXPECT_THROW(controller_.write(std::vector<Setting>{{&lowest, 10.0}, {&setpoint, 140.0}}), BusError);
  EXPECT_NEAR(controller_.read(highest), 120.0, 1e-9);
}

TEST_P(Driver, StatusIsWhatTheRegistersSay) {
  const Status status = controller_.status();
  EXPECT_FALSE(status.running());
  EXPECT_EQ(status.faults, 0);
  EXPECT_FALSE(status.first_fault.has_value());
  EXPECT_TRUE(spec::state_legal(status.state));
  EXPECT_EQ(status.duty_percent, 0.0);
}

// Two programs on one port, as `watch` and `set` are: the port's lock keeps their frames apart.
TEST_P(Driver, SharesItsPort) {
  const auto poll = [&](int* sound) {
    Connection once = connection(chip_);
    once.attempts = 1;  // nothing is repeated: a frame that met another would be seen
    try {
      Controller other(once);
      for (int i = 0; i < 20; ++i)
        *sound += other.read(find_register("DEVICE_ID")) == spec::kDeviceId ? 1 : 0;
    } catch (const std::runtime_error& error) {
      ADD_FAILURE() << error.what();
    }
  };
  int a = 0;
  int b = 0;
  std::thread one(poll, &a);
  std::thread two(poll, &b);
  one.join();
  two.join();
  EXPECT_EQ(a, 20);
  EXPECT_EQ(b, 20);
}

INSTANTIATE_TEST_SUITE_P(Model, Driver, ::testing::Values("--speed 5"));
INSTANTIATE_TEST_SUITE_P(Rtl, Driver, ::testing::Values("--rtl"));

}  // namespace
}  // namespace meltstage::host
