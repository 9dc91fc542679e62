// SPDX-License-Identifier: Apache-2.0
#include "recording/text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <iterator>
#include <stdexcept>

#include "base/sha256.hpp"
#include "support.hpp"

namespace meltstage::recording {
namespace {

using ::testing::HasSubstr;

/// small_stream() as the format's definition has it; the hash is that of coreutils' sha256sum over the lines
/// above it.
constexpr std::string_view kSmallText =
    "meltstage-vectors 1\n"
    "origin unit test\n"
    "clock_hz 16000000\n"
    "meta seed=42\n"
    "pin rst_n in 1 chip\n"
    "pin duty out 12 chip\n"
    "pin step_x out 1 stage\n"
    "0 rst_n=0 duty=0x0 step_x=0\n"
    "5 rst_n=1\n"
    "9 duty=0xabc step_x=1\n"
    "end 20\n"
    "sha256 91a8a89590379918fdd35874968d849df58edc262698e09ac69374d63196a321\n";

/// Puts the right hash below `lines`: defects are then found for what they are.
std::string seal(const std::string& lines) {
  Sha256 hash;
  hash.update(lines);
  return lines + "sha256 " + hash.finish() + "\n";
}

/// small_text with line `number` (from 1) replaced and sealed anew. An empty replacement takes the line out.
std::string with_line(std::size_t number, const std::string& replacement) {
  std::string text;
  std::size_t begin = 0;
  for (std::size_t line = 1; line <= 11; ++line) {
    const std::size_t end = kSmallText.find('\n', begin) + 1;
    text += line == number ? replacement : std::string(kSmallText.substr(begin, end - begin));
    begin = end;
  }
  return seal(text);
}

FormatError error_of(const std::filesystem::path& path) {
  try {
    read_text(path);
  } catch (const FormatError& error) {
    return error;
  }
  return {"no error", 0, 0};
}

// --- good files ---

TEST(TextWriter, WritesTheDefinedBytes) {
  const Folder folder;
  write_text(small_stream(), folder / "a.mvec");
  EXPECT_EQ(load(folder / "a.mvec"), kSmallText);
}

TEST(TextReader, ReadsTheDefinedBytes) {
  const Folder folder;
  save(folder / "a.mvec", kSmallText);
  EXPECT_EQ(read_text(folder / "a.mvec"), small_stream());
}

RC_GTEST_PROP(Text, RoundTripIsExact, ()) {
  const Folder folder;
  const Stream stream = record(random_table());
  write_text(stream, folder / "a.mvec");
  const Stream back = read_text(folder / "a.mvec");
  RC_ASSERT(back == stream);
  write_text(back, folder / "b.mvec");
  RC_ASSERT(load(folder / "a.mvec") == load(folder / "b.mvec"));
}

TEST(Text, RoundTripsExtremes) {
  const Folder folder;
  Stream stream;
  Header header{{{std::string(kMaxNameBytes, '_'), Direction::inout, 64, "a"}},
                1.0,
                "\\ \x01\x7f\n\r\t \xc3\xa4 ",
                {{"k", ""}}};
  stream.begin(header);
  stream.change({kMaxCycle - 1, 0, 0});
  stream.change({kMaxCycle, 0, ~std::uint64_t{0}});
  stream.end(kMaxCycle);
  write_text(stream, folder / "a.mvec");
  EXPECT_EQ(read_text(folder / "a.mvec"), stream);
}

TEST(Text, RoundTripsTheLongestLineAndManyBuffers) {
  const Folder folder;
  Header header = small_header();
  header.pins.clear();
  for (std::size_t i = 0; i < kMaxPins; ++i) {
    std::string name = fmt::format("p{}_", i);
    name.resize(kMaxNameBytes, 'x');
    header.pins.push_back({name, Direction::out, 64, "chip"});
  }
  Stream stream;
  Recorder recorder(stream, header);
  for (std::uint64_t cycle = 0; cycle < 3; ++cycle) {
    for (std::uint32_t pin = 0; pin < kMaxPins; ++pin) recorder.set(pin, ~cycle);
    recorder.commit(kMaxCycle - 9 + cycle);
  }
  recorder.finish(kMaxCycle);
  write_text(stream, folder / "a.mvec");
  EXPECT_EQ(read_text(folder / "a.mvec"), stream);
}

TEST(Text, RoundTripsWithALineEndOnEitherSideOfABufferEnd) {
  constexpr std::size_t kBufferBytes = 256 * 1024;
  const Folder folder;
  for (std::size_t shift = 0; shift < 5; ++shift) {
    Stream stream;
    Header header = small_header();
    header.meta.clear();
    for (const char* key : {"a", "b", "c"}) header.meta[key] = std::string(kMaxStringBytes, 'x');
    const std::string head = "meltstage-vectors 1\norigin unit test\nclock_hz 16000000\n";
    const std::size_t before = head.size() + 3 * (kMaxStringBytes + std::string("meta a=\n").size());
    header.meta["d"] = std::string(kBufferBytes - before - std::string("meta d=").size() - 2 + shift, 'x');
    Recorder recorder(stream, header);
    recorder.commit(0);
    recorder.finish(0);
    write_text(stream, folder / "a.mvec");
    EXPECT_EQ(load(folder / "a.mvec")[kBufferBytes - 2 + shift], '\n');
    EXPECT_EQ(read_text(folder / "a.mvec"), stream);
  }
}

// --- defects ---

struct Defect {
  const char* name;
  std::string text;
  std::size_t line;
  std::size_t column;
  const char* defect;
  const char* found;
  const char* expected;
};

void PrintTo(const Defect& defect, std::ostream* out) { *out << defect.name; }

class Defects : public ::testing::TestWithParam<Defect> {};

TEST_P(Defects, AreNamedWithLineAndColumn) {
  const Folder folder;
  const Defect& defect = GetParam();
  save(folder / "bad.mvec", defect.text);
  const FormatError error = error_of(folder / "bad.mvec");
  const std::string place = fmt::format("bad.mvec:{}:{}: ", defect.line, defect.column);
  EXPECT_EQ(error.line(), defect.line) << error.what();
  EXPECT_EQ(error.column(), defect.column) << error.what();
  EXPECT_THAT(error.what(), HasSubstr(place + defect.defect + ": found " + defect.found));
  EXPECT_THAT(error.what(), HasSubstr(std::string("expected ") + defect.expected));
  EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos);
}

const std::string long_string(kMaxStringBytes + 1, 'a');

std::string many_pins() {
  std::string pins;
  for (std::size_t i = 0; i < kMaxPins - 1; ++i) pins += fmt::format("pin p{} in 1 chip\n", i);
  return pins;
}

INSTANTIATE_TEST_SUITE_P(
    FirstLine, Defects,
    ::testing::Values(
        Defect{"empty", "", 1, 1, "empty file", "the end of the file", "\"meltstage-vectors 1\""},
        Defect{"binary",
               std::string("\x7f"
                           "ELF\0\0",
                           6),
               1, 1, "not a text file", "byte 0x7f", "\"meltstage-vectors 1\""},
        Defect{"binary_later", std::string("ab\0c", 4), 1, 3, "not a text file", "byte 0x00",
               "\"meltstage-vectors 1\""},
        Defect{"utf16", "\xff\xfem", 1, 1, "not a text file", "byte 0xff", "\"meltstage-vectors 1\""},
        Defect{"other_text", "x,y\n1,2\n", 1, 1, "not a vector file", "\"x,y\"", "\"meltstage-vectors 1\""},
        Defect{"other_text_no_newline", "x,y", 1, 1, "not a vector file", "\"x,y\"",
               "\"meltstage-vectors 1\""},
        Defect{"huge_line", std::string(3 << 20, 'x'), 1, 1, "not a vector file", "\"xxxx",
               "\"meltstage-vectors 1\""},
        Defect{"no_version", with_line(1, "meltstage-vectors\n"), 1, 18, "bad line", "the end of the line",
               "one space"},
        Defect{"version_2", with_line(1, "meltstage-vectors 2\n"), 1, 19, "wrong format version", "\"2\"",
               "1"},
        Defect{"version_word", with_line(1, "meltstage-vectors one\n"), 1, 19, "bad format version",
               "\"one\"", "a decimal"},
        Defect{"more_behind", with_line(1, "meltstage-vectors 1 \n"), 1, 20, "bad line", "\" \"",
               "the end of the line"},
        Defect{"crlf", with_line(1, "meltstage-vectors 1\r\n"), 1, 20, "foreign line end", "\"\\x0d\"",
               "a newline"}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Header, Defects,
    ::testing::Values(
        Defect{"no_origin", with_line(2, ""), 2, 1, "missing header field", "\"clock_hz\"", "\"origin\""},
        Defect{"empty_origin", with_line(2, "origin \n"), 2, 8, "bad origin", "nothing", "who recorded"},
        Defect{"origin_no_space", with_line(2, "origin\n"), 2, 7, "bad line", "the end of the line",
               "one space"},
        Defect{"control_byte", with_line(2, "origin a\tb\n"), 2, 9, "bad origin",
               "a bare control byte \"\\x09\"", "it escaped"},
        Defect{"escape", with_line(2, "origin a\\n\n"), 2, 9, "bad escape", "\"\\n\"", "\\\\ or"},
        Defect{"escape_upper", with_line(2, "origin a\\x0A\n"), 2, 9, "bad escape", "\"\\x0A\"", "\\\\ or"},
        Defect{"escape_needless", with_line(2, "origin a\\x41\n"), 2, 9, "bad escape", "\"\\x41\"",
               "\\\\ or"},
        Defect{"escape_of_backslash", with_line(2, "origin a\\x5c\n"), 2, 9, "bad escape", "\"\\x5c\"",
               "\\\\ or"},
        Defect{"escape_of_control", with_line(2, "origin a\\\x1e\n"), 2, 9, "bad escape", "\"\\\\x1E\"",
               "\\\\ or"},
        Defect{"escape_cut", with_line(2, "origin a\\x0\n"), 2, 9, "bad escape", "\"\\x0\"", "\\\\ or"},
        Defect{"origin_too_long", with_line(2, "origin " + long_string + "\n"), 2, 8, "bad origin",
               "65537 bytes", "at most 65536"},
        Defect{"line_too_long", with_line(2, "origin " + std::string(3 << 20, 'x') + "\n"), 2, (2 << 20) + 1,
               "line too long", "more than 2097152 bytes", "a newline before"},
        Defect{"no_clock", with_line(3, ""), 3, 1, "missing header field", "\"meta\"", "\"clock_hz\""},
        Defect{"clock_word", with_line(3, "clock_hz fast\n"), 3, 10, "bad clock_hz", "\"fast\"",
               "a number from 1 to"},
        Defect{"clock_zero", with_line(3, "clock_hz 0\n"), 3, 10, "bad clock_hz", "\"0\"",
               "a number from 1 to"},
        Defect{"clock_nan", with_line(3, "clock_hz nan\n"), 3, 10, "bad clock_hz", "\"nan\"",
               "a number from 1 to"},
        Defect{"clock_unit", with_line(3, "clock_hz 16 MHz\n"), 3, 10, "bad clock_hz", "\"16 MHz\"",
               "a number from 1 to"},
        Defect{"clock_form", with_line(3, "clock_hz 16e6\n"), 3, 10, "bad clock_hz", "\"16e6\"",
               "its shortest form \"16000000\""},
        Defect{"meta_key", with_line(4, "meta se&d=42\n"), 4, 6, "bad meta key", "\"se&d\"", "letters"},
        Defect{"meta_no_value", with_line(4, "meta seed\n"), 4, 10, "bad line", "the end of the line",
               "\"=\""},
        Defect{"meta_twice", with_line(4, "meta seed=42\nmeta seed=43\n"), 5, 6, "duplicate meta key",
               "\"seed\"", "each key once"},
        Defect{"meta_order", with_line(4, "meta seed=42\nmeta a=43\n"), 5, 6, "meta key out of order",
               "\"a\"", "it before \"seed\""},
        Defect{"no_pins", seal("meltstage-vectors 1\norigin a\nclock_hz 1\n0 a=1\nend 1\n"), 4, 1,
               "missing header field", "\"0\"", "\"meta\" or \"pin\""},
        Defect{"meta_behind_pin", with_line(5, "pin rst_n in 1 chip\nmeta z=1\n"), 6, 1, "unknown line",
               "\"meta\"", "a cycle number"},
        Defect{"pin_twice", with_line(6, "pin rst_n out 12 chip\n"), 6, 5, "duplicate pin", "\"rst_n\"",
               "a name other than that of line 5"},
        Defect{"pin_name", with_line(6, "pin 2duty out 12 chip\n"), 6, 5, "bad pin name", "\"2duty\"",
               "a letter or '_'"},
        Defect{"pin_name_missing", with_line(6, "pin  out 12 chip\n"), 6, 5, "bad pin name", "a space",
               "a letter or '_'"},
        Defect{"pin_direction", with_line(6, "pin duty output 12 chip\n"), 6, 10, "bad pin direction",
               "\"output\"", "\"in\""},
        Defect{"pin_width_word", with_line(6, "pin duty out wide chip\n"), 6, 14, "bad pin width", "\"wide\"",
               "a decimal"},
        Defect{"pin_width_0", with_line(6, "pin duty out 0 chip\n"), 6, 14, "bad pin width", "\"0\"",
               "1 to 64"},
        Defect{"pin_width_65", with_line(6, "pin duty out 65 chip\n"), 6, 14, "bad pin width", "\"65\"",
               "1 to 64"},
        Defect{"pin_owner_missing", with_line(6, "pin duty out 12\n"), 6, 16, "bad line",
               "the end of the line", "one space"},
        Defect{"pin_owner", with_line(6, "pin duty out 12 the-chip\n"), 6, 17, "bad pin owner",
               "\"the-chip\"", "a letter or '_'"},
        Defect{"pin_more", with_line(6, "pin duty out 12 chip x\n"), 6, 21, "bad line", "\" x\"",
               "the end of the line"},
        Defect{"pins_too_many", with_line(6, many_pins() + "pin duty out 12 chip\n"), 4101, 1,
               "too many pins", "one more", "at most 4096"}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Body, Defects,
    ::testing::Values(
        Defect{"unknown_pin", with_line(9, "5 rst=1\n"), 9, 3, "unknown pin", "\"rst\"",
               "a pin of lines 5 to 7"},
        Defect{"unknown_line", with_line(9, "rst_n=1\n"), 9, 1, "unknown line", "\"rst_n\"",
               "a cycle number or \"end\""},
        Defect{"empty_line", with_line(9, "\n"), 9, 1, "unknown line", "the end of the line",
               "a cycle number or \"end\""},
        Defect{"cycle_zeros", with_line(9, "05 rst_n=1\n"), 9, 1, "bad cycle", "\"05\"",
               "a decimal number without leading"},
        Defect{"cycle_word", with_line(9, "5x rst_n=1\n"), 9, 2, "bad line", "\"x\"", "one space"},
        Defect{"cycle_huge", with_line(9, "18446744073709551616 rst_n=1\n"), 9, 1, "bad cycle",
               "\"18446744073709551616\"", "at most 18446744073709551615"},
        Defect{"cycle_large", with_line(9, "9223372036854775808 rst_n=1\n"), 9, 1, "bad cycle",
               "\"9223372036854775808\"", "at most 9223372036854775807"},
        Defect{"cycle_backwards", with_line(10, "4 duty=0xabc\n"), 10, 1, "cycle going backwards", "\"4\"",
               "more than 5"},
        Defect{"cycle_twice", with_line(10, "5 duty=0xabc\n"), 10, 1, "cycle twice", "\"5\"", "more than 5"},
        Defect{"no_change", with_line(9, "5\n"), 9, 2, "bad line", "the end of the line", "one space"},
        Defect{"space_behind", with_line(9, "5 rst_n=1 \n"), 9, 11, "unknown pin", "the end of the line",
               "a pin of lines"},
        Defect{"two_spaces", with_line(9, "5  rst_n=1\n"), 9, 3, "unknown pin", "a space", "a pin of lines"},
        Defect{"no_value", with_line(9, "5 rst_n\n"), 9, 8, "bad line", "the end of the line", "\"=\""},
        Defect{"bit_empty", with_line(9, "5 rst_n=\n"), 9, 9, "bad value", "the end of the line", "0 or 1"},
        Defect{"bit_x", with_line(9, "5 rst_n=x\n"), 9, 9, "bad value", "\"x\"", "0 or 1"},
        Defect{"bit_2", with_line(9, "5 rst_n=2\n"), 9, 9, "value too wide", "\"2\"", "0 or 1"},
        Defect{"bit_10", with_line(9, "5 rst_n=10\n"), 9, 9, "value too wide", "\"10\"", "0 or 1"},
        Defect{"bit_equals", with_line(9, "5 rst_n=1=1\n"), 9, 9, "value too wide", "\"1\"", "0 or 1"},
        Defect{"hex_plain", with_line(10, "9 duty=12\n"), 10, 8, "bad value", "\"12\"", "0x and lower-case"},
        Defect{"hex_empty", with_line(10, "9 duty=0x step_x=1\n"), 10, 8, "bad value", "\"0x\"",
               "0x and lower-case"},
        Defect{"hex_upper", with_line(10, "9 duty=0xABC\n"), 10, 8, "bad value", "\"0xABC\"",
               "0x and lower-case"},
        Defect{"hex_zeros", with_line(10, "9 duty=0x0ab\n"), 10, 8, "bad value", "\"0x0ab\"",
               "0x and lower-case"},
        Defect{"hex_wide", with_line(10, "9 duty=0x1000\n"), 10, 8, "value too wide", "\"0x1000\"",
               "at most 0xfff for a pin of 12 bits"},
        Defect{"hex_huge", with_line(10, "9 duty=0x10000000000000000\n"), 10, 8, "value too wide",
               "\"0x10000000000000000\"", "at most 0xfff"},
        Defect{"pin_repeated", with_line(10, "9 duty=0xabc duty=0xabd\n"), 10, 14, "pin twice in a cycle",
               "\"duty\"", "each pin once"},
        Defect{"pin_order", with_line(10, "9 step_x=1 duty=0xabc\n"), 10, 12, "pin out of order", "\"duty\"",
               "the pins in header order"},
        Defect{"value_unchanged", with_line(10, "9 duty=0x0\n"), 10, 8, "value unchanged", "\"0x0\"",
               "another value"},
        Defect{"first_incomplete", with_line(8, "0 rst_n=0 duty=0x0\n"), 8, 19, "first cycle incomplete",
               "the end of the line", "the value of pin \"step_x\""},
        Defect{"first_skips", with_line(8, "0 rst_n=0 step_x=0\n"), 8, 11, "first cycle incomplete",
               "\"step_x\"", "pin \"duty\""},
        Defect{"first_repeats", with_line(8, "0 rst_n=0 rst_n=0\n"), 8, 11, "pin twice in a cycle",
               "\"rst_n\"", "each pin once"},
        Defect{"first_missing", seal("meltstage-vectors 1\norigin a\nclock_hz 1\npin a in 1 chip\nend 1\n"),
               5, 1, "missing first cycle", "\"end\"", "a line that states every pin"}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    End, Defects,
    ::testing::Values(
        Defect{"no_end", with_line(11, ""), 11, 1, "unknown line", "\"sha256\"", "a cycle number or \"end\""},
        Defect{"end_without_cycle", with_line(11, "end\n"), 11, 4, "bad line", "the end of the line",
               "one space"},
        Defect{"end_early", with_line(11, "end 8\n"), 11, 5, "bad final cycle", "\"8\"", "9 or later"},
        Defect{"end_large", with_line(11, "end 9223372036854775808\n"), 11, 5, "bad final cycle",
               "\"9223372036854775808\"", "at most 9223372036854775807"},
        Defect{"end_more", with_line(11, "end 20 x\n"), 11, 7, "bad line", "\" x\"", "the end of the line"},
        Defect{"no_hash", with_line(11, "end 20\n25 rst_n=0\n"), 12, 1, "missing hash", "\"25\"",
               "\"sha256\""},
        Defect{"hash_short", std::string(kSmallText.substr(0, kSmallText.size() - 2)) + "\n", 12, 8,
               "bad hash", "\"", "64 lower-case"},
        Defect{"hash_upper", std::string(kSmallText.substr(0, kSmallText.size() - 2)) + "A\n", 12, 8,
               "bad hash", "\"", "64 lower-case"},
        Defect{"behind", std::string(kSmallText) + "x", 13, 1, "text after the end", "\"x\"",
               "the end of the file"},
        Defect{"empty_line_behind", std::string(kSmallText) + "\n", 13, 1, "text after the end",
               "an empty line", "the end of the file"},
        Defect{"file_twice", std::string(kSmallText) + std::string(kSmallText), 13, 1, "text after the end",
               "\"meltstage-vectors 1\"", "the end of the file"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(TextReader, HashMismatchNamesBothHashes) {
  const Folder folder;
  std::string text(kSmallText);
  text.replace(text.find("seed=42"), 7, "seed=43");
  save(folder / "bad.mvec", text);
  const FormatError error = error_of(folder / "bad.mvec");
  EXPECT_EQ(error.line(), 12U);
  EXPECT_EQ(error.column(), 8U);
  EXPECT_THAT(error.what(),
              HasSubstr("hash mismatch: found "
                        "91a8a89590379918fdd35874968d849df58edc262698e09ac69374d63196a321, expected "));
}

TEST(TextReader, TruncationAtEveryByteIsFoundWhereTheFileEnds) {
  const Folder folder;
  std::size_t line = 1;
  std::size_t column = 1;
  for (std::size_t size = 0; size < kSmallText.size(); ++size) {
    save(folder / "cut.mvec", kSmallText.substr(0, size));
    const FormatError error = error_of(folder / "cut.mvec");
    EXPECT_EQ(error.line(), line) << error.what();
    EXPECT_EQ(error.column(), column) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(size == 0 ? "empty file" : "truncated"));
    const bool newline = kSmallText[size] == '\n';
    line += newline ? 1 : 0;
    column = newline ? 1 : column + 1;
  }
}

TEST(TextReader, AnyChangedByteIsFound) {
  const Folder folder;
  for (std::size_t at = 0; at < kSmallText.size(); ++at) {
    for (const int flip : {0x01, 0x02, 0x10, 0x20, 0x80}) {
      std::string text(kSmallText);
      text[at] = static_cast<char>(text[at] ^ flip);
      save(folder / "bad.mvec", text);
      EXPECT_THROW(read_text(folder / "bad.mvec"), FormatError) << "byte " << at << " flipped by " << flip;
    }
  }
}

TEST(TextReader, MissingFileIsNamedWithTheReason) {
  try {
    read_text("no/such.mvec");
    FAIL() << "read a file that is not there";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no/such.mvec: cannot read: found \"No such file or directory\""));
  }
}

TEST(TextReader, FolderIsNamedWithTheReason) {
  const Folder folder;
  try {
    read_text(folder / "");
    FAIL() << "read a folder";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("Is a directory"));
  }
}

// --- nothing half-written ---

TEST(TextWriter, LeavesNothingWithoutEnd) {
  const Folder folder;
  {
    TextWriter writer(folder / "a.mvec");
    writer.begin(small_header());
    writer.change({0, 0, 0});
  }
  EXPECT_TRUE(folder.empty());
}

std::ptrdiff_t files_in(const Folder& folder) {
  const std::filesystem::directory_iterator files(folder / "");
  return std::distance(begin(files), end(files));
}

TEST(TextWriter, KeepsTheOldFileUntilTheEnd) {
  const Folder folder;
  save(folder / "a.mvec", "old");
  TextWriter writer(folder / "a.mvec");
  writer.begin(small_header());
  for (std::uint32_t pin = 0; pin < 3; ++pin) writer.change({0, pin, 0});
  EXPECT_EQ(load(folder / "a.mvec"), "old");
  writer.end(0);
  EXPECT_THAT(load(folder / "a.mvec"), HasSubstr("0 rst_n=0 duty=0x0 step_x=0\nend 0\n"));
  EXPECT_EQ(files_in(folder), 1);
}

TEST(TextWriter, RefusesCallsAfterTheEnd) {
  const Folder folder;
  TextWriter writer(folder / "a.mvec");
  copy(small_stream(), writer);
  EXPECT_THROW(writer.change({30, 0, 0}), std::invalid_argument);
  EXPECT_THROW(writer.end(30), std::invalid_argument);
  EXPECT_THROW(writer.begin(small_header()), std::invalid_argument);
  EXPECT_EQ(load(folder / "a.mvec"), kSmallText);
}

TEST(TextWriter, RefusesASecondBegin) {
  const Folder folder;
  TextWriter writer(folder / "a.mvec");
  writer.begin(small_header());
  EXPECT_THROW(copy(small_stream(), writer), std::invalid_argument);
}

TEST(TextWriter, DamagedInputIsNeverPublished) {
  const Folder folder;
  std::string text(kSmallText);
  text.replace(text.find("seed=42"), 7, "seed=43");
  save(folder / "bad.mvec", text);
  {
    TextWriter writer(folder / "copy.mvec");
    EXPECT_THROW(read_text_into(folder / "bad.mvec", writer), FormatError);
  }
  EXPECT_EQ(files_in(folder), 1) << "bad.mvec alone";
}

TEST(TextWriter, MissingFolderIsNamedWithTheReason) {
  try {
    TextWriter writer("no/such/a.mvec");
    FAIL() << "wrote into a folder that is not there";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no/such/a.mvec: cannot write: found \"No such file or directory\""));
  }
}

TEST(TextWriter, FullDiskIsNamedWithTheReason) {
  // A limit on the size of files stands for a disk that is full.
  const Folder folder;
  TextWriter writer(folder / "a.mvec");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{0, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &full);
  std::string reason;
  try {
    copy(small_stream(), writer);
  } catch (const std::runtime_error& error) {
    reason = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(reason, HasSubstr("a.mvec: cannot write: found \"File too large\""));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.mvec"));
}

}  // namespace
}  // namespace meltstage::recording
