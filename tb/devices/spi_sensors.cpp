// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/spi_sensors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace meltstage::tb {
namespace {

// Nearest multiple of 1/steps_per_degc, held inside [low, high] counts.
int quantise(double degc, double steps_per_degc, int low, int high) {
  return static_cast<int>(
      std::lround(std::clamp(degc * steps_per_degc, static_cast<double>(low), static_cast<double>(high))));
}

// MAX31865 configuration bits (data sheet, table 2).
constexpr std::uint8_t kBiasOn = 0x80;
constexpr std::uint8_t kAutoConvert = 0x40;
constexpr std::uint8_t kOneShot = 0x20;
constexpr std::uint8_t kFaultCycle = 0x0C;
constexpr std::uint8_t kFaultCycleAuto = 0x04;
constexpr std::uint8_t kFaultCycleManualEnd = 0x0C;
constexpr std::uint8_t kFaultClear = 0x02;
constexpr std::uint8_t kFilter50Hz = 0x01;
constexpr double kFaultCycleTime_s = 550e-6;

// ADT7310/20 configuration bits [6:5].
constexpr std::uint16_t kAdtModeMask = 0x60;
constexpr std::uint16_t kAdtContinuous = 0x00;
constexpr std::uint16_t kAdtOneShot = 0x20;
constexpr std::uint16_t kAdtOnePerSecond = 0x40;
constexpr std::uint16_t kAdt16Bit = 0x80;
constexpr std::uint16_t kAdtNotReady = 0x80;

constexpr bool is_adt_word_register(unsigned address) {
  return address == 2 || address == 4 || address == 6 || address == 7;
}

}  // namespace

SpiSensor::SpiSensor(SpiSensorConfig config) : config_(std::move(config)), miso_(config_.miso_pull) {
  if (!(config_.clock_hz > 0.0)) {
    throw std::invalid_argument(fmt::format("SPI sensor: clock_hz is {}, expected > 0", config_.clock_hz));
  }
  if (!config_.source) throw std::invalid_argument("SPI sensor: no temperature source, expected a function");
  if (!(config_.noise_sigma_degc >= 0.0) || !(config_.conversion_s >= 0.0)) {
    throw std::invalid_argument(
        fmt::format("SPI sensor: noise_sigma_degc {} and conversion_s {}, expected >= 0",
                    config_.noise_sigma_degc, config_.conversion_s));
  }
}

void SpiSensor::set_faults(const SpiFaults& faults) {
  faults_ = faults;
  refresh_miso();
}

void SpiSensor::power_cycle(std::uint64_t cycle) {
  release();
  power_on(cycle);
}

void SpiSensor::advance(std::uint64_t cycle, bool cs_n, bool sclk, bool mosi) {
  while (next_event_ <= cycle) convert(std::exchange(next_event_, kNoEvent));
  const bool was_cs_n = (pins_ & 4) != 0;
  const bool was_sclk = (pins_ & 2) != 0;
  if (was_cs_n && !cs_n) {
    bit_index_ = 0;
    selected(cycle, sclk);
  } else if (!was_cs_n && cs_n) {
    ++frames_;
    corrupt_mask_ = 0;
    deselected(cycle);
    release();
  } else if (!cs_n && sclk != was_sclk) {
    clock_edge(cycle, sclk, mosi);
  }
}

void SpiSensor::drive(Drive level) {
  const bool corrupt = bit_index_ < 64 && ((corrupt_mask_ >> bit_index_) & 1U) != 0;
  ++bit_index_;
  if (corrupt && level != Drive::high_z) level = level == Drive::high ? Drive::low : Drive::high;
  output_ = level;
  refresh_miso();
}

void SpiSensor::release() {
  output_ = Drive::high_z;
  refresh_miso();
}

