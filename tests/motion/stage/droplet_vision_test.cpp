// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/droplet_vision.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "motion/stage/droplet_camera.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;

FlyingDroplet droplet_at(double x_um, double y_um) { return {.x_um = x_um, .y_um = y_um}; }

TEST(FindDroplets, PlacesADropletToATwentiethOfAPixel) {
  const CameraConfig camera;
  double squares = 0.0;
  constexpr int kImages = 20;
  for (int i = 0; i < kImages; ++i) {
    const FlyingDroplet droplet = droplet_at(400.0 + 1.3 * i, 600.0 - 0.7 * i);
    const auto found = find_droplets(render({droplet}, camera, static_cast<std::uint64_t>(i)));
    ASSERT_EQ(found.size(), 1u) << i;
    squares +=
        std::pow(found[0].x_px - droplet.x_um / 2.5, 2) + std::pow(found[0].y_px - droplet.y_um / 2.5, 2);
    EXPECT_NEAR(2.0 * std::sqrt(found[0].area_px / M_PI) * 2.5, 60.0, 0.9);
  }
  EXPECT_LT(std::sqrt(squares / (2 * kImages)), 0.05);  // radius 12 px, noise 4, blur 1.2 px
}

TEST(FindDroplets, SeesNothingInNoise) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) EXPECT_TRUE(find_droplets(render({}, {}, seed)).empty());
}

TEST(FindDroplets, LeavesOutWhatTheImageCutsOff) {
  EXPECT_TRUE(find_droplets(render({droplet_at(400.0, 10.0)}, {}, 1)).empty());
}

TEST(MeasurePair, IsRightOnBlurredNoisyImages) {
  CameraConfig camera;
  for (const double speed : {0.5, 2.0, 4.0})
    for (const double roundness : {1.0, 0.85, 0.6})
      for (const double noise : {1.0, 4.0, 8.0}) {
        camera.noise = noise;
        FlyingDroplet droplet = droplet_at(400.0, 300.0);
        droplet.diameter_um = 120.0;
        droplet.velocity_m_s = speed;
        droplet.roundness = roundness;
        droplet.angle_deg = 5.0;
        const GrayImage first = render({droplet}, camera, 1);
        droplet.x_um += speed * 100.0 * std::sin(5.0 * M_PI / 180.0);
        droplet.y_um += speed * 100.0 * std::cos(5.0 * M_PI / 180.0);
        const auto found = measure_pair(first, render({droplet}, camera, 2), camera.strobe);
        ASSERT_TRUE(found);
        EXPECT_NEAR(found->velocity_m_s, speed, 0.005) << roundness << " " << noise;
        EXPECT_NEAR(found->angle_deg, 5.0, 0.6);
        EXPECT_NEAR(found->roundness, roundness, 0.02) << speed << " " << noise;
        EXPECT_NEAR(found->diameter_um, 120.0, 1.8);
        EXPECT_EQ(found->satellites, 0);
      }
}

// Negative control: without the flash's length the smear of a fast droplet passes for an oval.
TEST(MeasurePair, TakesTheSmearOff) {
  CameraConfig camera;
  camera.strobe.flash_s = 4e-6;
  FlyingDroplet droplet = droplet_at(400.0, 300.0);
  droplet.velocity_m_s = 5.0;
  const GrayImage first = render({droplet}, camera, 1);
  droplet.y_um += 500.0;
  const GrayImage second = render({droplet}, camera, 2);
  EXPECT_NEAR(measure_pair(first, second, camera.strobe)->roundness, 1.0, 0.03);
  StrobeSetup no_flash = camera.strobe;
  no_flash.flash_s = 0.0;
  EXPECT_LT(measure_pair(first, second, no_flash)->roundness, 0.95);
}

TEST(MeasurePair, CountsSatellites) {
  const CameraConfig camera;
  FlyingDroplet satellite = droplet_at(400.0, 200.0);
  satellite.diameter_um = 18.0;
  FlyingDroplet other = satellite;
  other.y_um = 150.0;
  const GrayImage first = render({droplet_at(400.0, 300.0), satellite, other}, camera, 3);
  const GrayImage second = render({droplet_at(400.0, 500.0)}, camera, 4);
  const auto found = measure_pair(first, second, camera.strobe);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->satellites, 2);
  EXPECT_NEAR(found->velocity_m_s, 2.0, 0.01);
}

TEST(MeasurePair, HasNothingToSayWithoutADroplet) {
  EXPECT_FALSE(measure_pair(render({}, {}, 1), render({droplet_at(400, 300)}, {}, 2), {}));
}

TEST(MeasurePair, RefusesWhatCannotBe) {
  const GrayImage image = render({}, {}, 1);
  GrayImage broken = image;
  broken.pixels.pop_back();
  EXPECT_THAT(error_of([&] { find_droplets(broken); }), HasSubstr("found 320 x 480 with 153599 pixels"));
  EXPECT_THAT(error_of([&] { find_droplets({}); }), HasSubstr("found 0 x 0"));
  EXPECT_THAT(error_of([&] { measure_pair(image, image, {.delay_s = 0.0}); }), HasSubstr("delay 0 s"));
  CameraConfig small;
  small.width = 100;
  EXPECT_THAT(error_of([&] { measure_pair(image, render({}, small, 1), {}); }),
              HasSubstr("images of one size"));
}

TEST(TuneWaveform, WorksOnWhatTheCameraSees) {
  const JettingModel head;
  const DropletBand band;
  std::uint64_t seed = 0;
  const auto tuned =
      tune_waveform({}, band, [&](const Waveform& w) { return photograph(head, w, {}, ++seed); });
  ASSERT_EQ(tuned.shortfall, std::nullopt) << *tuned.shortfall;
  const auto truth = jet(head, tuned.waveform);
  ASSERT_TRUE(truth);
  EXPECT_NEAR(truth->droplet.velocity_m_s, tuned.droplet->velocity_m_s, 0.02);
  EXPECT_EQ(truth->satellites, 0);
  EXPECT_NEAR(tuned.waveform.dwell_us, head.best_dwell_us, 3.0);
}

}  // namespace
}  // namespace meltstage::motion
