// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/deposition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "motion/profile/profile.hpp"

namespace meltstage::motion {

namespace {

/// Share of the section that stretching leaves.
double stretched_share(const DepositionModel& model, double gap_mm) {
  if (gap_mm <= model.stringing_gap_mm) return 1.0;
  return std::max(model.least_share, std::exp(-(gap_mm - model.stringing_gap_mm) / model.stringing_mm));
}

}  // namespace

DepositedLine deposit(const DepositionModel& model, std::span<const double> lengths_mm,
                      std::span<const double> gaps_mm, double surge, std::uint64_t seed) {
  if (lengths_mm.size() != gaps_mm.size() || lengths_mm.size() < 2)
    throw MotionError(fmt::format("deposition: found {} lengths and {} gaps, expected as many, 2 at least",
                                  lengths_mm.size(), gaps_mm.size()));
  if (!std::isfinite(surge))
    throw MotionError(fmt::format("deposition: found surge {}, expected a finite number", surge));
  if (!std::is_sorted(lengths_mm.begin(), lengths_mm.end()))
    throw MotionError(
        "deposition: found lengths that fall, expected each as long as the one before at least");
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise;  // of unit deviation
  DepositedLine line;
  line.lengths_mm.assign(lengths_mm.begin(), lengths_mm.end());
  for (std::size_t i = 0; i < lengths_mm.size(); ++i) {
    if (!std::isfinite(gaps_mm[i]) || !std::isfinite(lengths_mm[i]))
      throw MotionError(
          fmt::format("deposition: gap {} mm at {} mm, expected finite numbers", gaps_mm[i], lengths_mm[i]));
    const double gap = std::max(gaps_mm[i], model.least_gap_mm), slit = model.slit_gap_mm / gap;
    const double to_end_mm = std::min(lengths_mm[i] - lengths_mm.front(), lengths_mm.back() - lengths_mm[i]);
    const double excess = 1.0 + surge * model.end_excess * std::exp(-to_end_mm / model.end_mm);
    const double pressed_mm2 = model.section_mm2 * excess / (1.0 + slit * slit * slit);
    const double share = stretched_share(model, gap);
    // Stretched paste is as flat as it was where the stretching began.
    const double flat_mm = std::min(gap, model.stringing_gap_mm);
    line.sections_mm2.push_back(pressed_mm2 * share);
    line.widths_mm.push_back(std::max(0.02, pressed_mm2 / flat_mm * std::pow(share, model.thinning) +
                                                model.width_noise_mm * noise(random)));
    if (i > 0)
      line.resistance_ohm += 0.5 * model.resistivity_ohm_mm * (lengths_mm[i] - lengths_mm[i - 1]) *
                             (1.0 / line.sections_mm2[i] + 1.0 / line.sections_mm2[i - 1]);
  }
  return line;
}

WidthFigures measure_widths(const DepositedLine& line, int count) {
  if (line.lengths_mm.empty() || count < 2)
    throw MotionError(
        fmt::format("widths: found {} places on a line of {} points, expected 2 at least on 1 at least",
                    count, line.lengths_mm.size()));
  if (line.widths_mm.size() != line.lengths_mm.size())
    throw MotionError(fmt::format("widths: found {} widths at {} places, expected one a place",
                                  line.widths_mm.size(), line.lengths_mm.size()));
  WidthFigures out;
  std::vector<double> widths;
  const double first = line.lengths_mm.front(), way = line.lengths_mm.back() - first;
  for (int i = 0; i < count; ++i) {
    const double at = first + way * (i + 0.5) / count;
    const auto after = std::lower_bound(line.lengths_mm.begin(), line.lengths_mm.end(), at);
    widths.push_back(line.widths_mm[static_cast<std::size_t>(after - line.lengths_mm.begin())]);
    out.mean_mm += widths.back() / count;
  }
  for (const double width : widths) out.deviation_mm += (width - out.mean_mm) * (width - out.mean_mm);
  out.deviation_mm = std::sqrt(out.deviation_mm / (count - 1));
  return out;
}

}  // namespace meltstage::motion
