// SPDX-License-Identifier: Apache-2.0
// QUALITY: how well the loop has done since the set-point last changed. Twin of rtl/tc_quality.sv.
#pragma once

#include <cstdint>

#include "flops.hpp"

namespace meltstage::chip {

#define TC_QUALITY_FLOPS(X)            \
  X(std::uint8_t, run_q, 1, 0)         \
  X(std::uint8_t, up_q, 1, 0)          \
  X(std::uint8_t, in_band_q, 1, 0)     \
  X(std::uint8_t, reached_q, 1, 0)     \
  X(std::int16_t, target_q, 16, 0)     \
  X(std::int16_t, peak_q, 16, 0)       \
  X(std::uint16_t, over_q, 16, 0)      \
  X(std::uint16_t, error_q, 16, 0)     \
  X(std::uint16_t, since_q, 16, 0)     \
  X(std::uint16_t, band_q, 16, 0xFFFF) \
  X(std::uint32_t, clocks_q, 21, 0)    \
  X(std::uint32_t, on_q, 32, 0)

struct QualityIn {
  bool run;
  bool sample;
  bool tenth;
  std::int16_t pv;
  std::int16_t target;
  std::uint16_t window;  // AT_WINDOW, 0.1 degC
  bool at_temp;
  bool heater;
};

struct Quality {
  TC_QUALITY_FLOPS(TC_DECLARE_FLOP)

  void step(const QualityIn& in);
  // Between its events only the heater's time counts.
  std::uint64_t quiet(const QualityIn& in) const;
  void skip(const QualityIn& in, std::uint64_t clocks);

 private:
  bool restarts(const QualityIn& in) const { return in.run && (run_q == 0 || in.target != target_q); }
};

}  // namespace meltstage::chip
