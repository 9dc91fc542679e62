// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

#include "base/rng.hpp"
#include "tb/devices/no_event.hpp"

namespace meltstage::tb {

/// Temperature of the sensing element in degrees Celsius at a chip cycle.
using TemperatureSource = std::function<double(std::uint64_t cycle)>;

/// Faults of the probe's wiring. Sensors with the element on their own die (ADT7310/20, LM70) have no such
/// wires.
enum class ProbeFault : std::uint8_t {
  none,
  open,  ///< thermocouple or RTD element broken
  short_to_ground,
  short_to_supply,
  force_lead_open,  ///< MAX31865 only: FORCE- lead; the ratio still looks valid, only the fault register
                    ///< tells
};

/// Faults of the data line.
enum class MisoFault : std::uint8_t { none, stuck_low, stuck_high, absent };

/// Faults as properties of a sensor; all combine.
struct SpiFaults {
  ProbeFault probe = ProbeFault::none;
  MisoFault miso = MisoFault::none;
  bool frozen = false;               ///< conversions no longer reach the data register
  bool reserved_bits_wrong = false;  ///< reserved, constant or ID bits read inverted
};

struct SpiSensorConfig {
  double clock_hz = 0.0;                ///< chip clock, > 0
  TemperatureSource source;             ///< required
  double noise_sigma_degc = 0.0;        ///< Gaussian, added before quantisation, one draw a conversion
  Rng noise = stream(0, "spi_sensor");  ///< sub-stream for the noise
  double conversion_s = 0.0;            ///< 0 = the data sheet's typical times
  bool miso_pull = true;                ///< level of the undriven line
  double cold_junction_degc = 25.0;     ///< thermocouple converters
};

/// A SPI temperature sensor as seen at its pins. `step` takes the pin levels of a chip cycle and returns MISO
/// after them. Between calls the pins are constant; a bench that skips cycles must not skip past
/// `next_event()`, where the source is sampled.
class SpiSensor {
 public:
  virtual ~SpiSensor() = default;
  SpiSensor(const SpiSensor&) = delete;
  SpiSensor& operator=(const SpiSensor&) = delete;

  bool step(std::uint64_t cycle, bool cs_n, bool sclk, bool mosi) {
    const std::uint8_t pins = pack(cs_n, sclk, mosi);
    if (pins == pins_ && cycle < next_event_) return miso_;
    advance(cycle, cs_n, sclk, mosi);
    pins_ = pins;
    return miso_;
  }

  bool miso() const { return miso_; }
  /// Cycle of the next end of conversion; kNoEvent when none is running.
  std::uint64_t next_event() const { return next_event_; }

  const SpiFaults& faults() const { return faults_; }
  /// Data line faults act at once, the others from the next conversion or frame on.
  void set_faults(const SpiFaults& faults);
  /// Inverts bits of the next frame only: bit i of `mask` = i-th bit driven on MISO after chip select.
  void corrupt_next_frame(std::uint64_t mask) { corrupt_mask_ = mask; }
  /// Registers back to their power-up values (brown-out of the sensor's supply).
  void power_cycle(std::uint64_t cycle);
  /// Frames (chip select low to high) seen so far.
  std::uint64_t frames() const { return frames_; }

 protected:
  enum class Drive : std::uint8_t { low, high, high_z };

  /// Throws std::invalid_argument on a bad clock, source, noise or conversion time.
  explicit SpiSensor(SpiSensorConfig config);

  virtual void power_on(std::uint64_t cycle) = 0;
  virtual void convert(std::uint64_t cycle) = 0;
  virtual void selected(std::uint64_t cycle, bool sclk) = 0;
  virtual void deselected(std::uint64_t cycle) = 0;
  virtual void clock_edge(std::uint64_t cycle, bool rising, bool mosi) = 0;

  /// Puts the next bit of the frame on MISO.
  void drive(Drive level);
  /// Leaves the line without counting a bit.
  void release();
  /// Schedules convert() `data_sheet_s` (or the configured override) after `cycle`.
  void schedule(std::uint64_t cycle, double data_sheet_s);
  /// The same for times that the override leaves alone.
  void schedule_exactly(std::uint64_t cycle, double seconds);
  void unschedule() { next_event_ = kNoEvent; }
  /// Noisy temperature of the element.
  double measure_degc(std::uint64_t cycle);
  const SpiSensorConfig& config() const { return config_; }

