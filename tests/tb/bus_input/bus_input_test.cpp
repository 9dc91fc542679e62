// SPDX-License-Identifier: Apache-2.0
// Bad input on the serial line: after each, no register has changed without a sound frame, and a valid
// request 3.5 characters later is answered. docs/host/bus.md
#include <gtest/gtest.h>

#include "random_bus_run.hpp"
#include "tests/tb/lockstep/running_case.hpp"

namespace meltstage::tb {
namespace {

class BusInput : public ::testing::TestWithParam<std::uint8_t> {
 protected:
  const LineSetting line_{.format = GetParam()};
  const int bits_ = char_bits_of(GetParam());
  BusLine bus_{model_station(chip_on_line(line_)), line_};

  void put(const std::vector<Segment>& list) {
    for (const Segment& segment : list) ASSERT_NO_THROW(bus_.put(segment));
  }
};
INSTANTIATE_TEST_SUITE_P(Format, BusInput, ::testing::Range(std::uint8_t{0}, std::uint8_t{4}));

TEST_P(BusInput, ValidRequestsAreCarriedOut) {
  for (const Bytes& request : valid_requests()) put({segment_of(request)});
  EXPECT_EQ(bus_.count().accepted, valid_requests().size());
  EXPECT_GT(bus_.count().exceptions, 3u);
  EXPECT_GT(bus_.count().written, 3u);
}

TEST_P(BusInput, EverySingleBitOfTheData) {
  for (const Bytes& request : valid_requests()) put(data_bit_flips(request));
  EXPECT_EQ(bus_.count().accepted, 0u);
  EXPECT_EQ(bus_.count().written, 0u);
}

TEST_P(BusInput, EverySingleBitOfTheLine) {
  for (const Bytes& request : valid_requests()) put(line_bit_flips(request, bits_));
  EXPECT_EQ(bus_.count().written, 0u);
}

TEST_P(BusInput, Truncated) {
  for (const Bytes& request : valid_requests()) put(truncations(request));
  EXPECT_EQ(bus_.count().written, 0u);
}

TEST_P(BusInput, Merged) {
  const auto requests = valid_requests();
  for (std::size_t i = 0; i + 1 < requests.size(); ++i) put(merged_with(requests[i], requests[i + 1]));
  EXPECT_EQ(bus_.count().written, 0u);
}

TEST_P(BusInput, OverLong) {
  for (const Bytes& request : valid_requests()) put(over_long(request));
  EXPECT_EQ(bus_.count().accepted, 2 * valid_requests().size()) << "of 255 and 256 bytes";
}

TEST_P(BusInput, WrongGaps) {
  for (const Bytes& request : valid_requests()) put(wrong_gaps(request, bits_));
  EXPECT_GT(bus_.count().accepted, 0u) << "pauses up to 1.5 characters";
  EXPECT_GT(bus_.count().possible, 0u);
}

TEST(BusInputRandom, FiftyThousandSegments) {
  BusCount all;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(seed);
    BusCount run;
    ASSERT_NO_THROW(run = random_bus_run(seed, 500));
    all = sum(all, run);
  }
  EXPECT_EQ(all.segments, 50'000u);
  EXPECT_GT(all.accepted, 5'000u);
  EXPECT_GT(all.possible, 1'000u);
  EXPECT_GT(all.exceptions, 1'000u);
  EXPECT_GT(all.written, 1'000u);
}

TEST(BusInputFuzz, SeedProgramsAndTheirRandomChanges) {
  Rng rng = stream(1, "programs");
  for (const Bytes& seed : seed_programs()) {
    ASSERT_NO_THROW(drive(seed));
    for (int i = 0; i < 20; ++i) {
      Bytes changed = seed;
      for (std::uint64_t n = 1 + rng.below(4); n > 0; --n)
        changed[rng.below(changed.size())] = static_cast<std::uint8_t>(rng.bits());
      ASSERT_NO_THROW(drive(changed));
    }
  }
}

// Model and RTL, every flop compared on every clock, under the same host.
class LockstepStation final : public Station {
 public:
  explicit LockstepStation(const chip::Chip& start) : device_(in_lockstep(start)) {}
  void run_until(std::uint64_t cycle, HostEnd& host) override {
    for (; cycle_ < cycle; ++cycle_) {
      in_ = host.step(cycle_, out_);
      out_ = device_->step(in_);
    }
  }
  std::uint64_t cycle() const override { return cycle_; }
  const chip::Chip& chip() const override { return device_->model(); }
  void restart(const chip::Chip& state) override {
    device_->restart(state, in_);
    out_ = state.outputs(in_);
  }

 private:
  std::unique_ptr<Device> device_;
  chip::Inputs in_;
  chip::Outputs out_ = chip::Chip{}.outputs({});
  std::uint64_t cycle_ = 0;
};

TEST(BusInputLockstep, RtlDoesTheSame) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng = stream(seed, "bus input");
    LineSetting line = random_line(rng);
    line.baud = 5000;
    BusLine bus(std::make_unique<LockstepStation>(chip_on_line(line)), line);
    for (int i = 0; i < 40; ++i) ASSERT_NO_THROW(bus.put(random_segment(rng, line.format)));
  }
}

// What finds a broken chip must find these.
struct SeededFault {
  const char* name;
  const char* said;  // by the violation
  void (*fault)(chip::Chip&);
};
std::ostream& operator<<(std::ostream& out, const SeededFault& fault) { return out << fault.name; }

class BusInputControl : public ::testing::TestWithParam<SeededFault> {};

TEST_P(BusInputControl, IsFound) {
  std::string said = "nothing";
  for (std::uint64_t seed = 1; seed <= 8 && said == "nothing"; ++seed) {
    Rng rng = stream(seed, "bus input");
    const LineSetting line = {.format = static_cast<std::uint8_t>(seed % 4)};
    BusLine bus(faulty_station(chip_on_line(line), GetParam().fault), line);
    try {
      for (int i = 0; i < 60; ++i) bus.put(random_segment(rng, line.format));
    } catch (const Violation& violation) {
      said = violation.what();
    }
  }
  EXPECT_NE(said.find(GetParam().said), std::string::npos) << said;
}

INSTANTIATE_TEST_SUITE_P(
    Fault, BusInputControl,
    ::testing::Values(
        SeededFault{"None", "nothing", [](chip::Chip&) {}},
        SeededFault{"CrcNotLookedAt", "",
                    [](chip::Chip& c) {
                      if (c.uartc.frame.count_q >= 4) c.uartc.frame.crc_q = 0;
                    }},
        SeededFault{"AddressNotLookedAt", "", [](chip::Chip& c) { c.uartc.frame.match_q = 1; }},
        SeededFault{"CharacterErrorsIgnored", "", [](chip::Chip& c) { c.uartc.frame.bad_q = 0; }},
        SeededFault{"LengthNotLookedAt", "",
                    [](chip::Chip& c) {
                      if (c.uartc.frame.count_q > 256) c.uartc.frame.count_q = 256;
                    }},
        SeededFault{"SilenceNeverEndsAFrame", "", [](chip::Chip& c) { c.uartc.rx.gap_q = 600; }},
        SeededFault{"EveryPauseEndsAFrame", "", [](chip::Chip& c) { c.uartc.rx.gap_q = 0; }},
        SeededFault{"BadFrameWaitsFor1_75Ms", "",
                    [](chip::Chip& c) {
                      if (c.uartc.rx.state_q == chip::UartRx::kStop) c.uartc.pause_q = 1;
                    }},
        SeededFault{"BroadcastAnswered", "", [](chip::Chip& c) { c.uartc.frame.broadcast_q = 0; }},
        SeededFault{"WritesOneRegisterOff", "",
                    [](chip::Chip& c) {
                      if (c.sysctrl.write())
                        c.paramc.index_q = static_cast<std::uint8_t>((c.paramc.index_q + 1) % 50);
                    }}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace meltstage::tb
