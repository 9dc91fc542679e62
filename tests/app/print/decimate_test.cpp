// SPDX-License-Identifier: Apache-2.0
#include "app/print/report/decimate.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meltstage::app {
namespace {

using testing::Contains;
using testing::ElementsAre;

TEST(Decimate, ShortSeriesStaysWhole) {
  const std::vector<std::vector<double>> channels{{3.0, 1.0, 2.0}};
  EXPECT_THAT(decimate(channels, 3), ElementsAre(0, 1, 2));
}

TEST(Decimate, NoChannelGivesNothing) { EXPECT_TRUE(decimate({}, 10).empty()); }

class LongSeries : public testing::Test {
 protected:
  static constexpr std::size_t kSamples = 100'003;
  static constexpr std::size_t kLimit = 2000;

  LongSeries() : channels(3, std::vector<double>(kSamples)) {
    for (std::size_t i = 0; i < kSamples; ++i)
      for (std::size_t c = 0; c < channels.size(); ++c)
        channels[c][i] = std::sin(0.01 * static_cast<double>(i * (c + 1)));
  }

  std::vector<std::vector<double>> channels;
};

TEST_F(LongSeries, KeepsWithinTheLimitInAscendingOrder) {
  const auto kept = decimate(channels, kLimit);
  EXPECT_LE(kept.size(), kLimit);
  EXPECT_GT(kept.size(), kLimit / 4);
  EXPECT_TRUE(std::adjacent_find(kept.begin(), kept.end(), std::greater_equal<>()) == kept.end());
}

TEST_F(LongSeries, KeepsBothEnds) {
  const auto kept = decimate(channels, kLimit);
  EXPECT_EQ(kept.front(), 0u);
  EXPECT_EQ(kept.back(), kSamples - 1);
}

TEST_F(LongSeries, KeepsASpikeOfOneSampleInAnyChannel) {
  channels[0][777] = 50.0;
  channels[1][54'321] = -50.0;
  channels[2][99'998] = 50.0;
  const auto kept = decimate(channels, kLimit);
  EXPECT_THAT(kept, Contains(777));
  EXPECT_THAT(kept, Contains(54'321));
  EXPECT_THAT(kept, Contains(99'998));
}

TEST_F(LongSeries, KeepsAGap) {
  channels[1][31'415] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(decimate(channels, kLimit), Contains(31'415));
}

}  // namespace
}  // namespace meltstage::app
