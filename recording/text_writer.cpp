// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <charconv>
#include <iterator>
#include <utility>

#include "recording/text.hpp"
#include "recording/text_format.hpp"

namespace meltstage::recording {
namespace {

void append_number(std::string& text, std::uint64_t number, int base) {
  char digits[20];
  const std::to_chars_result result = std::to_chars(digits, digits + sizeof digits, number, base);
  text.append(digits, result.ptr);
}

}  // namespace

std::string escape(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\\\";
    } else if (needs_escape(c)) {
      fmt::format_to(std::back_inserter(escaped), "\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      escaped += c;
    }
  }
  return escaped;
}

TextWriter::TextWriter(std::filesystem::path path) : file_(std::move(path)) {}

void TextWriter::begin(const Header& header) {
  check_.begin(header);
  auto out = std::back_inserter(pending_);
  fmt::format_to(out, "{} {}\n", kTextMagic, kTextVersion);
  fmt::format_to(out, "origin {}\n", escape(header.origin));
  fmt::format_to(out, "clock_hz {}\n", header.clock_hz);
  for (const auto& [key, value] : header.meta) fmt::format_to(out, "meta {}={}\n", key, escape(value));
  for (const Pin& pin : header.pins) {
    fmt::format_to(out, "pin {} {} {} {}\n", pin.name, to_string(pin.direction), pin.width, pin.owner);
    const bool is_bit = pin.width == 1;
    pins_.push_back({fmt::format(" {}={}", pin.name, is_bit ? "" : "0x"), is_bit});
  }
}

void TextWriter::change(const Change& change) {
  check_.require(change);
  if (!line_open_ || change.cycle != line_cycle_) {
    if (line_open_) pending_ += '\n';
    if (pending_.size() >= OutputFile::kPiece_bytes) flush();
    append_number(pending_, change.cycle, 10);
    line_cycle_ = change.cycle;
    line_open_ = true;
  }
  const PinText& pin = pins_[change.pin];
  pending_ += pin.assignment;
  if (pin.is_bit) {
    pending_ += static_cast<char>('0' + change.value);
  } else {
    append_number(pending_, change.value, 16);
  }
}

void TextWriter::end(std::uint64_t final_cycle) {
  check_.require_end(final_cycle);
  fmt::format_to(std::back_inserter(pending_), "\nend {}\n", final_cycle);
  flush();
  file_.write(fmt::format("sha256 {}\n", hash_.finish()));
  file_.publish();
  check_.close();
}

void TextWriter::flush() {
  hash_.update(pending_);
  file_.write(pending_);
  pending_.clear();
}

void write_text(const Stream& stream, const std::filesystem::path& path) {
  TextWriter writer(path);
  copy(stream, writer);
}

}  // namespace meltstage::recording
