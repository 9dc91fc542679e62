// SPDX-License-Identifier: Apache-2.0
// Value change dump (IEEE 1364-2005, clause 18), four-state form: for GTKWave, sigrok and other viewers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "recording/stream.hpp"

namespace meltstage::recording {

/// The unit that VCD times count in.
struct Timescale {
  std::string text;         ///< "10 ns": 1, 10 or 100 of s, ms, us, ns, ps
  double units_per_second;  ///< 1e8 for "10 ns"
};

/// The coarsest timescale in which the clock period is a whole number of units; 1 ps when there is none (48
/// MHz: each time is then rounded from its cycle, so that the error never adds up).
Timescale timescale_for(double clock_hz);

/// How a pin of several bits is written.
enum class BusForm {
  vector,  ///< one variable: what IEEE 1364 means it to be, for GTKWave and simulators
  bits     ///< a variable a bit, name[0] first: for readers that know scalars only (libsigrok 0.5)
};

/// Writes a recording as VCD while it runs, one scope an owner. Cycle n stands at n clock periods; the last
/// time stamp is the end of the final cycle. The file appears under its name at end(); without it nothing is
/// left. Throws std::runtime_error when the disk refuses, std::invalid_argument when a time is past 2^63
/// units.
class VcdWriter final : public Sink {
 public:
  explicit VcdWriter(std::filesystem::path path, BusForm bus_form = BusForm::vector);

  void begin(const Header& header) override;
  void change(const Change& change) override;
  void end(std::uint64_t final_cycle) override;

 private:
  struct PinCodes {
    std::vector<std::string> codes;  // one, or one a bit from bit 0 on
    unsigned width;
    std::uint64_t value;
  };

  void declare(const Pin& pin, const PinCodes& codes);
  void append_time(long double cycle);
  void append_bit(std::uint64_t bit, const std::string& code);
  void append_vector(std::uint64_t value, const std::string& code);
  void append_bits(const PinCodes& pin, std::uint64_t value);
  void flush();

  OutputFile file_;
  BusForm bus_form_;
  ChangeCheck check_;
  std::vector<PinCodes> pins_;
  std::string pending_;
  long double units_per_cycle_ = 0;
  std::uint64_t stamped_cycle_ = 0;
  bool dumping_initial_ = false;
};

/// Writes a complete stream as VCD.
void write_vcd(const Stream& stream, const std::filesystem::path& path, BusForm bus_form = BusForm::vector);

}  // namespace meltstage::recording