 private:
  static constexpr std::uint8_t pack(bool cs_n, bool sclk, bool mosi) {
    return static_cast<std::uint8_t>((cs_n ? 4 : 0) | (sclk ? 2 : 0) | (mosi ? 1 : 0));
  }
  void advance(std::uint64_t cycle, bool cs_n, bool sclk, bool mosi);
  void refresh_miso();

  SpiSensorConfig config_;
  SpiFaults faults_;
  std::uint64_t next_event_ = kNoEvent;
  std::uint64_t corrupt_mask_ = 0;
  std::uint64_t frames_ = 0;
  unsigned bit_index_ = 0;
  Drive output_ = Drive::high_z;
  std::uint8_t pins_ = pack(true, false, false);
  bool miso_ = true;
};

/// Sensor that sends one word, most significant bit first, the first bit at chip select and each next one at
/// a falling clock edge (SPI mode 0 to the master).
class WordSensor : public SpiSensor {
 protected:
  struct Word {
    std::uint32_t bits;
    unsigned length;
    std::uint32_t undriven_mask;  ///< bits left high-impedance
  };
  using SpiSensor::SpiSensor;
  virtual Word word() const = 0;
  void selected(std::uint64_t cycle, bool sclk) override;
  void clock_edge(std::uint64_t cycle, bool rising, bool mosi) override;
  bool word_done() const { return sent_ > word_.length; }

 private:
  void drive_next();
  Word word_{};
  unsigned sent_ = 0;
};

/// Data word of a MAX31855: [31:18] thermocouple s14 0.25 degC, 16 any fault, [15:4] cold junction s12
/// 0.0625 degC, 2 short to supply, 1 short to ground, 0 open; 17 and 3 reserved 0.
std::uint32_t max31855_word(double thermocouple_degc, double cold_junction_degc, ProbeFault fault);

/// Cold-junction compensated thermocouple converter, 32 bits, read only. Conversions run while chip select is
/// high (70 ms typical) and restart at its rising edge.
class Max31855 final : public WordSensor {
 public:
  explicit Max31855(SpiSensorConfig config);

 private:
  void power_on(std::uint64_t cycle) override;
  void convert(std::uint64_t cycle) override;
  void selected(std::uint64_t cycle, bool sclk) override;
  void deselected(std::uint64_t cycle) override;
  Word word() const override;
  std::uint32_t data_ = 0;
};

/// Data word of a MAX6675: [14:3] 0.25 degC unsigned, 2 open thermocouple, 1 device ID 0, 0 undriven.
std::uint16_t max6675_word(double thermocouple_degc, bool open);

/// K-type thermocouple converter, 16 bits, 0..1023.75 degC; conversion 170 ms, restarted by chip select.
class Max6675 final : public WordSensor {
 public:
  explicit Max6675(SpiSensorConfig config);

 private:
  void power_on(std::uint64_t cycle) override;
  void convert(std::uint64_t cycle) override;
  void selected(std::uint64_t cycle, bool sclk) override;
  void deselected(std::uint64_t cycle) override;
  Word word() const override;
  std::uint16_t data_ = 0;
};

/// Data word of an LM70: [15:5] 0.25 degC two's complement, [4:2] ones, [1:0] undriven.
std::uint16_t lm70_word(double temperature_degc);

/// Temperature sensor with 11-bit word; converts every 140 ms. The second 16 bits of a frame are written to
/// the configuration: xxFF shuts down (the word is then the ID 0x8100), xx00 resumes.
class Lm70 final : public WordSensor {
 public:
  explicit Lm70(SpiSensorConfig config);

