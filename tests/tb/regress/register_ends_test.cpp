// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/register_ends.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "tb/lockstep/bench.hpp"
#include "tb/stimulus/end_writes.hpp"

namespace meltstage::tb {
namespace {

using testing::IsEmpty;
using testing::UnorderedElementsAre;

std::vector<std::string> of(const std::vector<std::string>& holes, const std::string& reg) {
  std::vector<std::string> list;
  for (const std::string& hole : holes)
    if (hole.starts_with(reg + " ")) list.push_back(hole);
  return list;
}

TEST(RegisterEnds, AreThoseThatSixteenBitsHold) {
  const auto holes = RegisterEnds().holes();
  EXPECT_THAT(of(holes, "BAUD"),
              UnorderedElementsAre("BAUD at its lowest", "BAUD at its highest",
                                   "BAUD below its lowest refused", "BAUD above its highest refused"));
  EXPECT_THAT(of(holes, "HOST_WD"), UnorderedElementsAre("HOST_WD at its lowest", "HOST_WD at its highest"));
  EXPECT_THAT(of(holes, "CMD"), IsEmpty());
  EXPECT_EQ(end_word(spec::kRegTMin, RegisterEnd::below), static_cast<std::uint16_t>(-401));
  EXPECT_EQ(end_word(spec::kRegSetpoint, RegisterEnd::highest), 4950) << "5 degC below the highest T_MAX";
}

TEST(RegisterEnds, AreMetByWritesThatAreTakenAndRefused) {
  Bench bench(model_alone(chip_with(quick())));
  bench.write(spec::kRegBadMax, 1);
  bench.write_block(spec::kRegBadMax, {16});
  bench.write(spec::kRegSampleTimeout, 0);
  const auto holes = bench.coverage().ends.holes();
  EXPECT_THAT(of(holes, "BAD_MAX"),
              UnorderedElementsAre("BAD_MAX at its highest", "BAD_MAX below its lowest refused"));
  EXPECT_THAT(of(holes, "SAMPLE_TIMEOUT"),
              UnorderedElementsAre("SAMPLE_TIMEOUT at its lowest", "SAMPLE_TIMEOUT at its highest"));
}

TEST(RegisterEnds, OnePassMeetsThemAll) {
  EXPECT_THAT(write_register_ends(model_alone(end_writes_start()), 5, 1).coverage.ends.holes(), IsEmpty());
}

TEST(RegisterEnds, AnEndThatIsNotTakenEndsTheRun) {
  const chip::Chip locked = chip_with(quick({{spec::kRegLock, 1}}));
  EXPECT_THROW(write_register_ends(model_alone(locked), 1, 1), std::runtime_error);
}

}  // namespace
}  // namespace meltstage::tb
