// SPDX-License-Identifier: Apache-2.0
#include "recording/vcd.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "recording/text_format.hpp"

namespace meltstage::recording {
namespace {

constexpr std::array<const char*, 5> kUnitNames = {"s", "ms", "us", "ns", "ps"};

/// Short identifier of a variable: a number in the printable characters '!' to '~'.
std::string identifier_code(std::size_t index) {
  constexpr std::size_t kBase = '~' - '!' + 1;
  std::string code;
  do {
    code += static_cast<char>('!' + index % kBase);
    index /= kBase;
  } while (index != 0);
  return code;
}

/// A comment ends at the word "$end", so a dollar in it is written as an escape.
std::string comment_text(std::string_view text) {
  std::string safe;
  for (const char c : escape(text)) {
    if (c == '$') {
      safe += "\\x24";
    } else {
      safe += c;
    }
  }
  return safe;
}

}  // namespace

Timescale timescale_for(double clock_hz) {
  constexpr int kFinest = 12;  // 1e-12 s
  for (int exponent = 0; exponent <= kFinest; ++exponent) {
    const double units_per_second = std::pow(10.0, exponent);
    const double units = units_per_second / clock_hz;
    // The quotient of two doubles is a whole number exactly when the remainder is nothing.
    const bool whole = units >= 1.0 && std::fmod(units_per_second, clock_hz) == 0.0;
    if (!whole && exponent < kFinest) continue;
    const int multiple = exponent % 3 == 0 ? 1 : exponent % 3 == 1 ? 100 : 10;
    return {fmt::format("{} {}", multiple, kUnitNames[static_cast<std::size_t>((exponent + 2) / 3)]),
            units_per_second};
  }
  throw std::logic_error("timescale: unreachable");
}

VcdWriter::VcdWriter(std::filesystem::path path, BusForm bus_form)
    : file_(std::move(path)), bus_form_(bus_form) {}

void VcdWriter::begin(const Header& header) {
  check_.begin(header);
  const Timescale timescale = timescale_for(header.clock_hz);
  units_per_cycle_ = static_cast<long double>(timescale.units_per_second) / header.clock_hz;

  auto out = std::back_inserter(pending_);
  fmt::format_to(out, "$version Meltstage vectors $end\n$comment {} $end\n$timescale {} $end\n",
                 comment_text(header.origin), timescale.text);
  std::vector<std::string> owners;
  std::size_t variables = 0;
  for (const Pin& pin : header.pins) {
    PinCodes codes{{}, pin.width, 0};
    const std::size_t own = bus_form_ == BusForm::bits ? pin.width : 1;
    while (codes.codes.size() < own) codes.codes.push_back(identifier_code(variables++));
    pins_.push_back(std::move(codes));
    if (std::find(owners.begin(), owners.end(), pin.owner) == owners.end()) owners.push_back(pin.owner);
  }
  for (const std::string& owner : owners) {
    fmt::format_to(out, "$scope module {} $end\n", owner);
    for (std::size_t i = 0; i < header.pins.size(); ++i) {
      if (header.pins[i].owner == owner) declare(header.pins[i], pins_[i]);
    }
    pending_ += "$upscope $end\n";
  }
  pending_ += "$enddefinitions $end\n";
}

void VcdWriter::declare(const Pin& pin, const PinCodes& codes) {
  auto out = std::back_inserter(pending_);
  if (pin.width == 1) {
    fmt::format_to(out, "$var wire 1 {} {} $end\n", codes.codes[0], pin.name);
  } else if (bus_form_ == BusForm::vector) {
    fmt::format_to(out, "$var wire {} {} {} [{}:0] $end\n", pin.width, codes.codes[0], pin.name,
                   pin.width - 1);
  } else {
    for (std::size_t bit = 0; bit < codes.codes.size(); ++bit) {
      fmt::format_to(out, "$var wire 1 {} {}[{}] $end\n", codes.codes[bit], pin.name, bit);
    }
  }
}

void VcdWriter::change(const Change& change) {
  const bool first = check_.initial_pins() == 0;
  check_.require(change);
  if (first) {
    append_time(static_cast<long double>(change.cycle));
    pending_ += "$dumpvars\n";
    dumping_initial_ = true;
    stamped_cycle_ = change.cycle;
  } else if (change.cycle != stamped_cycle_) {
    if (pending_.size() >= OutputFile::kPiece_bytes) flush();
    append_time(static_cast<long double>(change.cycle));
    stamped_cycle_ = change.cycle;
  }
  PinCodes& pin = pins_[change.pin];
  if (pin.width == 1) {
    append_bit(change.value, pin.codes[0]);
  } else if (bus_form_ == BusForm::vector) {
    append_vector(change.value, pin.codes[0]);
  } else {
    append_bits(pin, change.value);
  }
  pin.value = change.value;
  if (dumping_initial_ && check_.first_cycle_complete()) {
    pending_ += "$end\n";
    dumping_initial_ = false;
  }
}

void VcdWriter::end(std::uint64_t final_cycle) {
  check_.require_end(final_cycle);
  append_time(static_cast<long double>(final_cycle) + 1);
  flush();
  file_.publish();
  check_.close();
}

void VcdWriter::append_time(long double cycle) {
  const long double time = std::round(cycle * units_per_cycle_);
  constexpr long double kLimit = 9223372036854775807.0L;
  if (time > kLimit) {
    throw std::invalid_argument(fmt::format(
        "VCD time of cycle {:.0f}: found more than 2^63 - 1 units, expected less; cut the recording", cycle));
  }
  fmt::format_to(std::back_inserter(pending_), "#{}\n", static_cast<std::uint64_t>(time));
}

void VcdWriter::append_bit(std::uint64_t bit, const std::string& code) {
  pending_ += static_cast<char>('0' + bit);
  pending_ += code;
  pending_ += '\n';
}

/// Leading zeros are left out, as IEEE 1364 allows: readers extend with 0.
void VcdWriter::append_vector(std::uint64_t value, const std::string& code) {
  char digits[64];
  const std::to_chars_result result = std::to_chars(digits, digits + sizeof digits, value, 2);
  pending_ += 'b';
  pending_.append(digits, result.ptr);
  pending_ += ' ';
  pending_ += code;
  pending_ += '\n';
}

void VcdWriter::append_bits(const PinCodes& pin, std::uint64_t value) {
  const std::uint64_t to_write = dumping_initial_ ? max_value(pin.width) : value ^ pin.value;
  for (std::size_t bit = 0; bit < pin.codes.size(); ++bit) {
    if ((to_write >> bit & 1) != 0) append_bit(value >> bit & 1, pin.codes[bit]);
  }
}

void VcdWriter::flush() {
  file_.write(pending_);
  pending_.clear();
}

void write_vcd(const Stream& stream, const std::filesystem::path& path, BusForm bus_form) {
  VcdWriter writer(path, bus_form);
  copy(stream, writer);
}

}  // namespace meltstage::recording
