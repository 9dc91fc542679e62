// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <unordered_map>

#include "base/place.hpp"
#include "recording/line_reader.hpp"
#include "recording/text.hpp"
#include "recording/text_format.hpp"

namespace meltstage::recording {
namespace {

constexpr std::size_t kSha256Digits = 64;
constexpr std::string_view kRestore = "restore the file or record it again";

bool is_decimal_digit(char c) { return c >= '0' && c <= '9'; }
bool is_hex_digit(char c) { return is_decimal_digit(c) || (c >= 'a' && c <= 'f'); }

/// As it stands in a message: quoted, control bytes made visible, long ones cut.
std::string quote(std::string_view text) {
  constexpr std::size_t kShownBytes = 40;
  if (text.empty()) return "nothing";
  const bool cut = text.size() > kShownBytes;
  return fmt::format("\"{}{}\"", escape(text.substr(0, kShownBytes)), cut ? "..." : "");
}

class TextReader {
 public:
  TextReader(const std::filesystem::path& path, Sink& sink) : path_(path), lines_(path), sink_(sink) {}

  void run() {
    read_magic();
    read_header();
    while (!starts_with_word("end")) {
      read_cycle();
      take_line();
    }
    const std::uint64_t final_cycle = read_end();
    take_line();
    read_hash();
    require_file_end();
    sink_.end(final_cycle);
  }

 private:
  // --- errors and lines ---

  [[noreturn]] void fail(std::size_t column, std::string_view defect, std::string_view found,
                         std::string_view expected, std::string_view advice = kRestore) const {
    throw FormatError(fmt::format("{}:{}:{}: {}: found {}, expected {}; {}", path_.string(), lines_.number(),
                                  column, defect, found, expected, advice),
                      lines_.number(), column);
  }
  /// Fails at a place of the current line, 0 being its first byte.
  [[noreturn]] void fail_at(std::size_t at, std::string_view defect, std::string_view found,
                            std::string_view expected) const {
    fail(at + 1, defect, found, expected);
  }
  [[noreturn]] void fail_at_token(std::size_t at, std::string_view defect, std::string_view expected) const {
    const std::string_view token = token_at(at);
    fail_at(at, defect,
            token.empty() ? (at < text_.size() ? "a space" : "the end of the line") : quote(token), expected);
  }

  void take_line() { take(lines_.next()); }

  void take(const Line& line) {
    if (line.end == LineEnd::too_long) {
      fail(kMaxLineBytes + 1, "line too long", fmt::format("more than {} bytes", kMaxLineBytes),
           "a newline before");
    }
    if (line.end == LineEnd::file_end) {
      fail(line.text.size() + 1, "truncated", "the end of the file",
           "a last line \"sha256 ...\" with its newline");
    }
    text_ = line.text;
    at_ = 0;
    if (text_.ends_with('\r')) {
      fail(text_.size(), "foreign line end", "\"\\x0d\"", "a newline alone",
           "copy the file without line-end conversion");
    }
  }

  std::string_view token_at(std::size_t at) const {
    return text_.substr(at, text_.find_first_of(" =", at) - at);
  }
  std::string_view word() const { return text_.substr(0, text_.find(' ')); }
  bool starts_with_word(std::string_view wanted) const { return word() == wanted; }

  void expect_char(char wanted) {
    if (at_ >= text_.size() || text_[at_] != wanted) {
      const std::string found = at_ < text_.size() ? quote(text_.substr(at_, 1)) : "the end of the line";
      fail_at(at_, "bad line", found, wanted == ' ' ? "one space" : fmt::format("\"{}\"", wanted));
    }
    ++at_;
  }
  void expect_line_end() const {
    if (at_ != text_.size()) fail_at(at_, "bad line", quote(text_.substr(at_)), "the end of the line");
  }
  /// Past "name " of a header line that must stand here.
  void expect_field(std::string_view name) {
    if (!starts_with_word(name))
      fail_at(0, "missing header field", quote(word()), fmt::format("\"{}\"", name));
    at_ = name.size();
    expect_char(' ');
  }

  // --- numbers and strings ---

  /// A whole number without sign and leading zeros, ended by anything that is no digit.
  std::uint64_t take_decimal(std::string_view what) {
    const std::size_t begin = at_;
    while (at_ < text_.size() && is_decimal_digit(text_[at_])) ++at_;
    const std::string_view digits = text_.substr(begin, at_ - begin);
    if (digits.empty() || (digits.size() > 1 && digits.front() == '0')) {
      fail_at_token(begin, fmt::format("bad {}", what), "a decimal number without leading zeros");
    }
    std::uint64_t number = 0;
    if (std::from_chars(digits.data(), digits.data() + digits.size(), number).ec != std::errc{}) {
      fail_at_token(begin, fmt::format("bad {}", what),
                    fmt::format("at most {}", std::numeric_limits<std::uint64_t>::max()));
    }
    return number;
  }

