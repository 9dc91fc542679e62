// SPDX-License-Identifier: Apache-2.0
#include "quality.hpp"

#include <algorithm>
#include <cstdlib>

#include "spec.hpp"

namespace meltstage::chip {

namespace {

constexpr std::uint32_t kTenthClocks = spec::kClkHz / 10;
constexpr std::uint32_t kClocksMask = (1U << 21) - 1;

// A clock with the heater on; an upset of the count runs to the end of its bits, as in the RTL.
void count_on(Quality& q) {
  const bool tenth = q.clocks_q == kTenthClocks - 1;
  q.clocks_q = tenth ? 0 : (q.clocks_q + 1) & kClocksMask;
  if (tenth) ++q.on_q;
}

void count_on_for(Quality& q, std::uint64_t clocks) {
  if (q.clocks_q >= kTenthClocks) {
    const std::uint64_t to_wrap = kClocksMask + 1 - q.clocks_q;
    if (clocks < to_wrap) {
      q.clocks_q += static_cast<std::uint32_t>(clocks);
      return;
    }
    clocks -= to_wrap;
    q.clocks_q = 0;
  }
  const std::uint64_t sum = q.clocks_q + clocks;
  q.clocks_q = static_cast<std::uint32_t>(sum % kTenthClocks);
  q.on_q += static_cast<std::uint32_t>(sum / kTenthClocks);
}

}  // namespace

std::uint64_t Quality::quiet(const QualityIn& in) const {
  if ((run_q != 0) != in.run || restarts(in)) return 0;
  if (!in.run) return kForever;
  return in.sample || in.tenth || (in.at_temp && reached_q == 0) ? 0 : kForever;
}

void Quality::skip(const QualityIn& in, std::uint64_t clocks) {
  if (in.run && in.heater) count_on_for(*this, clocks);
}

void Quality::step(const QualityIn& in) {
  const bool restart = restarts(in);
  run_q = in.run;
  if (restart) {
    *this = Quality{};
    run_q = 1;
    target_q = in.target;
    up_q = in.target >= in.pv;
    peak_q = in.pv;
    return;
  }
  if (!in.run) return;
  if (in.sample) {
    const int error = in.pv - in.target;
    const int size = std::abs(error);
    const int excess = up_q != 0 ? error : -error;
    // 1/320 degC on both sides: 5 x 1/64 and 32 x 0.1.
    const bool in_window = size * 5 <= in.window * 32;
    peak_q = std::max(peak_q, in.pv);
    if (excess > over_q) over_q = static_cast<std::uint16_t>(excess);
    if (reached_q != 0) error_q = static_cast<std::uint16_t>(std::max<int>(error_q, size));
    if (!in_window) {
      band_q = 0xFFFF;
    } else if (in_band_q == 0) {
      band_q = since_q;
    }
    in_band_q = in_window;
  }
  if (in.at_temp) reached_q = 1;
  if (in.tenth && since_q != 0xFFFF) ++since_q;
  if (in.heater) count_on(*this);
}

}  // namespace meltstage::chip
