// SPDX-License-Identifier: Apache-2.0
#include "sensc.hpp"

#include <algorithm>

#include "math.hpp"

namespace meltstage::chip {
namespace {

enum State : std::uint8_t { kIdle = 0b0000, kGap = 0b0011, kLead = 0b0101, kShift = 0b0110, kJudge = 0b1001 };

constexpr std::uint8_t kGapHalves = 4;
constexpr std::uint8_t kSetupEdges = 32;
constexpr std::uint32_t kTxMask = 0x1FFFF;   // 17 bits
constexpr std::uint8_t kLeftMask = 0x7F;     // 7 bits
constexpr std::uint16_t kTypeMask = 0x7;     // bits of SENS_TYPE that reach the block
constexpr std::uint16_t kSpiDivMask = 0xFF;  // and of SPI_DIV

// acc_q has 33 bits. A sound description never fills them; one that changes during a frame wraps as the flops
// do.
constexpr std::int64_t wrap33(std::int64_t x) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(x) << 31) >> 31;
}

// Values outside 1 .. limit count as the limit.
constexpr unsigned in_range(unsigned value, unsigned limit) {
  return value == 0 || value > limit ? limit : value;
}

constexpr unsigned spi_mode_of(unsigned frame) {
  return (frame & spec::kSensFrameSpiModeMask) >> spec::kSensFrameSpiMode;
}

// SPI mode alone, all that an idle clock needs.
unsigned spi_mode(const Params& params) {
  const unsigned type = params[spec::kRegSensType] & kTypeMask;
  if (type == 0) return spi_mode_of(params[spec::kRegSensFrame]);
  return type < spec::kSensorPresets.size() ? spi_mode_of(spec::kSensorPresets[type].frame) : 0u;
}

// Clock of a half period that ends it.
std::uint16_t last_of_half(const Params& params) {
  return std::max<std::uint16_t>(params[spec::kRegSpiDiv] & kSpiDivMask, 2);
}

spec::SensorPreset description(const Params& params) {
  const unsigned type = params[spec::kRegSensType] & kTypeMask;
  if (type != 0)
    return type < spec::kSensorPresets.size() ? spec::kSensorPresets[type] : spec::SensorPreset{};
  spec::SensorPreset d{};
  d.frame = params[spec::kRegSensFrame];
  d.data = params[spec::kRegSensData];
  d.scale = params[spec::kRegSensScale];
  d.offset = params[spec::kRegSensOffset];
  d.fault_mask = params[spec::kRegSensFaultMask];
  d.check_mask =
      static_cast<std::uint32_t>(params[spec::kRegSensCheckMaskH]) << 16 | params[spec::kRegSensCheckMaskL];
  d.check_value =
      static_cast<std::uint32_t>(params[spec::kRegSensCheckValueH]) << 16 | params[spec::kRegSensCheckValueL];
  d.setup = params[spec::kRegSensSetup];
  return d;
}

}  // namespace

SensorFrame sensor_frame(const Params& params) {
  const spec::SensorPreset d = description(params);
  SensorFrame f{};
  f.length = in_range((d.frame & spec::kSensFrameLengthMask) >> spec::kSensFrameLength, 32);
  f.mode = spi_mode_of(d.frame);
  f.tx = (d.data & spec::kSensDataFirstSentMask) >> spec::kSensDataFirstSent;
  f.field_low = (d.frame & spec::kSensFrameLowMask) >> spec::kSensFrameLow;
  f.field_end = f.field_low + in_range((d.data & spec::kSensDataBitsMask) >> spec::kSensDataBits, 16);
  f.is_signed = (d.frame >> spec::kSensFrameSigned & 1u) != 0;
  f.scale = d.scale;
  f.offset = static_cast<std::int16_t>(d.offset);
  f.fault_mask = d.fault_mask;
  f.check_mask = d.check_mask;
  f.check_value = d.check_value;
  f.setup = d.setup;
  return f;
}

void Sensc::idle(const SenscIn& in) {
  const unsigned mode = spi_mode(in.params);
  half_q = 0;
  mode_q = static_cast<std::uint8_t>(mode);
  sclk_q = static_cast<std::uint8_t>(mode >> 1);
  if (in.start) {
    state_q = kGap;
    left_q = kGapHalves;
    setup_q = setup_due_q != 0 && sensor_frame(in.params).setup != 0;
    setup_due_q = in.reconfig;
  } else if (in.reconfig) {
    setup_due_q = 1;
  }
}