void SpiSensor::refresh_miso() {
  switch (faults_.miso) {
    case MisoFault::stuck_low:
      miso_ = false;
      return;
    case MisoFault::stuck_high:
      miso_ = true;
      return;
    case MisoFault::absent:
      miso_ = config_.miso_pull;
      return;
    case MisoFault::none:
      break;
  }
  miso_ = output_ == Drive::high_z ? config_.miso_pull : output_ == Drive::high;
}

void SpiSensor::schedule(std::uint64_t cycle, double data_sheet_s) {
  schedule_exactly(cycle, config_.conversion_s > 0.0 ? config_.conversion_s : data_sheet_s);
}

void SpiSensor::schedule_exactly(std::uint64_t cycle, double seconds) {
  next_event_ = cycle + static_cast<std::uint64_t>(std::max(1LL, std::llround(seconds * config_.clock_hz)));
}

double SpiSensor::measure_degc(std::uint64_t cycle) {
  const double degc = config_.source(cycle);
  return config_.noise_sigma_degc > 0.0 ? degc + config_.noise_sigma_degc * config_.noise.gaussian() : degc;
}

// ---------------------------------------------------------------------------------------------- one-word
// sensors

void WordSensor::selected(std::uint64_t, bool) {
  word_ = word();
  sent_ = 0;
  drive_next();
}

void WordSensor::clock_edge(std::uint64_t, bool rising, bool) {
  if (!rising) drive_next();
}

void WordSensor::drive_next() {
  if (sent_ >= word_.length) {
    sent_ = word_.length + 1;
    release();
    return;
  }
  const std::uint32_t bit = std::uint32_t{1} << (word_.length - 1 - sent_);
  ++sent_;
  if ((word_.undriven_mask & bit) != 0) {
    drive(Drive::high_z);
  } else {
    drive((word_.bits & bit) != 0 ? Drive::high : Drive::low);
  }
}

std::uint32_t max31855_word(double thermocouple_degc, double cold_junction_degc, ProbeFault fault) {
  const auto thermocouple =
      static_cast<std::uint32_t>(quantise(thermocouple_degc, 4.0, -8192, 8191)) & 0x3FFFU;
  const auto cold = static_cast<std::uint32_t>(quantise(cold_junction_degc, 16.0, -2048, 2047)) & 0xFFFU;
  const std::uint32_t cause = fault == ProbeFault::open              ? 1U
                              : fault == ProbeFault::short_to_ground ? 2U
                              : fault == ProbeFault::short_to_supply ? 4U
                                                                     : 0U;
  return thermocouple << 18 | (cause != 0 ? 1U << 16 : 0U) | cold << 4 | cause;
}

Max31855::Max31855(SpiSensorConfig config) : WordSensor(std::move(config)) { power_on(0); }

void Max31855::power_on(std::uint64_t cycle) {
  data_ = 0;
  schedule(cycle, 0.200);
}

void Max31855::convert(std::uint64_t cycle) {
  const double degc = measure_degc(cycle);
  if (!faults().frozen) {
    // With a wiring fault the amplifier runs to its rail, a short to ground leaves the cold junction alone.
    const ProbeFault fault = faults().probe;
    const double read = fault == ProbeFault::short_to_ground ? config().cold_junction_degc
                        : fault == ProbeFault::open || fault == ProbeFault::short_to_supply ? 2047.75
                                                                                            : degc;
    data_ = max31855_word(read, config().cold_junction_degc, fault);
  }
  schedule(cycle, 0.070);
}

void Max31855::selected(std::uint64_t cycle, bool sclk) {
  unschedule();
  WordSensor::selected(cycle, sclk);
}

void Max31855::deselected(std::uint64_t cycle) { schedule(cycle, 0.070); }

WordSensor::Word Max31855::word() const {
  return {faults().reserved_bits_wrong ? data_ ^ 0x00020008U : data_, 32, 0};
}

std::uint16_t max6675_word(double thermocouple_degc, bool open) {
  const int counts = quantise(thermocouple_degc, 4.0, 0, 4095);
  return static_cast<std::uint16_t>(counts << 3 | (open ? 4 : 0));
}

