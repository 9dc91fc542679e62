// SPDX-License-Identifier: Apache-2.0
// SENSC, the sensor interface; twin of rtl/tc_sensc.sv, theory of operation in docs/chip/blocks/sensc.md.
#pragma once

#include <cstdint>

#include "flops.hpp"
#include "params.hpp"
#include "spec.hpp"

namespace meltstage::chip {

#define TC_SENSC_FLOPS(X)            \
  X(std::uint8_t, state_q, 4, 0)     \
  X(std::uint8_t, mode_q, 2, 0)      \
  X(std::uint8_t, setup_q, 1, 0)     \
  X(std::uint8_t, setup_due_q, 1, 1) \
  X(std::uint8_t, half_q, 8, 0)      \
  X(std::uint8_t, left_q, 7, 0)      \
  X(std::uint8_t, sclk_q, 1, 0)      \
  X(std::uint8_t, cs_nq, 1, 1)       \
  X(std::uint32_t, tx_q, 17, 0)      \
  X(std::uint32_t, rx_q, 32, 0)      \
  X(std::uint8_t, zero_seen_q, 1, 0) \
  X(std::uint8_t, all_zero_q, 1, 0)  \
  X(std::int64_t, acc_q, 33, 0)      \
  X(std::uint16_t, pv_q, 16, 0)      \
  X(std::uint32_t, raw_q, 32, 0)     \
  X(std::uint8_t, done_q, 1, 0)      \
  X(std::uint8_t, dev_fault_q, 1, 0) \
  X(std::uint8_t, frame_bad_q, 1, 0)

// What a frame description says, decoded (lengths outside their range count as 32 and 16).
struct SensorFrame {
  unsigned length;     // bits of the frame
  unsigned mode;       // SPI mode, {CPOL, CPHA}
  unsigned tx;         // first byte sent
  unsigned field_low;  // place of the field's lowest bit, 0 = last bit of the frame
  unsigned field_end;  // place above its highest bit
  bool is_signed;
  std::uint16_t scale;  // UQ8.8, 1/64 degC per field LSB
  std::int16_t offset;  // 1/64 degC
  std::uint16_t fault_mask;
  std::uint32_t check_mask;
  std::uint32_t check_value;
  std::uint16_t setup;  // 0 = none
};

// The description in force: preset SENS_TYPE, or the SENS_* registers when that is 0.
SensorFrame sensor_frame(const Params& params);

struct SenscIn {
  const Params& params;  // SENS_*, SPI_DIV
  bool start = false;
  bool reconfig = false;  // a parameter commit happened
  bool miso = false;      // the pin two clocks ago
};

struct Sensc {
  TC_SENSC_FLOPS(TC_DECLARE_FLOP)

  // One rising clock edge, not in reset.
  void step(const SenscIn& in);
  std::uint64_t quiet(const SenscIn& in) const;
  void skip(std::uint64_t clocks);

  bool sclk() const { return sclk_q != 0; }
  bool cs_n() const { return cs_nq != 0; }
  bool mosi() const { return (tx_q >> 16 & 1u) != 0; }
  bool busy() const { return state_q != 0; }
  bool done() const { return done_q != 0; }
  bool ok() const { return dev_fault_q == 0 && frame_bad_q == 0; }
  bool dev_fault() const { return dev_fault_q != 0; }
  bool frame_bad() const { return frame_bad_q != 0; }
  std::int16_t pv() const { return static_cast<std::int16_t>(pv_q); }  // 1/64 degC
  std::uint32_t raw() const { return raw_q; }

 private:
  void sample(const SensorFrame& frame, bool miso);
  void make_edge();
  void begin_frame(const SensorFrame& frame);
  void end_frame();
  void judge(const Params& params);
  void idle(const SenscIn& in);
};

}  // namespace meltstage::chip