 private:
  void power_on(std::uint64_t cycle) override;
  void convert(std::uint64_t cycle) override;
  void selected(std::uint64_t cycle, bool sclk) override;
  void deselected(std::uint64_t cycle) override;
  void clock_edge(std::uint64_t cycle, bool rising, bool mosi) override;
  Word word() const override;
  std::uint16_t data_ = 0;
  bool shut_down_ = false;
  unsigned written_bits_ = 0;
  std::uint16_t written_ = 0;
};

/// How a MAX31865 bench sensor turns temperature into the 15-bit ratio.
enum class RtdCurve : std::uint8_t {
  callendar_van_dusen,  ///< Pt100 to IEC 60751 against 400 ohm; the ratio is truncated
  linear,               ///< code = 32 (T + 256): the data sheet's approximation made exact
};

/// Resistance in ohm of a Pt100, -200..850 degC (IEC 60751: a 3.9083e-3, b -5.775e-7, c -4.183e-12).
double pt100_ohm(double temperature_degc);
/// 15-bit ratio code 0..32767 of that temperature.
std::uint16_t max31865_code(double temperature_degc, RtdCurve curve);

/// RTD converter with a register file (read address r, write 0x80 + r, auto-increment; SPI modes 1 and 3):
/// 0 configuration, 1-2 ratio and fault flag, 3-6 thresholds, 7 fault status. Conversions every 20/16.7 ms
/// (50/60 Hz filter) in automatic mode, 62.5/52 ms after a one-shot command, only while the bias is on.
/// Shorts stop conversions; lead faults are found by the fault-detection cycle, as in the part.
class Max31865 final : public SpiSensor {
 public:
  Max31865(SpiSensorConfig config, RtdCurve curve);
  std::uint8_t register_value(unsigned address) const { return registers_[address & 7U]; }

 private:
  void power_on(std::uint64_t cycle) override;
  void convert(std::uint64_t cycle) override;
  void selected(std::uint64_t cycle, bool sclk) override;
  void deselected(std::uint64_t cycle) override;
  void clock_edge(std::uint64_t cycle, bool rising, bool mosi) override;
  void write(std::uint64_t cycle, unsigned address, std::uint8_t value);
  void write_configuration(std::uint64_t cycle, std::uint8_t value);
  double conversion_s() const;
  void detect_faults();
  void raise_fault(std::uint8_t bits);
  std::uint8_t read(unsigned address) const;

  RtdCurve curve_;
  std::array<std::uint8_t, 8> registers_{};
  std::array<std::uint8_t, 8> frame_registers_{};  // a frame reads one consistent copy
  bool idle_clock_ = false;
  bool detecting_ = false;
  unsigned bits_ = 0;
  std::uint8_t address_ = 0;
  std::uint8_t shift_in_ = 0;
};

/// Temperature register of an ADT7310/ADT7320 in 16-bit mode: two's complement, 1/128 degC.
std::uint16_t adt73x0_word(double temperature_degc);

/// ADT7310/ADT7320: command byte 0 R/W A2 A1 A0 CR 0 0 (write r << 3, read 0x40 | r << 3, continuous read
/// 0x54). Registers: 0 status, 1 configuration, 2 temperature, 3 ID 0xC3, 4 Tcrit, 5 Thyst, 6 Thigh, 7 Tlow.
/// 13-bit mode (default) carries the limit flags in bits [2:0]. First conversion after 6 ms, then every 240
/// ms; one-shot, 1 SPS and shutdown modes. 32 ones in a row reset it.
class Adt73x0 final : public SpiSensor {
 public:
  explicit Adt73x0(SpiSensorConfig config);
  std::uint16_t register_value(unsigned address) const { return registers_[address & 7U]; }

 private:
  enum class Phase : std::uint8_t { command, write, read };
  void power_on(std::uint64_t cycle) override;
  void convert(std::uint64_t cycle) override;
  void selected(std::uint64_t cycle, bool sclk) override;
  void deselected(std::uint64_t cycle) override;
  void clock_edge(std::uint64_t cycle, bool rising, bool mosi) override;
  void bit_in(std::uint64_t cycle, bool mosi);
  void bit_out();
  void command(std::uint8_t byte);
  void begin_read(unsigned address);
  void write(std::uint64_t cycle);
  void update_flags();
  std::uint16_t visible(unsigned address) const;

  std::array<std::uint16_t, 8> registers_{};
  std::uint16_t flags_ = 0;
  bool continuous_read_ = false;
  Phase phase_ = Phase::command;
  unsigned address_ = 0;
  unsigned bits_in_ = 0;
  std::uint16_t shift_in_ = 0;
  unsigned ones_ = 0;
  unsigned bits_left_ = 0;
  std::uint16_t shift_out_ = 0;
};

/// The sensor of that part name (max31855, max6675, max31865, adt7310, adt7320, lm70); throws
/// std::invalid_argument naming the known ones. The MAX31865 gets the true Pt100 curve.
std::unique_ptr<SpiSensor> make_spi_sensor(std::string_view part, SpiSensorConfig config);

}  // namespace meltstage::tb