Max6675::Max6675(SpiSensorConfig config) : WordSensor(std::move(config)) { power_on(0); }

void Max6675::power_on(std::uint64_t cycle) {
  data_ = 0;
  schedule(cycle, 0.170);
}

void Max6675::convert(std::uint64_t cycle) {
  const double degc = measure_degc(cycle);
  if (!faults().frozen) {
    // The part knows only "open"; a shorted junction reads as the cold junction, a line at supply as full
    // scale.
    const ProbeFault fault = faults().probe;
    const bool open = fault == ProbeFault::open;
    const double read = fault == ProbeFault::short_to_ground           ? config().cold_junction_degc
                        : open || fault == ProbeFault::short_to_supply ? 1023.75
                                                                       : degc;
    data_ = max6675_word(read, open);
  }
  schedule(cycle, 0.170);
}

void Max6675::selected(std::uint64_t cycle, bool sclk) {
  unschedule();
  WordSensor::selected(cycle, sclk);
}

void Max6675::deselected(std::uint64_t cycle) { schedule(cycle, 0.170); }

WordSensor::Word Max6675::word() const {
  return {faults().reserved_bits_wrong ? data_ ^ 0x8002U : data_, 16, 0x0001};
}

std::uint16_t lm70_word(double temperature_degc) {
  const int counts = quantise(temperature_degc, 4.0, -1024, 1023);
  return static_cast<std::uint16_t>(static_cast<unsigned>(counts) << 5 | 0x1CU);
}

Lm70::Lm70(SpiSensorConfig config) : WordSensor(std::move(config)) { power_on(0); }

void Lm70::power_on(std::uint64_t cycle) {
  data_ = lm70_word(0.0);
  shut_down_ = false;
  schedule(cycle, 0.140);
}

void Lm70::convert(std::uint64_t cycle) {
  const double degc = measure_degc(cycle);
  if (!faults().frozen) data_ = lm70_word(degc);
  schedule(cycle, 0.140);
}

void Lm70::selected(std::uint64_t cycle, bool sclk) {
  written_bits_ = 0;
  written_ = 0;
  WordSensor::selected(cycle, sclk);
}

void Lm70::deselected(std::uint64_t cycle) {
  if (written_bits_ != 16) return;
  const bool shut_down = (written_ & 0xFFU) == 0xFFU;
  if (shut_down == shut_down_) return;
  shut_down_ = shut_down;
  if (shut_down) {
    unschedule();
  } else {
    schedule(cycle, 0.140);
  }
}

void Lm70::clock_edge(std::uint64_t cycle, bool rising, bool mosi) {
  if (rising && word_done() && written_bits_ < 16) {
    written_ = static_cast<std::uint16_t>(written_ << 1 | (mosi ? 1 : 0));
    ++written_bits_;
  }
  WordSensor::clock_edge(cycle, rising, mosi);
}

WordSensor::Word Lm70::word() const {
  const std::uint16_t bits = shut_down_ ? 0x8100 : data_;
  return {faults().reserved_bits_wrong ? bits ^ 0x1CU : bits, 16, 0x0003};
}

// ------------------------------------------------------------------------------------------------------
// MAX31865

double pt100_ohm(double temperature_degc) {
  const double t = temperature_degc;
  double ratio = 1.0 + 3.9083e-3 * t - 5.775e-7 * t * t;
  if (t < 0.0) ratio += -4.183e-12 * (t - 100.0) * t * t * t;
  return 100.0 * ratio;
}

std::uint16_t max31865_code(double temperature_degc, RtdCurve curve) {
  if (curve == RtdCurve::linear) {
    return static_cast<std::uint16_t>(quantise(temperature_degc + 256.0, 32.0, 0, 0x7FFF));
  }
  const double code = std::floor(pt100_ohm(temperature_degc) / 400.0 * 32768.0);
  return static_cast<std::uint16_t>(std::clamp(code, 0.0, 32767.0));
}

