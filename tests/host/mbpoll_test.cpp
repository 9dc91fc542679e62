// SPDX-License-Identifier: Apache-2.0
// mbpoll, as Debian ships it, against the virtual chip on the model and on the RTL.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <regex>

#include "cmodel/spec.hpp"
#include "tests/host/served_chip.hpp"

namespace meltstage {
namespace {

namespace spec = chip::spec;
using ::testing::HasSubstr;
using ::testing::Not;

class Mbpoll : public ::testing::TestWithParam<const char*> {
 protected:
  // The time-out is generous because the RTL is slow on a busy machine.
  Ran mbpoll(const std::string& options, const std::string& values = "") const {
    return run_shell(
        fmt::format("mbpoll -m rtu -b 115200 -P even -0 -1 -o 10 {} {} {}", options, chip_.port(), values));
  }
  // Values that mbpoll shows, by register.
  static std::map<unsigned, unsigned> values(const Ran& ran) {
    std::map<unsigned, unsigned> found;
    const std::regex line(R"(\[(\d+)\]:\s+(0x[0-9A-F]+))");
    for (std::sregex_iterator it(ran.output.begin(), ran.output.end(), line), end; it != end; ++it)
      found[static_cast<unsigned>(std::stoul((*it)[1]))] =
          static_cast<unsigned>(std::stoul((*it)[2], nullptr, 16));
    return found;
  }

  ServedChip chip_{GetParam()};
};

TEST_P(Mbpoll, ReadsInputRegisters) {
  const Ran ran = mbpoll(fmt::format("-a 1 -t 3:hex -r {} -c 3", +spec::kInDeviceId));
  EXPECT_EQ(ran.status, 0) << ran.output;
  const std::map<unsigned, unsigned> expected{{spec::kInDeviceId, spec::kDeviceId},
                                              {spec::kInVersion, spec::kVersion},
                                              {spec::kInMapCrc, spec::kMapCrc}};
  EXPECT_EQ(values(ran), expected) << ran.output;
}

TEST_P(Mbpoll, ReadsEveryHoldingRegister) {
  constexpr unsigned kAtOnce = 32;
  std::map<unsigned, unsigned> found;
  for (unsigned first = 0; first < spec::kHoldingCount; first += kAtOnce) {
    const unsigned count = std::min(kAtOnce, spec::kHoldingCount - first);
    const Ran ran = mbpoll(fmt::format("-a 1 -t 4:hex -r {} -c {}", spec::kHoldingBase + first, count));
    EXPECT_EQ(ran.status, 0) << ran.output;
    found.merge(values(ran));
  }
  for (unsigned i = 0; i < spec::kHoldingCount; ++i) {
    const auto reset = static_cast<std::uint16_t>(spec::kHolding[i].reset);
    EXPECT_EQ(found[spec::kHoldingBase + i], reset) << spec::kHolding[i].name;
  }
}

TEST_P(Mbpoll, WritesOneAndSeveral) {
  EXPECT_THAT(mbpoll(fmt::format("-a 1 -t 4 -r {}", spec::kHoldingBase + spec::kRegSetpoint), "1234").output,
              HasSubstr("Written 1 reference"));
  EXPECT_THAT(mbpoll(fmt::format("-a 1 -t 4 -r {}", spec::kHoldingBase + spec::kRegRampUp), "150 75").output,
              HasSubstr("Written 2 references"));
  const auto found =
      values(mbpoll(fmt::format("-a 1 -t 4:hex -r {} -c 3", spec::kHoldingBase + spec::kRegSetpoint)));
  const std::map<unsigned, unsigned> expected{{spec::kHoldingBase + spec::kRegSetpoint, 1234},
                                              {spec::kHoldingBase + spec::kRegRampUp, 150},
                                              {spec::kHoldingBase + spec::kRegRampDown, 75}};
  EXPECT_EQ(found, expected);
}

TEST_P(Mbpoll, ReportsTheServerId) {
  const Ran ran = mbpoll("-a 1 -u");
  const auto id = spec::kIdentBytes.substr(spec::kIdentServer.start, spec::kIdentServer.length);
  EXPECT_THAT(ran.output, HasSubstr(fmt::format("Id    : 0x{:02X}", spec::kDeviceId >> 8)));
  EXPECT_THAT(ran.output, HasSubstr("Status: Off"));
  EXPECT_THAT(ran.output, HasSubstr(fmt::format("Data  : {}", id)));
}

TEST_P(Mbpoll, ShowsExceptions) {
  EXPECT_THAT(mbpoll("-a 1 -t 0 -r 0").output, HasSubstr("Illegal function"));
  EXPECT_THAT(mbpoll("-a 1 -t 4 -r 512").output, HasSubstr("Illegal data address"));
  const unsigned setpoint = spec::kHoldingBase + spec::kRegSetpoint;
  const int above = spec::kHolding[spec::kRegSetpoint].max + 1;
  EXPECT_THAT(mbpoll(fmt::format("-a 1 -t 4 -r {}", setpoint), fmt::format("{}", above)).output,
              HasSubstr("Illegal data value"));
  EXPECT_THAT(mbpoll(fmt::format("-a 1 -t 4 -r {}", setpoint), "100").output, Not(HasSubstr("Illegal")));
}

// A master that is killed leaves its settings on the port; the next one must not trip over them.
TEST_P(Mbpoll, WorksAfterOneThatWasKilled) {
  // Killed between two polls: it has shown an answer, and the next poll is far away.
  const std::string shown = (chip_.folder() / "shown").string();
  const std::string killed = fmt::format(
      "stdbuf -oL mbpoll -m rtu -b 115200 -P even -0 -o 10 -l 60000 -a 1 -t 3 -r 0 {} >{} & "
      "until grep -q '^.0.:' {}; do sleep 0.05; done; kill -9 $!; wait $!",
      chip_.port(), shown, shown);
  // The server sets the port right when it sees it closed; clocal is what mbpoll had set.
  const std::string right =
      fmt::format("until stty -F {} -a | grep -q -- -clocal; do sleep 0.05; done", chip_.port());
  run_shell(killed + "; " + right);
  const Ran ran = mbpoll(fmt::format("-a 1 -t 3:hex -r {}", +spec::kInDeviceId));
  EXPECT_THAT(ran.output, HasSubstr(fmt::format("0x{:04X}", spec::kDeviceId)));
}

// What these tests look for does not come by itself.
TEST_P(Mbpoll, GetsNothingFromAnotherAddress) {
  const Ran ran = run_shell(fmt::format("mbpoll -m rtu -b 115200 -0 -1 -o 0.3 -a 2 -t 3:hex -r {} -c 3 {}",
                                        +spec::kInDeviceId, chip_.port()));
  EXPECT_THAT(ran.output, HasSubstr("timed out"));
  EXPECT_TRUE(values(ran).empty());
}

INSTANTIATE_TEST_SUITE_P(Model, Mbpoll, ::testing::Values(""));
INSTANTIATE_TEST_SUITE_P(Rtl, Mbpoll, ::testing::Values("--rtl"));

}  // namespace
}  // namespace meltstage