  std::uint64_t take_cycle(std::string_view what) {
    const std::size_t begin = at_;
    const std::uint64_t cycle = take_decimal(what);
    if (cycle > kMaxCycle)
      fail_at_token(begin, fmt::format("bad {}", what), fmt::format("at most {}", kMaxCycle));
    return cycle;
  }

  std::string_view take_identifier(std::string_view what) {
    const std::string_view token = token_at(at_);
    if (!is_identifier(token)) {
      fail_at_token(
          at_, fmt::format("bad {}", what),
          fmt::format("a letter or '_', then letters, digits, '_', at most {} in all", kMaxNameBytes));
    }
    at_ += token.size();
    return token;
  }

  /// The rest of the line, unescaped.
  std::string take_string(std::string_view what) {
    const std::size_t begin = at_;
    std::string value;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\\') {
        value += take_escape();
      } else if (needs_escape(c)) {
        fail_at(at_, fmt::format("bad {}", what), "a bare control byte " + quote(text_.substr(at_, 1)),
                "it escaped as \\xHH");
      } else {
        value += c;
        ++at_;
      }
    }
    if (value.size() > kMaxStringBytes) {
      fail_at(begin, fmt::format("bad {}", what), fmt::format("{} bytes", value.size()),
              fmt::format("at most {} bytes", kMaxStringBytes));
    }
    return value;
  }

  char take_escape() {
    const std::string_view rest = text_.substr(at_);
    if (rest.starts_with("\\\\")) {
      at_ += 2;
      return '\\';
    }
    if (rest.size() >= 4 && rest[1] == 'x' && is_hex_digit(rest[2]) && is_hex_digit(rest[3])) {
      unsigned byte = 0;
      std::from_chars(rest.data() + 2, rest.data() + 4, byte, 16);
      const char value = static_cast<char>(byte);
      if (value != '\\' && needs_escape(value)) {
        at_ += 4;
        return value;
      }
    }
    fail_at(at_, "bad escape", fmt::format("\"{}\"", shown(rest.substr(0, 4))),
            "\\\\ or \\xHH of a control byte in lower-case hexadecimal");
  }

  // --- header ---