Max31865::Max31865(SpiSensorConfig config, RtdCurve curve) : SpiSensor(std::move(config)), curve_(curve) {
  power_on(0);
}

void Max31865::power_on(std::uint64_t) {
  registers_ = {0x00, 0x00, 0x00, 0xFF, 0xFF, 0x00, 0x00, 0x00};
  detecting_ = false;
  unschedule();
}

void Max31865::convert(std::uint64_t cycle) {
  if (detecting_) {
    detecting_ = false;
    detect_faults();
    if ((registers_[0] & kAutoConvert) != 0) schedule(cycle, conversion_s());
    return;
  }
  const double degc = measure_degc(cycle);
  const bool shorted =
      faults().probe == ProbeFault::short_to_ground || faults().probe == ProbeFault::short_to_supply;
  if (shorted) {
    raise_fault(0x04);  // the input protection opens and no conversion ends
  } else if (!faults().frozen) {
    const unsigned code = faults().probe == ProbeFault::open ? 0x7FFFU : max31865_code(degc, curve_);
    registers_[1] = static_cast<std::uint8_t>(code >> 7);
    registers_[2] = static_cast<std::uint8_t>(code << 1 | (registers_[7] != 0 ? 1U : 0U));
    const unsigned high = (registers_[3] << 8 | registers_[4]) >> 1;
    const unsigned low = (registers_[5] << 8 | registers_[6]) >> 1;
    if (code >= high) raise_fault(0x80);
    if (code <= low) raise_fault(0x40);
  }
  registers_[0] &= static_cast<std::uint8_t>(~kOneShot);
  if ((registers_[0] & kAutoConvert) != 0)
    schedule(cycle, (registers_[0] & kFilter50Hz) != 0 ? 0.020 : 1.0 / 60.0);
}

double Max31865::conversion_s() const { return (registers_[0] & kFilter50Hz) != 0 ? 0.0625 : 0.052; }

void Max31865::detect_faults() {
  switch (faults().probe) {
    case ProbeFault::none:
      break;
    case ProbeFault::open:
      raise_fault(0x20);
      break;  // REFIN- above 0.85 bias: no current flows
    case ProbeFault::force_lead_open:
      raise_fault(0x18);
      break;  // REFIN- and RTDIN- below 0.85 bias
    case ProbeFault::short_to_ground:
    case ProbeFault::short_to_supply:
      raise_fault(0x04);
      break;
  }
  registers_[0] &= static_cast<std::uint8_t>(~kFaultCycle);
}

void Max31865::raise_fault(std::uint8_t bits) {
  registers_[7] |= bits;
  registers_[2] |= 1U;
}

std::uint8_t Max31865::read(unsigned address) const {
  const std::uint8_t value = frame_registers_[address & 7U];
  return (address & 7U) == 7U && faults().reserved_bits_wrong ? static_cast<std::uint8_t>(value ^ 0x03U)
                                                              : value;
}

void Max31865::selected(std::uint64_t, bool sclk) {
  idle_clock_ = sclk;
  frame_registers_ = registers_;
  bits_ = 0;
  address_ = 0;
  shift_in_ = 0;
}

void Max31865::deselected(std::uint64_t) {}

void Max31865::clock_edge(std::uint64_t cycle, bool rising, bool mosi) {
  const bool leading = rising != idle_clock_;
  const bool reading = bits_ >= 8 && (address_ & 0x80U) == 0;
  if (leading) {
    if (reading) drive((read(address_) >> (7U - bits_ % 8U) & 1U) != 0 ? Drive::high : Drive::low);
    return;
  }
  shift_in_ = static_cast<std::uint8_t>(shift_in_ << 1 | (mosi ? 1 : 0));
  if (++bits_ % 8 != 0) return;
  if (bits_ == 8) {
    address_ = shift_in_;
    return;
  }
  if (!reading) write(cycle, address_ & 0x7FU, shift_in_);
  address_ = static_cast<std::uint8_t>((address_ & 0x80U) | ((address_ + 1U) & 0x07U));
}

