// SPDX-License-Identifier: Apache-2.0
// The driver as a library, on the model and on the RTL.
#include "host/controller.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/chip/pseudo_terminal.hpp"
#include "base/error.hpp"
#include "base/temporary_folder.hpp"
#include "tests/host/served_chip.hpp"

namespace meltstage::host {
namespace {

namespace spec = chip::spec;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
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

TEST_P(Driver, OpensTheLockBeforeWhatIsWrittenWithIt) {
  const Register &lock = find_register("LOCK"), &setpoint = find_register("SETPOINT");
  controller_.write(std::vector<Setting>{{&lock, 7.0}, {&setpoint, 90.0}});
  EXPECT_THAT(
      [&] {
        controller_.write(std::vector<Setting>{{&setpoint, 96.0}});
      },
      ThrowsMessage<BusError>(HasSubstr("LOCK is on, LOCK=0 opens it; nothing was changed")));
  controller_.write(std::vector<Setting>{{&setpoint, 96.0}, {&lock, 0.0}});
  EXPECT_EQ(controller_.read(lock), 0.0);
  EXPECT_NEAR(controller_.read(setpoint), 96.0, 1e-9);
}

TEST_P(Driver, ALockIsAsBeforeWhenTheOthersAreRefused) {
  const Register &lock = find_register("LOCK"), &setpoint = find_register("SETPOINT");
  controller_.write(std::vector<Setting>{{&lock, 7.0}, {&setpoint, 90.0}});
  EXPECT_THAT(
      [&] {
        controller_.write(std::vector<Setting>{{&setpoint, 149.0}, {&lock, 0.0}});
      },
      ThrowsMessage<BusError>(HasSubstr("nothing was changed")));
  EXPECT_EQ(controller_.read(lock), 7.0);
  EXPECT_NEAR(controller_.read(setpoint), 90.0, 1e-9);
  EXPECT_NE(controller_.status().bits >> spec::kStatusLocked & 1, 0);
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

// Slow, so that the chip is asked before its first sample.
TEST(DriverOfAYoungChip, ReadsNoTemperatureBeforeTheFirstSample) {
  ServedChip chip("--speed 0.02");
  Controller controller(connection(chip));
  EXPECT_THAT([&] { controller.read(find_register("PV")); },
              ThrowsMessage<BusError>("PV: found no value, expected one: nothing before the first sample"));
  EXPECT_EQ(controller.read(find_register("PV_FINE")), 0.0);
  EXPECT_FALSE(controller.status().temperature_degc.has_value());
}

TEST(DriverSettings, NamesTheSettingOfItsConnectionThatIsWrong) {
  const auto expect_refused = [](auto change, const char* said) {
    Connection wrong;
    wrong.device = "/dev/null";
    change(wrong);
    EXPECT_THAT([&] { Controller{wrong}; }, ThrowsMessage<UserError>(said));
  };
  const char* const formats = "expected 8E1, 8O1, 8N2 or 8N1";
  const auto format = [&](LineFormat given, const std::string& found) {
    expect_refused([=](Connection& c) { c.format = given; },
                   ("format: found \"" + found + "\", " + formats).c_str());
  };
  format({'E', 2}, "8E2");
  format({'N', 7}, "8N7");
  format({'X', 7}, "8X7");
  format({'e', 1}, "8e1");
  format({'\n', -1}, "8\\x0A-1");
  for (const int attempts : {0, -1})
    expect_refused([=](Connection& c) { c.attempts = attempts; },
                   ("attempts: found " + std::to_string(attempts) + ", expected 1 or more").c_str());
  expect_refused([](Connection& c) { c.timeout_s = std::nan(""); },
                 "time-out: found nan s, expected 0.01 to 60 s");
}

// It is a library: whoever calls it has options of its own.
TEST(DriverSettings, SaysNothingOfACommandLine) {
  const ServedChip chip("--speed 5");
  Connection other = connection(chip);
  other.address = 5;
  other.timeout_s = 0.05;
  Controller controller(other);
  EXPECT_THAT([&] { controller.status(); },
              ThrowsMessage<BusError>(
                  AllOf(HasSubstr("see wiring, address, baud rate and format"), Not(HasSubstr("--")))));
}

INSTANTIATE_TEST_SUITE_P(Model, Driver, ::testing::Values("--speed 5"));
INSTANTIATE_TEST_SUITE_P(Rtl, Driver, ::testing::Values("--rtl"));

// A chip whose registers hold their own addresses, on a line that does with an answer what it is told to.
class BadLine {
 public:
  using Send = std::function<void(app::PseudoTerminal&, const std::vector<std::uint8_t>& answer)>;
  explicit BadLine(Send send) : send_(std::move(send)), chip_([this] { answer_all(); }) {}
  ~BadLine() {
    over_ = true;
    chip_.join();
  }
  BadLine(const BadLine&) = delete;
  BadLine& operator=(const BadLine&) = delete;

  std::string port() const { return line_.device(); }
  static std::vector<std::uint8_t> with_crc(std::vector<std::uint8_t> frame) {
    std::uint16_t crc = 0xFFFF;
    for (const std::uint8_t byte : frame) {
      crc ^= byte;
      for (int bit = 0; bit < 8; ++bit)
        crc = static_cast<std::uint16_t>((crc & 1U) != 0 ? (crc >> 1U) ^ 0xA001U : crc >> 1U);
    }
    frame.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
    frame.push_back(static_cast<std::uint8_t>(crc >> 8U));
    return frame;
  }

 private:
  static constexpr std::size_t kRequest = 8;

  void answer_all() {
    std::vector<std::uint8_t> request;
    while (!over_) {
      if (!line_.wait(20)) continue;
      const auto bytes = line_.read();
      request.insert(request.end(), bytes.begin(), bytes.end());
      while (request.size() >= kRequest) {
        send_(line_, with_crc({request[0], request[1], 2, request[2], request[3]}));
        request.erase(request.begin(), request.begin() + kRequest);
      }
    }
  }

  TemporaryFolder folder_;
  app::PseudoTerminal line_{folder_.path() / "line"};
  Send send_;
  std::atomic<bool> over_ = false;
  std::thread chip_;
};

void expect_own_addresses(const BadLine& line, double timeout_s, std::chrono::milliseconds pause) {
  Connection c;
  c.device = line.port();
  c.timeout_s = timeout_s;
  Controller controller(c);
  for (const char* name : {"SETPOINT", "T_MAX", "KP", "SETPOINT"}) {
    const Register* const reg = &find_register(name);
    EXPECT_EQ(controller.read(std::span(&reg, 1)).front(), reg->address) << name;
    std::this_thread::sleep_for(pause);
  }
}

// It was told that LOCK is on, or that heating must be.
TEST(DriverOfABusyChip, ARefusalWhileTheAutotuneRunsSaysSo) {
  const ServedChip chip("--speed 20");
  Controller controller(connection(chip));
  controller.write(std::vector<Setting>{{&find_register("SETPOINT"), 60.0}});
  while ((controller.status().bits >> spec::kStatusSensorOk & 1) == 0) {  // no sample yet
  }
  controller.run();
  controller.start_tuning();
  for (const auto& change : {std::function<void()>([&] { controller.run(); }),
                             std::function<void()>([&] { controller.clear_faults(); }),
                             std::function<void()>([&] { controller.start_tuning(); })})
    EXPECT_THAT(change, ThrowsMessage<BusError>(
                            AllOf(HasSubstr("busy"), HasSubstr("the autotune runs, STOP ends it"))));
  controller.stop();
}

// Every answer comes later than the time-out, and that to a repeat behind the first one's.
TEST(DriverOnABadLine, AnswersThatAreAlwaysLateAreThoseOfTheirRequests) {
  for (const int delay_ms : {210, 250, 300, 380, 450}) {
    std::vector<std::thread> sending;
    const BadLine line([&](app::PseudoTerminal& port, const std::vector<std::uint8_t>& answer) {
      sending.emplace_back([&port, answer, delay_ms] {
        std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms));
        port.write(answer);
      });
    });
    expect_own_addresses(line, 0.2, std::chrono::milliseconds(0));
    for (std::thread& one : sending) one.join();
  }
}

TEST(DriverOnABadLine, ASecondCopyOfAnAnswerIsNoneToTheNextRequest) {
  const BadLine line([](app::PseudoTerminal& port, const std::vector<std::uint8_t>& answer) {
    port.write(answer);
    port.write(answer);
  });
  expect_own_addresses(line, 1.0, std::chrono::milliseconds(50));
}

TEST(DriverOnABadLine, AnAnswerBehindTheTimeoutMovesNoOtherBehindItsRequest) {
  int answers = 0;
  const BadLine line([&](app::PseudoTerminal& port, const std::vector<std::uint8_t>& answer) {
    std::this_thread::sleep_for(std::chrono::milliseconds(answers++ == 0 ? 300 : 20));
    port.write(answer);
  });
  expect_own_addresses(line, 0.2, std::chrono::milliseconds(0));
}

// Given up after one attempt, or answered by an exception in the end: the next request has its own answer all
// the same.
TEST(DriverOnABadLine, ALateAnswerToWhatWasGivenUpIsNoneToTheNextRequest) {
  int answers = 0;
  const BadLine line([&](app::PseudoTerminal& port, const std::vector<std::uint8_t>& answer) {
    std::this_thread::sleep_for(std::chrono::milliseconds(answers++ == 0 ? 250 : 20));
    port.write(answer);
  });
  Connection c;
  c.device = line.port();
  c.timeout_s = 0.2;
  c.attempts = 1;
  Controller controller(c);
  const Register* const first = &find_register("SETPOINT");
  const Register* const second = &find_register("T_MAX");
  EXPECT_THROW(controller.read(std::span(&first, 1)), BusError);
  EXPECT_EQ(controller.read(std::span(&second, 1)).front(), second->address);
}

// A write's answer repeats it. The copy of an earlier write's comes before that of the present one, which is
// refused.
TEST(DriverOnABadLine, TheEchoOfAnotherWriteIsNoAnswer) {
  const Setting first{&find_register("T_AMB"), 31.0}, second{&find_register("SETPOINT"), 400.0};
  const std::uint16_t word = to_raw(*first.reg, first.value);
  const auto echo =
      BadLine::with_crc({1, 6, static_cast<std::uint8_t>(first.reg->address >> 8),
                         static_cast<std::uint8_t>(first.reg->address & 0xFF),
                         static_cast<std::uint8_t>(word >> 8), static_cast<std::uint8_t>(word & 0xFF)});
  int writes = 0;
  const BadLine line([&](app::PseudoTerminal& port, const std::vector<std::uint8_t>& answer) {
    constexpr std::uint8_t kWrite = 6, kRefused = 0x86, kBadValue = 3;
    if (answer[1] != kWrite) return port.write(answer);
    port.write(echo);
    if (writes++ == 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    port.write(BadLine::with_crc({answer[0], kRefused, kBadValue}));
  });
  Connection c;
  c.device = line.port();
  Controller controller(c);
  controller.write(std::span(&first, 1));
  EXPECT_THAT([&] { controller.write(std::span(&second, 1)); },
              ThrowsMessage<BusError>(HasSubstr("refused by the chip with exception 03")));
  EXPECT_EQ(writes, 2);
}

// The repeat is refused since the first one was done: that nothing was changed would be untrue.
TEST(DriverOnABadLine, ARefusalBehindALostAnswerSaysThatItMayBeDone) {
  int requests = 0;
  const BadLine line([&](app::PseudoTerminal& port, const std::vector<std::uint8_t>& answer) {
    constexpr std::uint8_t kRefused = 0x86, kNotNow = 4;
    if (++requests > 1) port.write(BadLine::with_crc({answer[0], kRefused, kNotNow}));
  });
  Connection c;
  c.device = line.port();
  c.timeout_s = 0.2;
  Controller controller(c);
  const Setting lock{&find_register("LOCK"), 5};
  for (const auto& change : {std::function<void()>([&] { controller.start_tuning(); }),
                             std::function<void()>([&] { controller.write(std::span(&lock, 1)); })}) {
    requests = 0;
    EXPECT_THAT(change,
                ThrowsMessage<BusError>(AllOf(
                    HasSubstr("an answer before was lost, so the chip may have done it then: read it back"),
                    Not(HasSubstr("nothing was changed")), Not(HasSubstr("heating must be on")))));
  }
}

}  // namespace
}  // namespace meltstage::host