  void read_magic() {
    const Line line = lines_.next();
    const std::string expected = fmt::format("\"{} {}\"", kTextMagic, kTextVersion);
    constexpr std::string_view kAdvice = "check that this is a vector file (.mvec)";
    if (line.text.empty() && line.end == LineEnd::file_end)
      fail(1, "empty file", "the end of the file", expected);
    const auto binary = std::find_if(line.text.begin(), line.text.end(), [](char c) {
      return static_cast<unsigned char>(c) >= 0x7f ||
             (static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\r');
    });
    if (binary != line.text.end()) {
      fail(static_cast<std::size_t>(binary - line.text.begin()) + 1, "not a text file",
           fmt::format("byte 0x{:02x}", static_cast<unsigned char>(*binary)), expected, kAdvice);
    }
    const bool cut_short = line.end == LineEnd::file_end && kTextMagic.starts_with(line.text);
    if (!cut_short && line.text.substr(0, line.text.find(' ')) != kTextMagic) {
      fail(1, "not a vector file", quote(line.text), expected, kAdvice);
    }
    take(line);
    at_ = kTextMagic.size();
    expect_char(' ');
    if (take_decimal("format version") != kTextVersion) {
      fail(kTextMagic.size() + 2, "wrong format version", quote(text_.substr(kTextMagic.size() + 1)),
           fmt::format("{}", kTextVersion), "read it with the release that wrote it");
    }
    expect_line_end();
  }

  /// Leaves the first line of the body as the current one.
  void read_header() {
    take_line();
    read_origin();
    take_line();
    read_clock();
    for (take_line(); starts_with_word("meta"); take_line()) read_meta();
    for (first_pin_line_ = lines_.number(); starts_with_word("pin"); take_line()) read_pin();
    if (header_.pins.empty()) fail_at(0, "missing header field", quote(word()), "\"meta\" or \"pin\"");
    for (std::uint32_t pin = 0; pin < header_.pins.size(); ++pin)
      pin_by_name_.emplace(header_.pins[pin].name, pin);
    check_.begin(header_);
    sink_.begin(header_);
  }

  void read_origin() {
    expect_field("origin");
    if (at_ == text_.size()) fail_at(at_, "bad origin", "nothing", "who recorded: tool, test, seed");
    header_.origin = take_string("origin");
  }

  void read_clock() {
    expect_field("clock_hz");
    const std::string_view token = text_.substr(at_);
    double clock_hz = 0.0;
    const std::from_chars_result result =
        std::from_chars(token.data(), token.data() + token.size(), clock_hz);
    if (result.ec != std::errc{} || result.ptr != token.data() + token.size() || !is_valid_clock(clock_hz)) {
      fail_at(at_, "bad clock_hz", quote(token),
              fmt::format("a number from {} to {}", kMinClock_hz, kMaxClock_hz));
    }
    if (const std::string canonical = fmt::format("{}", clock_hz); canonical != token) {
      fail_at(at_, "bad clock_hz", quote(token), fmt::format("its shortest form \"{}\"", canonical));
    }
    header_.clock_hz = clock_hz;
  }

  void read_meta() {
    expect_field("meta");
    const std::size_t key_at = at_;
    const std::string key(token_at(at_));
    if (!is_meta_key(key)) fail_at_token(at_, "bad meta key", "letters, digits, '_', '.', '-'");
    if (header_.meta.contains(key)) fail_at_token(key_at, "duplicate meta key", "each key once");
    if (!header_.meta.empty() && key < header_.meta.rbegin()->first) {
      fail_at_token(key_at, "meta key out of order",
                    fmt::format("it before \"{}\"", header_.meta.rbegin()->first));
    }
    at_ += key.size();
    expect_char('=');
    header_.meta[key] = take_string("meta value");
  }

  void read_pin() {
    expect_field("pin");
    if (header_.pins.size() == kMaxPins)
      fail_at(0, "too many pins", "one more", fmt::format("at most {}", kMaxPins));
    Pin pin;
    const std::size_t name_at = at_;
    pin.name = take_identifier("pin name");
    if (!names_.emplace(pin.name, lines_.number()).second) {
      fail_at_token(name_at, "duplicate pin",
                    fmt::format("a name other than that of line {}", names_.at(pin.name)));
    }
    expect_char(' ');
    pin.direction = take_direction();
    expect_char(' ');
    const std::size_t width_at = at_;
    const std::uint64_t width = take_decimal("pin width");
    if (width < 1 || width > 64) fail_at_token(width_at, "bad pin width", "1 to 64 bits");
    pin.width = static_cast<unsigned>(width);
    expect_char(' ');
    pin.owner = take_identifier("pin owner");
    expect_line_end();
    header_.pins.push_back(std::move(pin));
  }

  Direction take_direction() {
    const std::string_view token = token_at(at_);
    for (const Direction direction : {Direction::in, Direction::out, Direction::inout}) {
      if (token != to_string(direction)) continue;
      at_ += token.size();
      return direction;
    }
    fail_at_token(at_, "bad pin direction", "\"in\", \"out\" or \"inout\"");
  }

  // --- body ---

  void read_cycle() {
    if (text_.empty() || !is_decimal_digit(text_.front())) {
      fail_at_token(0, "unknown line", "a cycle number or \"end\"");
    }
    const bool first = check_.initial_pins() == 0;
    const std::uint64_t cycle = take_cycle("cycle");
    if (!first && cycle <= check_.cycle()) {
      fail_at_token(0, cycle == check_.cycle() ? "cycle twice" : "cycle going backwards",
                    fmt::format("more than {}, the cycle of the line before", check_.cycle()));
    }
    do {
      expect_char(' ');
      read_change(cycle);
    } while (at_ < text_.size());
    if (!check_.first_cycle_complete()) {
      fail_at(at_, "first cycle incomplete", "the end of the line",
              fmt::format("the value of pin \"{}\"", header_.pins[check_.initial_pins()].name));
    }
  }

  void read_change(std::uint64_t cycle) {
    const std::size_t name_at = at_;
    const std::uint32_t pin = take_pin();
    expect_char('=');
    const std::size_t value_at = at_;
    const Change change{cycle, pin,
                        header_.pins[pin].width == 1 ? take_bit() : take_hex(header_.pins[pin].width)};
    if (const ChangeFault fault = check_.accept(change); fault != ChangeFault::none) {
      fail_change(fault, name_at, value_at);
    }
    sink_.change(change);
  }

  std::uint32_t take_pin() {
    const std::string_view name = token_at(at_);
    const auto found = pin_by_name_.find(name);
    if (found == pin_by_name_.end()) {
      fail_at_token(
          at_, "unknown pin",
          fmt::format("a pin of lines {} to {}", first_pin_line_, first_pin_line_ + header_.pins.size() - 1));
    }
    at_ += name.size();
    return found->second;
  }

  bool at_token_end(std::size_t at) const { return at >= text_.size() || text_[at] == ' '; }

  std::uint64_t take_bit() {
    if (at_ < text_.size() && (text_[at_] == '0' || text_[at_] == '1') && at_token_end(at_ + 1)) {
      return static_cast<std::uint64_t>(text_[at_++] - '0');
    }
    const std::string_view token = token_at(at_);
    const bool number = !token.empty() && std::all_of(token.begin(), token.end(), is_decimal_digit);
    fail_at_token(at_, number ? "value too wide" : "bad value", "0 or 1 for a pin of 1 bit");
  }

  std::uint64_t take_hex(unsigned width) {
    const std::size_t begin = at_;
    const std::string_view token = token_at(at_);
    const std::string_view digits = token.substr(std::min<std::size_t>(2, token.size()));
    if (!token.starts_with("0x") || digits.empty() ||
        !std::all_of(digits.begin(), digits.end(), is_hex_digit) ||
        (digits.size() > 1 && digits.front() == '0')) {
      fail_at_token(begin, "bad value", "0x and lower-case hexadecimal digits without leading zeros");
    }
    std::uint64_t value = 0;
    const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (result.ec != std::errc{} || value > max_value(width)) {
      fail_at_token(begin, "value too wide",
                    fmt::format("at most {:#x} for a pin of {} bits", max_value(width), width));
    }
    at_ += token.size();
    return value;
  }

  [[noreturn]] void fail_change(ChangeFault fault, std::size_t name_at, std::size_t value_at) const {
    switch (fault) {
      case ChangeFault::pin_repeated:
        fail_at_token(name_at, "pin twice in a cycle", "each pin once a line");
      case ChangeFault::pin_order:
        fail_at_token(name_at, "pin out of order", "the pins in header order");
      case ChangeFault::first_cycle_incomplete:
        fail_at_token(name_at, "first cycle incomplete",
                      fmt::format("pin \"{}\"", header_.pins[check_.initial_pins()].name));
      default:
        fail_at_token(value_at, "value unchanged", "another value than the pin already has");
    }
  }

  // --- end ---

  std::uint64_t read_end() {
    if (check_.initial_pins() == 0)
      fail_at(0, "missing first cycle", "\"end\"", "a line that states every pin");
    expect_field("end");
    const std::uint64_t final_cycle = take_cycle("final cycle");
    if (final_cycle < check_.cycle()) {
      fail_at_token(4, "bad final cycle",
                    fmt::format("{} or later, the cycle of the line before", check_.cycle()));
    }
    expect_line_end();
    return final_cycle;
  }

  void read_hash() {
    if (!starts_with_word("sha256")) fail_at_token(0, "missing hash", "\"sha256\"");
    at_ = word().size();
    expect_char(' ');
    const std::string_view written = text_.substr(at_);
    if (written.size() != kSha256Digits || !std::all_of(written.begin(), written.end(), is_hex_digit)) {
      fail_at(at_, "bad hash", quote(written),
              fmt::format("{} lower-case hexadecimal digits", kSha256Digits));
    }
    const std::string computed = lines_.digest_before_line();
    if (written != computed) {
      fail(at_ + 1, "hash mismatch", written, fmt::format("{} from the lines above", computed),
           "the file was changed after it was written: restore it or record it again");
    }
  }

  void require_file_end() {
    const Line line = lines_.next();
    if (line.end != LineEnd::file_end || !line.text.empty()) {
      fail(1, "text after the end", line.text.empty() ? "an empty line" : quote(line.text),
           "the end of the file");
    }
  }

  std::filesystem::path path_;
  LineReader lines_;
  Sink& sink_;
  std::string_view text_;  // the current line
  std::size_t at_ = 0;     // how far it is read
  Header header_;
  ChangeCheck check_;
  std::unordered_map<std::string, std::size_t> names_;               // pin name to the line it stands on
  std::unordered_map<std::string_view, std::uint32_t> pin_by_name_;  // views into header_
  std::size_t first_pin_line_ = 0;
};

}  // namespace

void read_text_into(const std::filesystem::path& path, Sink& sink) { TextReader(path, sink).run(); }

Stream read_text(const std::filesystem::path& path) {
  Stream stream;
  read_text_into(path, stream);
  return stream;
}

}  // namespace meltstage::recording