void Max31865::write(std::uint64_t cycle, unsigned address, std::uint8_t value) {
  if (address == 0) {
    write_configuration(cycle, value);
  } else if (address >= 3 && address <= 6) {
    registers_[address] = value;
  }
}

void Max31865::write_configuration(std::uint64_t cycle, std::uint8_t value) {
  const std::uint8_t before = registers_[0];
  if ((value & kFaultClear) != 0) {
    registers_[7] = 0;
    registers_[2] &= 0xFE;
  }
  registers_[0] = static_cast<std::uint8_t>(value & ~kFaultClear);
  const bool biased = (value & kBiasOn) != 0;
  const bool was_converting = (before & (kBiasOn | kAutoConvert)) == (kBiasOn | kAutoConvert);
  if (!biased) {
    detecting_ = false;
    unschedule();
  } else if ((value & kFaultCycle) == kFaultCycleAuto) {
    detecting_ = true;
    schedule_exactly(cycle, kFaultCycleTime_s);
  } else if ((value & kFaultCycle) == kFaultCycleManualEnd) {
    detect_faults();
  } else if ((value & kAutoConvert) != 0) {
    if (!was_converting) schedule(cycle, conversion_s());
  } else if ((value & kOneShot) != 0) {
    schedule(cycle, conversion_s());
  } else {
    unschedule();
  }
}

// ----------------------------------------------------------------------------------------------- ADT7310,
// ADT7320

std::uint16_t adt73x0_word(double temperature_degc) {
  return static_cast<std::uint16_t>(quantise(temperature_degc, 128.0, -32768, 32767));
}

Adt73x0::Adt73x0(SpiSensorConfig config) : SpiSensor(std::move(config)) { power_on(0); }

void Adt73x0::power_on(std::uint64_t cycle) {
  registers_ = {kAdtNotReady, 0x00, 0x0000, 0xC3, 0x4980, 0x05, 0x2000, 0x0500};
  flags_ = 0;
  continuous_read_ = false;
  phase_ = Phase::command;
  bits_in_ = 0;
  bits_left_ = 0;
  ones_ = 0;
  schedule(cycle, 0.006);
}

void Adt73x0::convert(std::uint64_t cycle) {
  const double degc = measure_degc(cycle);
  if (!faults().frozen) {
    registers_[2] = adt73x0_word(degc);
    update_flags();
    registers_[0] = static_cast<std::uint16_t>(flags_ << 4);  // ready, active low
  }
  switch (registers_[1] & kAdtModeMask) {
    case kAdtContinuous:
      schedule(cycle, 0.240);
      break;
    case kAdtOnePerSecond:
      schedule(cycle, 1.0);
      break;
    default:
      break;  // one-shot done, or shut down
  }
}

void Adt73x0::update_flags() {
  const int hysteresis = static_cast<int>(registers_[5] & 0x0FU) * 128;
  const auto limit = [&](unsigned address) {
    return static_cast<int>(static_cast<std::int16_t>(registers_[address]));
  };
  const auto update = [&](std::uint16_t flag, int beyond) {  // beyond > 0: limit crossed
    if (beyond > 0) flags_ |= flag;
    if (beyond < -hysteresis) flags_ &= static_cast<std::uint16_t>(~flag);
  };
  const int temperature = limit(2);
  update(4, temperature - limit(4));
  update(2, temperature - limit(6));
  update(1, limit(7) - temperature);
}

std::uint16_t Adt73x0::visible(unsigned address) const {
  const std::uint16_t value = registers_[address];
  if (address == 2 && (registers_[1] & kAdt16Bit) == 0)
    return static_cast<std::uint16_t>((value & 0xFFF8U) | flags_);
  if (address == 3 && faults().reserved_bits_wrong) return value ^ 0xFFU;
  return value;
}

void Adt73x0::selected(std::uint64_t, bool) {
  bits_in_ = 0;
  shift_in_ = 0;
  phase_ = Phase::command;
  if (continuous_read_) begin_read(2);
}

