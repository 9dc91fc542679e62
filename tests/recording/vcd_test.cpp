// SPDX-License-Identifier: Apache-2.0
#include "recording/vcd.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>
#include <sstream>
#include <stdexcept>

#include "support.hpp"

namespace meltstage::recording {
namespace {

using ::testing::HasSubstr;

TEST(Vcd, SmallRecordingIsAsDefined) {
  const Folder folder;
  Header header = small_header();
  header.clock_hz = 20e6;  // 50 ns
  Stream stream;
  stream.begin(header);
  for (const Change& change : {Change{2, 0, 1}, {2, 1, 0}, {2, 2, 0}, {9, 1, 0xabc}, {9, 2, 1}})
    stream.change(change);
  stream.end(20);
  write_vcd(stream, folder / "a.vcd");
  EXPECT_EQ(load(folder / "a.vcd"),
            "$version Meltstage vectors $end\n"
            "$comment unit test $end\n"
            "$timescale 10 ns $end\n"
            "$scope module chip $end\n"
            "$var wire 1 ! rst_n $end\n"
            "$var wire 12 \" duty [11:0] $end\n"
            "$upscope $end\n"
            "$scope module stage $end\n"
            "$var wire 1 # step_x $end\n"
            "$upscope $end\n"
            "$enddefinitions $end\n"
            "#10\n"
            "$dumpvars\n"
            "1!\n"
            "b0 \"\n"
            "0#\n"
            "$end\n"
            "#45\n"
            "b101010111100 \"\n"
            "1#\n"
            "#105\n");
}

TEST(Vcd, BusAsBitsWritesOnlyTheBitsThatChange) {
  const Folder folder;
  Stream stream;
  Header header = small_header();
  header.clock_hz = 1e6;
  header.pins = {{"duty", Direction::out, 3, "chip"}};
  stream.begin(header);
  for (const Change& change : {Change{0, 0, 4}, {3, 0, 7}, {5, 0, 6}}) stream.change(change);
  stream.end(7);
  write_vcd(stream, folder / "a.vcd", BusForm::bits);
  EXPECT_EQ(load(folder / "a.vcd"),
            "$version Meltstage vectors $end\n"
            "$comment unit test $end\n"
            "$timescale 1 us $end\n"
            "$scope module chip $end\n"
            "$var wire 1 ! duty[0] $end\n"
            "$var wire 1 \" duty[1] $end\n"
            "$var wire 1 # duty[2] $end\n"
            "$upscope $end\n"
            "$enddefinitions $end\n"
            "#0\n$dumpvars\n0!\n0\"\n1#\n$end\n"
            "#3\n1!\n1\"\n"
            "#5\n0!\n"
            "#8\n");
}

/// A reader of the subset that any VCD has, written from the standard and not from the writer.
struct VcdFile {
  std::string timescale;
  std::map<std::string, std::pair<std::string, unsigned>> pins;  // "scope.name" to code and width
  std::vector<std::pair<std::uint64_t, std::map<std::string, std::uint64_t>>> times;  // code to value
};

VcdFile parse_vcd(const std::string& text) {
  VcdFile vcd;
  std::istringstream in(text);
  std::string scope;
  for (std::string token; in >> token;) {
    std::vector<std::string> words;
    if (token == "$dumpvars" || token == "$end") continue;
    if (token[0] == '$') {
      for (std::string word; in >> word && word != "$end";) words.push_back(word);
      if (token == "$timescale") vcd.timescale = words.at(0) + " " + words.at(1);
      if (token == "$scope") scope = words.at(1);
      if (token == "$var") {
        const auto width = static_cast<unsigned>(std::stoul(words.at(1)));
        vcd.pins[scope + "." + words.at(3)] = {words.at(2), width};
      }
    } else if (token[0] == '#') {
      vcd.times.push_back({std::stoull(token.substr(1)), {}});
    } else if (token[0] == 'b') {
      std::string code;
      in >> code;
      vcd.times.back().second[code] = std::stoull(token.substr(1), nullptr, 2);
    } else {
      vcd.times.back().second[token.substr(1)] = static_cast<std::uint64_t>(token[0] - '0');
    }
  }
  return vcd;
}

/// The value of a pin, be it one variable or one a bit.
std::uint64_t value_of(const VcdFile& vcd, const std::map<std::string, std::uint64_t>& values,
                       const Pin& pin) {
  const std::string name = pin.owner + "." + pin.name;
  if (const auto found = vcd.pins.find(name); found != vcd.pins.end()) {
    RC_ASSERT(found->second.second == pin.width);
    return values.at(found->second.first);
  }
  std::uint64_t value = 0;
  for (unsigned bit = 0; bit < pin.width; ++bit) {
    const auto& [code, width] = vcd.pins.at(fmt::format("{}[{}]", name, bit));
    RC_ASSERT(width == 1U);
    value |= values.at(code) << bit;
  }
  return value;
}

RC_GTEST_PROP(Vcd, ParsesBackToTheSameValues, ()) {
  const Folder folder;
  const Table table = random_table();
  write_vcd(record(table), folder / "a.vcd", *rc::gen::element(BusForm::vector, BusForm::bits));
  const VcdFile vcd = parse_vcd(load(folder / "a.vcd"));

  const Timescale timescale = timescale_for(table.header.clock_hz);
  RC_ASSERT(vcd.timescale == timescale.text);
  const double units_per_cycle = timescale.units_per_second / table.header.clock_hz;
  std::map<std::string, std::uint64_t> values;
  std::size_t next = 0;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const double now = static_cast<double>(table.first_cycle + i) * units_per_cycle;
    while (static_cast<double>(vcd.times.at(next).first) < now + 0.5 * units_per_cycle) {
      for (const auto& [code, value] : vcd.times[next].second) values[code] = value;
      ++next;
    }
    for (std::size_t pin = 0; pin < table.rows[i].size(); ++pin) {
      RC_ASSERT(value_of(vcd, values, table.header.pins[pin]) == table.rows[i][pin]);
    }
  }
  RC_ASSERT(next + 1 == vcd.times.size());
}

TEST(Vcd, OriginCannotEndTheComment) {
  const Folder folder;
  Stream stream;
  Header header = small_header();
  header.origin = "a $end\n$scope";
  Recorder recorder(stream, header);
  recorder.commit(0);
  recorder.finish(0);
  write_vcd(stream, folder / "a.vcd");
  EXPECT_THAT(load(folder / "a.vcd"), HasSubstr("$comment a \\x24end\\x0a\\x24scope $end\n"));
}

TEST(Vcd, TimePastTheLargestIsRefusedAndNothingIsLeft) {
  const Folder folder;
  Stream stream;
  Header header = small_header();
  header.clock_hz = 48e6;
  Recorder recorder(stream, header);
  recorder.commit(0);
  recorder.finish(std::uint64_t{1} << 60);
  EXPECT_THROW(write_vcd(stream, folder / "a.vcd"), std::invalid_argument);
  EXPECT_TRUE(folder.empty());
}

struct TimescaleCase {
  double clock_hz;
  const char* text;
};

class Timescales : public ::testing::TestWithParam<TimescaleCase> {};

TEST_P(Timescales, AreTheCoarsestThatHoldThePeriod) {
  EXPECT_EQ(timescale_for(GetParam().clock_hz).text, GetParam().text);
}

INSTANTIATE_TEST_SUITE_P(All, Timescales,
                         ::testing::Values(TimescaleCase{1.0, "1 s"}, TimescaleCase{2.0, "100 ms"},
                                           TimescaleCase{100.0, "10 ms"}, TimescaleCase{1e3, "1 ms"},
                                           TimescaleCase{50e3, "10 us"}, TimescaleCase{1e6, "1 us"},
                                           TimescaleCase{10e6, "100 ns"}, TimescaleCase{20e6, "10 ns"},
                                           TimescaleCase{50e6, "10 ns"}, TimescaleCase{25e6, "10 ns"},
                                           TimescaleCase{125e6, "1 ns"}, TimescaleCase{16e6, "100 ps"},
                                           TimescaleCase{48e6, "1 ps"}, TimescaleCase{1e10, "100 ps"}));

TEST(Vcd, OneRecordingOnly) {
  const Folder folder;
  VcdWriter writer(folder / "a.vcd");
  copy(small_stream(), writer);
  const std::string text = load(folder / "a.vcd");
  EXPECT_THROW(copy(small_stream(), writer), std::invalid_argument);
  EXPECT_THROW(writer.change({30, 0, 0}), std::invalid_argument);
  EXPECT_THROW(writer.end(30), std::invalid_argument);
  EXPECT_EQ(load(folder / "a.vcd"), text);
}

TEST(Vcd, RoundedTimesDoNotDrift) {
  const Folder folder;
  Stream stream;
  Header header = small_header();
  header.clock_hz = 48e6;  // 20833.33 ps
  Recorder recorder(stream, header);
  recorder.commit(0);
  recorder.set(0, 1);
  recorder.commit(48'000'000);
  recorder.finish(95'999'999);
  write_vcd(stream, folder / "a.vcd");
  const VcdFile vcd = parse_vcd(load(folder / "a.vcd"));
  ASSERT_EQ(vcd.times.size(), 3U);
  EXPECT_EQ(vcd.times[1].first, 1'000'000'000'000U);
  EXPECT_EQ(vcd.times[2].first, 2'000'000'000'000U);
}

}  // namespace
}  // namespace meltstage::recording
