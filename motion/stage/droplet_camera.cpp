// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/droplet_camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

namespace meltstage::motion {
namespace {

constexpr int kFine = 4;     // subpixels a pixel, either way
constexpr int kFlashes = 9;  // moments of a flash

/// Adds the share of cover at one moment; the bright middle takes away what the ellipse has put there.
void cover(cv::Mat& fine, const FlyingDroplet& droplet, const CameraConfig& camera, double along_um,
           float weight) {
  const double scale = kFine / camera.strobe.pixel_um;
  const double angle = droplet.angle_deg * std::numbers::pi / 180.0;
  const double ux = std::sin(angle), uy = std::cos(angle);
  // middle of the first pixel is (0, 0): its first subpixel lies half a pixel before it
  const double cx = (droplet.x_um + along_um * ux) * scale + 0.5 * (kFine - 1);
  const double cy = (droplet.y_um + along_um * uy) * scale + 0.5 * (kFine - 1);
  const double minor = 0.5 * droplet.diameter_um * scale * std::sqrt(droplet.roundness);
  const double major = minor / droplet.roundness;
  const double bright = camera.highlight_share * camera.highlight_share;
  const int reach = static_cast<int>(std::ceil(major)) + 1;
  for (int y = std::max(0, static_cast<int>(cy) - reach);
       y <= std::min(fine.rows - 1, static_cast<int>(cy) + reach); ++y)
    for (int x = std::max(0, static_cast<int>(cx) - reach);
         x <= std::min(fine.cols - 1, static_cast<int>(cx) + reach); ++x) {
      const double dx = x - cx, dy = y - cy;
      const double along = (dx * ux + dy * uy) / major, across = (dx * uy - dy * ux) / minor;
      const double square = along * along + across * across;
      if (square <= 1.0 && square > bright) fine.at<float>(y, x) += weight;
    }
}

}  // namespace

GrayImage render(const std::vector<FlyingDroplet>& droplets, const CameraConfig& camera, std::uint64_t seed) {
  cv::Mat fine = cv::Mat::zeros(camera.height * kFine, camera.width * kFine, CV_32F);
  for (const FlyingDroplet& droplet : droplets)
    for (int flash = 0; flash < kFlashes; ++flash) {
      const double share = (flash + 0.5) / kFlashes - 0.5;
      cover(fine, droplet, camera, share * droplet.velocity_m_s * 1e6 * camera.strobe.flash_s,
            1.0F / kFlashes);
    }
  cv::Mat covered;
  cv::resize(fine, covered, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(covered, covered, {0, 0}, camera.blur_px);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  GrayImage image{camera.width, camera.height, {}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const double light =
          camera.background + camera.gradient * (static_cast<double>(x) / camera.width - 0.5);
      const double level = light - camera.darkness * covered.at<float>(y, x) + camera.noise * noise(random);
      image.pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L)));
    }
  return image;
}

std::optional<JettedDroplet> jet(const JettingModel& head, const Waveform& waveform) {
  const double off = (waveform.dwell_us - head.best_dwell_us) / head.dwell_width_us;
  const double drive_v = waveform.amplitude_v * std::exp(-off * off);
  if (drive_v <= head.threshold_v) return std::nullopt;
  JettedDroplet result;
  FlyingDroplet& droplet = result.droplet;
  droplet.velocity_m_s = head.gain_m_s_v * (drive_v - head.threshold_v);
  droplet.diameter_um = head.diameter_um;
  droplet.roundness = 1.0 / (1.0 + head.stretch_s2_m2 * droplet.velocity_m_s * droplet.velocity_m_s);
  droplet.angle_deg = head.angle_deg;
  result.satellites = droplet.velocity_m_s > head.satellite_m_s_us * waveform.fall_us ? 1 : 0;
  return result;
}

std::optional<DropletFigures> photograph(const JettingModel& head, const Waveform& waveform,
                                         const CameraConfig& camera, std::uint64_t seed) {
  const auto jetted = jet(head, waveform);
  if (!jetted) return std::nullopt;
  const auto image_at = [&](double time_s, std::uint64_t image_seed) {
    FlyingDroplet droplet = jetted->droplet;
    const double angle = droplet.angle_deg * std::numbers::pi / 180.0,
                 way_um = droplet.velocity_m_s * 1e6 * time_s;
    droplet.x_um = 0.5 * camera.width * camera.strobe.pixel_um + way_um * std::sin(angle);
    droplet.y_um = 0.25 * camera.height * camera.strobe.pixel_um + way_um * std::cos(angle);
    std::vector<FlyingDroplet> droplets = {droplet};
    for (int i = 0; i < jetted->satellites; ++i) {
      FlyingDroplet satellite = droplet;
      satellite.diameter_um = 0.3 * droplet.diameter_um;
      satellite.roundness = 1.0;
      satellite.y_um -= (1.2 + 0.6 * i) * droplet.diameter_um;
      droplets.push_back(satellite);
    }
    return render(droplets, camera, image_seed);
  };
  // The delay follows the speed: a fast droplet must not leave the image.
  StrobeSetup setup = camera.strobe;
  const double longest_s = 0.5 * camera.height * setup.pixel_um * 1e-6 / jetted->droplet.velocity_m_s;
  setup.delay_s = std::min(setup.delay_s, longest_s);
  return measure_pair(image_at(0.0, 2 * seed), image_at(setup.delay_s, 2 * seed + 1), setup);
}

}  // namespace meltstage::motion