void Adt73x0::deselected(std::uint64_t) { bits_left_ = 0; }

void Adt73x0::clock_edge(std::uint64_t cycle, bool rising, bool mosi) {
  if (rising) {
    bit_in(cycle, mosi);
  } else {
    bit_out();
  }
}

void Adt73x0::bit_in(std::uint64_t cycle, bool mosi) {
  ones_ = mosi ? ones_ + 1 : 0;
  if (ones_ == 32) {
    power_cycle(cycle);
    return;
  }
  shift_in_ = static_cast<std::uint16_t>(shift_in_ << 1 | (mosi ? 1 : 0));
  ++bits_in_;
  const unsigned data_bits = is_adt_word_register(address_) ? 16 : 8;
  switch (phase_) {
    case Phase::command:
      if (bits_in_ == 8) command(static_cast<std::uint8_t>(shift_in_));
      break;
    case Phase::write:
      if (bits_in_ == data_bits) {
        write(cycle);
        phase_ = Phase::command;
        bits_in_ = 0;
      }
      break;
    case Phase::read:
      if (continuous_read_ && bits_in_ == 8 && (shift_in_ & 0xFFU) == 0x50U) continuous_read_ = false;
      if (bits_in_ == data_bits) {
        phase_ = Phase::command;
        bits_in_ = 0;
        if (continuous_read_) begin_read(2);
      }
      break;
  }
}

void Adt73x0::bit_out() {
  if (bits_left_ == 0) {
    release();
    return;
  }
  --bits_left_;
  drive((shift_out_ >> bits_left_ & 1U) != 0 ? Drive::high : Drive::low);
}

void Adt73x0::command(std::uint8_t byte) {
  bits_in_ = 0;
  if ((byte & 0x83U) != 0) return;  // not a command: bits 7, 1 and 0 are zero
  const unsigned address = byte >> 3 & 7U;
  if ((byte & 0x40U) != 0) {
    continuous_read_ = byte == 0x54;
    begin_read(address);
  } else {
    address_ = address;
    phase_ = Phase::write;
  }
}

void Adt73x0::begin_read(unsigned address) {
  address_ = address;
  phase_ = Phase::read;
  bits_left_ = is_adt_word_register(address) ? 16 : 8;
  shift_out_ = visible(address);
  if (address == 2) registers_[0] |= kAdtNotReady;
}

void Adt73x0::write(std::uint64_t cycle) {
  if (address_ == 0 || address_ == 2 || address_ == 3) return;  // read only
  const std::uint16_t before = registers_[address_];
  registers_[address_] = is_adt_word_register(address_) ? shift_in_ : shift_in_ & 0xFFU;
  if (address_ != 1) return;
  const std::uint16_t mode = registers_[1] & kAdtModeMask;
  if (mode == (before & kAdtModeMask) && mode != kAdtOneShot) return;
  switch (mode) {
    case kAdtContinuous:
    case kAdtOneShot:
      schedule(cycle, 0.240);
      break;
    case kAdtOnePerSecond:
      schedule(cycle, 0.060);
      break;
    default:
      unschedule();
      break;
  }
}

std::unique_ptr<SpiSensor> make_spi_sensor(std::string_view part, SpiSensorConfig config) {
  if (part == "MAX31855") return std::make_unique<Max31855>(std::move(config));
  if (part == "MAX6675") return std::make_unique<Max6675>(std::move(config));
  if (part == "MAX31865") return std::make_unique<Max31865>(std::move(config), RtdCurve::callendar_van_dusen);
  if (part == "ADT7310" || part == "ADT7320") return std::make_unique<Adt73x0>(std::move(config));
  if (part == "LM70") return std::make_unique<Lm70>(std::move(config));
  throw std::invalid_argument(fmt::format(
      "SPI sensor '{}' is unknown, expected one of: MAX31855, MAX6675, MAX31865, ADT7310, ADT7320, LM70",
      part));
}

}  // namespace meltstage::tb