// The bit of the half period that ends now: the odd number of edges left says that the last one was a leading
// edge.
void Sensc::sample(const SensorFrame& frame, bool miso) {
  const unsigned place = left_q >> 1;
  rx_q = rx_q << 1 | (miso ? 1u : 0u);
  if (!miso) zero_seen_q = 1;
  if (place < frame.field_low || place >= frame.field_end) return;
  const bool sign_bit = frame.is_signed && place + 1 == frame.field_end;
  const std::int64_t weight = sign_bit ? -std::int64_t{frame.scale} : std::int64_t{frame.scale};
  acc_q = wrap33(2 * acc_q + (miso ? weight : 0));
}

void Sensc::make_edge() {
  left_q = (left_q - 1u) & kLeftMask;
  const unsigned leading = left_q & 1u;
  sclk_q = static_cast<std::uint8_t>((mode_q >> 1) ^ leading);
  if (leading == (mode_q & 1u)) tx_q = tx_q << 1 & kTxMask;
}

void Sensc::begin_frame(const SensorFrame& frame) {
  const std::uint32_t word = setup_q != 0 ? frame.setup : frame.tx << 8;
  state_q = kLead;
  cs_nq = 0;
  left_q = setup_q != 0 ? kSetupEdges : static_cast<std::uint8_t>(2 * frame.length);
  // Without CPHA the first bit is there before the first edge, with it only at that edge.
  tx_q = (mode_q & 1u) != 0 ? word : word << 1;
  rx_q = 0;
  zero_seen_q = 0;
  acc_q = 0;
}

void Sensc::end_frame() {
  state_q = setup_q != 0 ? kGap : kJudge;
  cs_nq = 1;
  tx_q = 0;
  setup_q = 0;
  left_q = kGapHalves;
}

void Sensc::judge(const Params& params) {
  const SensorFrame frame = sensor_frame(params);
  const bool mismatch = ((rx_q ^ frame.check_value) & frame.check_mask) != 0;
  const bool all_zero = rx_q == 0;
  state_q = kIdle;
  done_q = 1;
  pv_q = static_cast<std::uint16_t>(sat_s16((acc_q >> 8) + frame.offset + params.s16(spec::kRegSensTrim)));
  raw_q = rx_q;
  dev_fault_q = (rx_q & frame.fault_mask) != 0;
  frame_bad_q = mismatch || zero_seen_q == 0 || (all_zero && all_zero_q != 0);
  all_zero_q = all_zero;
  if (!ok()) setup_due_q = 1;
}

std::uint64_t Sensc::quiet(const SenscIn& in) const {
  if (done_q != 0 || in.start || in.reconfig) return 0;
  switch (state_q) {
    case kIdle: {
      const unsigned mode = spi_mode(in.params);
      return half_q == 0 && mode_q == mode && sclk_q == mode >> 1 ? kForever : 0;
    }
    case kGap:
    case kLead:
    case kShift: {
      const std::uint16_t last = last_of_half(in.params);
      return half_q < last ? last - half_q : 0;
    }
    default:
      return 0;
  }
}

void Sensc::skip(std::uint64_t clocks) {
  if (state_q != kIdle) half_q = static_cast<std::uint8_t>(half_q + clocks);
}

void Sensc::step(const SenscIn& in) {
  done_q = 0;
  if (state_q == kIdle) {
    idle(in);
    return;
  }
  if (in.reconfig) setup_due_q = 1;
  const bool half_end = half_q >= last_of_half(in.params);
  half_q = half_end ? std::uint8_t{0} : static_cast<std::uint8_t>(half_q + 1);

  switch (state_q) {
    case kGap:
      if (!half_end) break;
      if (left_q <= 1) {
        begin_frame(sensor_frame(in.params));
      } else {
        --left_q;
      }
      break;
    case kLead:
      if (half_end) {
        make_edge();
        state_q = kShift;
      }
      break;
    case kShift:
      if (!half_end) break;
      if ((left_q & 1u) != (mode_q & 1u)) sample(sensor_frame(in.params), in.miso);
      if (left_q != 0) {
        make_edge();
      } else {
        end_frame();
      }
      break;
    case kJudge:
      judge(in.params);
      break;
    default:
      state_q = kIdle;
      cs_nq = 1;
      sclk_q = mode_q >> 1;
      tx_q = 0;
      break;
  }
}

}  // namespace meltstage::chip
