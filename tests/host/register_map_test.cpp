// SPDX-License-Identifier: Apache-2.0
#include "host/register_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.hpp"
#include "cmodel/spec.hpp"
#include "host/errors.hpp"

namespace meltstage::host {
namespace {

namespace spec = chip::spec;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(RegisterMap, HasEveryRegisterOfTheSpecAtItsAddress) {
  ASSERT_EQ(registers().size(), spec::kInputCount + spec::kHoldingCount);
  for (unsigned i = 0; i < spec::kInputCount; ++i) {
    const Register& r = find_register(spec::kInput[i].name);
    EXPECT_EQ(r.address, i);
    EXPECT_FALSE(r.writable);
  }
  for (unsigned i = 0; i < spec::kHoldingCount; ++i) {
    const Register& r = find_register(spec::kHolding[i].name);
    EXPECT_EQ(r.address, spec::kHoldingBase + i);
    EXPECT_TRUE(r.writable);
    EXPECT_EQ(r.readable, spec::kHolding[i].readable);
  }
}

TEST(RegisterMap, FindsSmallLettersAndNamesNearOnes) {
  EXPECT_EQ(find_register("setpoint").name, "SETPOINT");
  EXPECT_THAT([] { find_register("SETPONT"); }, ThrowsMessage<UserError>(HasSubstr("such as SETPOINT")));
}

// Every word that a writable register can hold comes back from its value in the unit.
TEST(RegisterMap, ValuesAndWordsAreInverse) {
  for (const Register& r : registers()) {
    if (!r.writable) continue;
    for (std::int32_t raw = r.min; raw <= r.max; ++raw) {
      const auto word = static_cast<std::uint16_t>(raw);
      ASSERT_EQ(to_raw(r, to_unit(r, word)), word) << r.name << " " << raw;
    }
  }
}

TEST(RegisterMap, OutOfRangeIsRefusedWithTheRangeInItsUnit) {
  for (const Register& r : registers()) {
    if (!r.writable) {
      EXPECT_THROW(to_raw(r, 0.0), UserError) << r.name;
      continue;
    }
    EXPECT_THROW(to_raw(r, (r.max + 0.6) * r.scale), UserError) << r.name;
    EXPECT_THROW(to_raw(r, (r.min - 0.6) * r.scale), UserError) << r.name;
    EXPECT_THROW(to_raw(r, std::nan("")), UserError) << r.name;
  }
  EXPECT_THAT([] { to_raw(find_register("SETPOINT"), 501.0); },
              ThrowsMessage<UserError>(HasSubstr("SETPOINT: found 501, expected 0.0 to 500.0 degC")));
}

TEST(RegisterMap, RoundingThatChangesTheMeaningIsRefused) {
  const auto expect_refused = [](const char* name, double value, const char* said) {
    EXPECT_THAT([&] { to_raw(find_register(name), value); }, ThrowsMessage<UserError>(HasSubstr(said)))
        << name;
  };
  expect_refused("HOST_WD", 0.04, "HOST_WD: found 0.04, expected 0, or 0.1 s at least");
  expect_refused("KP", 1e-9, "KP: found 1e-09, expected 0, or 1.52588e-05 1/K at least");
  expect_refused("CTRL", 55.5, "CTRL: found 55.5, expected a whole number");
  expect_refused("BAUD", 1249, "BAUD: found 1249, expected a rate within 2.5 %");
  EXPECT_EQ(to_raw(find_register("BAUD"), 115249), 1152);
  EXPECT_EQ(to_raw(find_register("HOST_WD"), 0.0), 0);
  EXPECT_EQ(to_raw(find_register("HOST_WD"), 0.06), 1);
}

TEST(RegisterMap, TextTellsNeighbouringWordsApart) {
  for (const Register& r : registers()) {
    for (const unsigned word : {1u, 2u, 1000u, 1001u, 32766u, 32767u, 65534u, 65535u})
      EXPECT_NE(value_text(r, static_cast<std::uint16_t>(word)),
                value_text(r, static_cast<std::uint16_t>(word - 1)))
          << r.name << " " << word;
  }
  EXPECT_EQ(value_text(find_register("T_AMB"), 0xFFFF), "-0.1");
}

TEST(RegisterMap, CodedRegistersSpeak) {
  EXPECT_EQ(fault_names(1U << spec::kFaultOverTemp | 1U << spec::kFaultInhibit), "OverTemp, Inhibit");
  EXPECT_EQ(fault_names(0), "");
  EXPECT_EQ(meaning(find_register("FIRST_FAULT"), (1 + spec::kFaultRate) << 8 | spec::kStCmdReady),
            "Rate, state CmdReady");
  EXPECT_EQ(meaning(find_register("FIRST_FAULT"), spec::kStIdle), "none, state Idle");
  EXPECT_EQ(meaning(find_register("FIRST_FAULT"), (1 + spec::kFaultCount) << 8 | spec::kStIdle),
            "unknown, state Idle");
  EXPECT_EQ(meaning(find_register("STATUS"), 1U << spec::kStatusRun | 1U << spec::kStatusFault),
            "run, fault");
  EXPECT_EQ(meaning(find_register("CAUSE"), 0), "none");
  EXPECT_EQ(meaning(find_register("PV"), 0x8000), "no sample yet");
  EXPECT_EQ(meaning(find_register("PV"), 250), "");
}

TEST(RegisterMap, NoOtherWordStandsForNoValue) {
  for (const Register& r : registers()) {
    EXPECT_EQ(is_no_value(r, 0x8000), r.name == "PV") << r.name;
    EXPECT_FALSE(is_no_value(r, 0x7FFF)) << r.name;
  }
}

}  // namespace
}  // namespace meltstage::host
