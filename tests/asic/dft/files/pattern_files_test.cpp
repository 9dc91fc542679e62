// SPDX-License-Identifier: Apache-2.0
// WGL, VCD and extended VCD: what is written is read back; seeded defects are refused with line and reason.
#include "asic/dft/files/pattern_files.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "asic/dft/files/formats.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/scan/lint.hpp"

namespace meltstage::dft {
namespace {

using testing::HasSubstr;

CycleStream small_stream() {
  CycleStream stream;
  stream.title = "small";
  stream.signals = {{"clk", true},  {"rst_n", true}, {"d[0]", true},
                    {"d[1]", true}, {"q[0]", false}, {"q[1]", false}};
  stream.cycles = {{"0000XX", "reset"}, {"P100LH", "load", 3}, {"P110HL", ""}, {"P101LL", "piece"},
                   {"0111HH", ""},      {"P111XH", "", 2},     {"P010XX", ""}};
  return stream;
}
Directions small_directions() {
  Directions directions;
  for (const TestSignal& signal : small_stream().signals) directions[signal.name] = signal.is_input;
  return directions;
}

TEST(PatternFiles, WglRoundTrip) {
  CycleStream stream = small_stream();
  for (const double drive : {0.0, 5.0}) {
    stream.timing = {80, drive, 30, 40, 60};
    const CycleStream read = parse_wgl(wgl_text(stream), "small.wgl");
    EXPECT_TRUE(same_cycles(read, stream));
    EXPECT_EQ(std::count_if(read.cycles.begin(), read.cycles.end(),
                            [](const TestCycle& c) { return c.label == "piece"; }),
              1);
    EXPECT_TRUE(lint(read, {}).empty());
  }
}

TEST(PatternFiles, AByteOrderMarkSaysNothing) {
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_TRUE(same_cycles(parse_wgl(mark + wgl_text(small_stream()), "small.wgl"), small_stream()));
  EXPECT_TRUE(same_cycles(parse_dump(mark + evcd_text(small_stream()), "small.evcd", {}), small_stream()));
}

TEST(PatternFiles, NothingStandsBehindTheEndOfWgl) {
  const std::string text = wgl_text(small_stream());
  EXPECT_TRUE(same_cycles(parse_wgl(text + "\n# a comment\n{ and one }\n", "a.wgl"), small_stream()));
  EXPECT_TRUE(same_cycles(parse_wgl(text + "\n# without a new line", "a.wgl"), small_stream()));
  const auto line = std::to_string(std::count(text.begin(), text.end(), '\n') + 1);
  for (const std::string& more : {std::string("junk\n"), text, std::string("\"\"")})
    EXPECT_THAT([&] { parse_wgl(text + more, "a.wgl"); },
                testing::ThrowsMessage<PatternFileError>(
                    testing::AllOf(testing::StartsWith("a.wgl:" + line + ":1: found "),
                                   HasSubstr("expected nothing behind the waveform's end"))));
}

// loop N ... end: the vectors between them, so many times.
TEST(PatternFiles, WglLoopsAreUnrolled) {
  const std::string text = wgl_text(small_stream());
  const std::size_t begin = text.find("vector(tp)"), end = text.find(";\n", begin) + 2;
  const std::string vector = text.substr(begin, end - begin);
  const auto with = [&](const std::string& vectors) {
    return parse_wgl(text.substr(0, begin) + vectors + text.substr(end), "a.wgl");
  };
  EXPECT_TRUE(same_cycles(with("loop 3 " + vector + "end\n"), with(vector + vector + vector)));
  EXPECT_TRUE(same_cycles(
      with("loop 2 " + vector + "loop 2 " + vector + "end\nrepeat 2 " + vector + "end\n"),
      with(vector + vector + vector + vector + vector + vector + vector + vector + vector + vector)));
  EXPECT_THAT([&] { with("loop 10000000000 " + vector + vector + "end\n"); },
              testing::ThrowsMessage<PatternFileError>(HasSubstr("more cycles than this program takes")));
  std::string deep, ends;
  for (int i = 0; i < 17; ++i) deep += "loop 1 ", ends += "end\n";
  EXPECT_THAT([&] { with(deep + vector + ends); },
              testing::ThrowsMessage<PatternFileError>(
                  HasSubstr("found loops nested more deeply, expected at most 16")));
}

TEST(PatternFiles, ACutOffDumpIsRefused) {
  for (std::string text : {evcd_text(small_stream()), vcd_text(small_stream())}) {
    text.pop_back();
    EXPECT_THAT(
        [&] { parse_dump(text, "a.vcd", small_stream().timing, small_directions()); },
        testing::ThrowsMessage<PatternFileError>(HasSubstr("found the file's end in the middle of a line")));
  }
}

TEST(PatternFiles, InputsThatWglLeavesOpenAreSo) {
  for (const char open : {'X', '-'}) {
    std::string text = wgl_text(small_stream());
    const std::string vector = "[ 0 0 0 0 X X ]";
    text[text.find(vector) + vector.find("0 X X")] = open;
    CycleStream expected = small_stream();
    expected.cycles[0].states = "000NXX";
    EXPECT_TRUE(same_cycles(parse_wgl(text, "small.wgl"), expected)) << open;
  }
}

// What a cycle of a stream can't say is told with its line.
TEST(PatternFiles, WglTimingOfAnotherOrderOrShapeIsTold) {
  struct Change {
    const char *find, *put, *said;
  };
  const Change changes[] = {
      {"\"q[0]\" := output[0nS:X, 40nS:Q, 41nS:X]", "\"q[0]\" := output[0nS:X, 85nS:Q, 86nS:X]",
       "of \"q[0]\": compared at 86 ns, expected it before the clock's pulse (1 of \"clk\": 50 ns)"},
      {"\"q[0]\" := output[0nS:X, 40nS:Q, 41nS:X]", "\"q[0]\" := output[0nS:X, 40nS:Q, 60nS:X]",
       "of \"q[0]\": compared at 60 ns"},
      {"\"q[0]\" := output[0nS:X, 40nS:Q, 41nS:X]", "\"q[0]\" := output[0nS:X, 40nS:Q]",
       "of \"q[0]\": compared at 100 ns"},  // to the period's end
      {"\"d[0]\" := input[0nS:S]", "\"d[0]\" := input[60nS:S]",
       "of \"d[0]\": driven at 60 ns, expected it before the clock's pulse"},
      {"\"d[0]\" := input[0nS:S]", "\"d[0]\" := input[0nS:U, 20nS:S]",
       "0 of \"d[0]\": U at 0 ns, D at 20 ns"},
      {"\"clk\" := input[0nS:D, 50nS:S, 80nS:D]", "\"clk\" := input[0nS:U, 50nS:S, 80nS:U]",
       "0 of \"clk\": U at 0 ns, D at 50 ns, U at 80 ns, expected the low level"},
      {"\"clk\" := input[0nS:D, 50nS:S, 80nS:D]", "\"clk\" := input[0nS:D, 50nS:S, 80nS:D, 85nS:S, 90nS:D]",
       "1 of \"clk\": D at 0 ns, U at 50 ns, D at 80 ns, U at 85 ns"},
  };
  for (const Change& change : changes) {
    std::string text = wgl_text(small_stream());
    const std::size_t at = text.find(change.find);
    ASSERT_NE(at, std::string::npos) << change.find;
    text.replace(at, std::string(change.find).size(), change.put);
    const CycleStream stream = parse_wgl(text, "a.wgl");
    const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
    EXPECT_THAT(lint(stream, {}),
                testing::Contains(testing::AllOf(testing::StartsWith("a.wgl:" + std::to_string(line) + ":"),
                                                 HasSubstr(change.said))))
        << change.put;
    EXPECT_THROW(require_runnable(stream), UserError) << change.put;
  }
}

TEST(PatternFiles, ADumpIsSampledBeforeItsClock) {
  for (const TestTiming& timing :
       {TestTiming{100, 0, 90, 50, 80}, TestTiming{100, 0, 50, 50, 80}, TestTiming{100, 10, 5, 50, 80}})
    EXPECT_THAT([&] { parse_dump(evcd_text(small_stream()), "a.evcd", timing); },
                testing::Throws<UserError>());
}

TEST(PatternFiles, DumpRoundTrip) {
  CycleStream stream = small_stream();
  for (const double drive : {0.0, 5.0}) {
    stream.timing = {80, drive, 30, 40, 60};
    EXPECT_TRUE(same_cycles(parse_dump(evcd_text(stream), "small.evcd", stream.timing), stream));
    EXPECT_TRUE(
        same_cycles(parse_dump(vcd_text(stream), "small.vcd", stream.timing, small_directions()), stream));
  }
}

TEST(PatternFiles, StilKeepsCounts) {
  const CycleStream stream = small_stream();
  const CycleStream read = parse_stil(flat_stil_text(stream), "small.stil");
  EXPECT_TRUE(same_cycles(read, stream));
  EXPECT_EQ(read.cycles.size(), stream.cycles.size());
  EXPECT_EQ(cycle_count(read), 10u);
}

// A change of one strobe is seen in every format.
TEST(PatternFiles, AnyChangedStateIsSeen) {
  const CycleStream stream = small_stream();
  for (std::size_t i = 0; i < stream.cycles.size(); ++i) {
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      CycleStream other = stream;
      char& c = other.cycles[i].states[s];
      c = c == 'H' ? 'L' : c == 'L' || c == 'X' ? 'H' : c == '1' ? '0' : '1';
      if (s == 0) c = stream.cycles[i].states[s] == 'P' ? '0' : 'P';
      EXPECT_FALSE(same_cycles(parse_wgl(wgl_text(other), "x"), stream));
      EXPECT_FALSE(same_cycles(parse_dump(evcd_text(other), "x", other.timing), stream));
      EXPECT_FALSE(same_cycles(parse_dump(vcd_text(other), "x", other.timing, small_directions()), stream));
      EXPECT_FALSE(same_cycles(parse_stil(flat_stil_text(other), "x"), stream));
    }
  }
}

struct Defect {
  const char* name;
  const char* find;
  const char* put;
  const char* reason;
};

void expect_refused(const std::string& good, const Defect& defect, const std::string& file,
                    const std::function<CycleStream(const std::string&, const std::string&)>& parse) {
  std::string text = good;
  const std::size_t at = text.find(defect.find);
  ASSERT_NE(at, std::string::npos) << defect.name;
  text.replace(at, std::string(defect.find).size(), defect.put);
  try {
    parse(text, file);
    ADD_FAILURE() << file << ": " << defect.name << " was taken";
  } catch (const PatternFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr(defect.reason)) << defect.name;
    EXPECT_THAT(error.what(), HasSubstr(file + ":" + std::to_string(error.line()) + ":")) << defect.name;
    const auto line = static_cast<std::size_t>(
        std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1);
    EXPECT_LE(error.line(), line + 12) << defect.name << ": " << error.what();
  }
}

TEST(PatternFiles, SeededWglDefectsAreRefusedWithLineAndReason) {
  const Defect defects[] = {
      {"no waveform", "waveform small", "waveforms small", "expected \"waveform\""},
      {"undefined signal in the timeplate", "\"rst_n\" := input", "\"rst\" := input", "signal \"rst\""},
      {"undefined column", "pattern main (\"clk\"", "pattern main (\"clock\"", "signal \"clock\""},
      {"missing column", ", \"q[1]\")", ")", "no column of \"q[1]\""},
      {"signal twice", "\"d[1]\" : input", "\"d[0]\" : input", "signal \"d[0]\" again"},
      {"unknown direction", "\"q[0]\" : output", "\"q[0]\" : strobe", "expected input or output"},
      {"direction against the signal", "\"q[0]\" := output", "\"q[0]\" := input", "expected output"},
      {"bad time", "period 100nS", "period 100", "time \"100\""},
      {"edge behind the period", "80nS:D", "180nS:D", "an edge at 180 ns"},
      {"edges out of order", "50nS:S, 80nS:D", "50nS:S, 20nS:D", "an edge at 20 ns"},
      {"unknown edge", "40nS:Q", "40nS:W", "\"W\""},
      {"undefined timeplate", "vector(tp)", "vector(tq)", "timeplate \"tq\""},
      {"vector too short", "[ 0 0 0 0 X X ]", "[ 0 0 0 0 X ]", "5 values"},
      {"vector too long", "[ 0 0 0 0 X X ]", "[ 0 0 0 0 X X X ]", "7 values"},
      {"bad value of an input", "[ 0 0 0 0 X X ]", "[ 0 0 0 Z X X ]", "Z for \"d[1]\""},
      {"bad value of an output", "[ 0 0 0 0 X X ]", "[ 0 0 0 0 X 7 ]", "7 for \"q[1]\""},
      {"vector left open", "[ 0 0 0 0 X X ]", "[ 0 0 0 0 X X ", "a vector left open"},
      {"repeat without a number", "repeat 3", "repeat x", "\"x\""},
      {"missing semicolon", "X X ];", "X X ]", "expected \";\""},
      {"comment left open", "{ piece }", "{ piece ", "a comment left open"},
      {"name left open", "\"rst_n\" : input", "\"rst_n : input", "a name left open"},
      {"no end", "end\n\nend\n", "", "the end of the file"},
  };
  for (const Defect& defect : defects)
    expect_refused(wgl_text(small_stream()), defect, "bad.wgl",
                   [](const std::string& text, const std::string& name) { return parse_wgl(text, name); });
}

TEST(PatternFiles, WglLimitsHold) {
  const std::string good = wgl_text(small_stream());
  const std::size_t most = parse_wgl(good, "a.wgl").cycles.size();
  EXPECT_NO_THROW(parse_wgl(good, "a.wgl", most));
  const auto refuses = [&](const char* find, const char* put, const char* message) {
    std::string text = good;
    text.replace(text.find(find), std::string(find).size(), put);
    EXPECT_THAT([&] { parse_wgl(text, "a.wgl", most); },
                testing::ThrowsMessage<PatternFileError>(HasSubstr(message)));
  };
  refuses("repeat 3", "repeat 99999999999999999999", "how often the vector is repeated, 1 to 10000000000");
  refuses("repeat 3", "repeat 10000000000", "more cycles than this program takes");
  refuses("repeat 3 vector(tp) :=", "vector(tp) := [ 0 0 0 0 X X ]; vector(tp) :=", "more cycles");
  refuses("pattern main", "signal \"z\" : input; end pattern main", "signals after the timeplate");
  refuses("100nS", "infnS", "time \"infnS\"");
  refuses("100nS", "1e999nS", "time \"1e999nS\"");
  refuses("\"rst_n\" : input", "\"rst n\" : input", "a name without blanks");
}

// A dump that says little of long stretches is read at once.
TEST(PatternFiles, LongDumpsAreReadByStretches) {
  std::string text = evcd_text(small_stream());
  const std::string end = "#1000000\n";
  ASSERT_EQ(text.substr(text.size() - end.size()), end);
  text.replace(text.size() - end.size(), end.size(), "#900000000000000\n");
  EXPECT_EQ(cycle_count(parse_dump(text, "a.evcd", {})), 9'000'000'000U);
  text.insert(text.size() - 1, "000");
  EXPECT_THAT([&] { parse_dump(text, "a.evcd", {}); },
              testing::ThrowsMessage<PatternFileError>(HasSubstr("9000000000000 cycles, expected at most")));
  EXPECT_THROW(parse_dump(text, "a.evcd", {0, 0, 40, 50, 80}), UserError);
  EXPECT_THROW(parse_dump(text, "a.evcd", {100, 0, 40, 50, std::nan("")}), UserError);
}

TEST(PatternFiles, SeededExtendedDumpDefectsAreRefusedWithLineAndReason) {
  const Defect defects[] = {
      {"no timescale", "$timescale\n  1 ps\n$end\n", "", "no $timescale"},
      {"bad timescale", "1 ps", "3 ps", "$timescale 3ps"},
      {"a bus", "$var port 1 <2", "$var port 4 <2", "a width of 4"},
      {"signal twice", "<3 d[1]", "<3 d[0]", "signal \"d[0]\" again"},
      {"code twice", "<3 d[1]", "<2 d[1]", "code <2 again"},
      {"a wire among ports", "$var port 1 <3", "$var wire 1 <3", "$var wire"},
      {"short variable", "$var port 1 <5 q[1] $end", "$var port 1 <5 $end", "$var with 3 words"},
      {"header left open", "$enddefinitions $end", "", "found"},
      {"undefined code", "pU 0 6 <1", "pU 0 6 <9", "code <9"},
      {"unknown state", "pU 0 6 <1", "pK 0 6 <1", "state K"},
      {"an output's state on an input", "pU 0 6 <1", "pH 0 6 <1", "state H of \"rst_n\""},
      {"bad strength", "pU 0 6 <1", "pU 0 9 <1", "strength \"9\""},
      {"time that goes back", "#140000", "#40000", "doesn't go back"},
      {"bad time", "#140000", "#14x", "time #14x"},
      {"input at another time", "#400000", "#410000", "a change of"},
      {"pulse at another time", "#150000", "#155000", "a change of \"clk\" 55000 ps"},
      {"plain change", "pU 0 6 <1", "1<1", "\"1<1\""},
      {"unknown command", "#140000", "$dumpon\n#140000", "\"$dumpon\""},
      {"cut", "#1000000\n", "#990000\n", "an end at 990000 ps"},
  };
  for (const Defect& defect : defects)
    expect_refused(
        evcd_text(small_stream()), defect, "bad.evcd",
        [](const std::string& text, const std::string& name) { return parse_dump(text, name, {}); });
}

// Two ports became one pin: a tester drove or compared the wrong one.
TEST(PatternFiles, PinsOfATesterHaveNamesOfTheirOwn) {
  CycleStream stream = small_stream();
  stream.signals[2].name = "a[0]";
  stream.signals[3].name = "a_0";
  const std::string& last = stream.signals[3].name;
  EXPECT_THAT(avc_text(stream),
              testing::StartsWith("# a_0_2 is the port " + last + "\nFORMAT clk rst_n a_0 a_0_2 "));
  EXPECT_THAT(atp_text(stream),
              testing::StartsWith("// a_0_2 is the port " + last +
                                  "\nimport tset tp0;\n\nvector ($tset, clk, rst_n, a_0, a_0_2, "));
}

// An escaped name has a backslash in a dump.
TEST(PatternFiles, EscapedNamesOfADumpAreThosePorts) {
  std::string text = vcd_text(small_stream());
  const std::string name = " d[0] $end";
  text.replace(text.find(name), name.size(), " \\d[0] $end");
  EXPECT_TRUE(
      same_cycles(parse_dump(text, "a.vcd", small_stream().timing, small_directions()), small_stream()));
}

// What a test bench dumps beside the ports: counters, vectors, reals, and the ports once more in a scope
// below.
TEST(PatternFiles, OtherVariablesOfADumpArePassedOver) {
  std::string text = vcd_text(small_stream());
  const auto put = [&](const std::string& before, const std::string& what) {
    text.insert(text.find(before), what);
  };
  put("$enddefinitions",
      "$var integer 32 ~ k $end\n$var real 64 ~r level $end\n$var reg 8 ~b other [7:0] $end\n"
      "$scope module dut $end\n$var wire 1 # d[0] $end\n$var wire 1 # inner $end\n$var reg 1 ~q state "
      "$end\n$upscope $end\n");
  put("#140000\n", "b101 ~\nr1.5 ~r\nbx ~b\n1~q\n");
  EXPECT_TRUE(
      same_cycles(parse_dump(text, "a.vcd", small_stream().timing, small_directions()), small_stream()));
  const auto refused = [&](const std::string& declaration, const std::string& message) {
    std::string bad = vcd_text(small_stream());
    bad.insert(bad.find("$enddefinitions"), declaration);
    EXPECT_THAT([&] { parse_dump(bad, "a.vcd", small_stream().timing, small_directions()); },
                testing::ThrowsMessage<PatternFileError>(HasSubstr(message)));
  };
  refused("$var wire 2 ~ d [1:0] $end\n",
          "found \"d\" with a width of 2, expected one variable for each bit of a port");
  refused("$var wire 1 ~ d[0] $end\n", "where scopes have signals of one name, dump one scope alone");
}

TEST(PatternFiles, SeededDumpDefectsAreRefusedWithLineAndReason) {
  const Defect defects[] = {
      {"missing port", "$var wire 1 # d[0] $end\n", "", "found"},
      {"bad value", "#140000\n", "#140000\n2!\n", "\"2!\""},
      {"undefined code", "#140000\n", "#140000\n1~\n", "code ~"},
      {"undriven input", "0#\n", "x#\n", "no value of \"d[0]\""},
      {"change before the first time", "#0\n", "", "a change before the first time"},
      {"clock left high", "#180000\n0!\n", "", "\"clk\""},
  };
  for (const Defect& defect : defects)
    expect_refused(vcd_text(small_stream()), defect, "bad.vcd",
                   [](const std::string& text, const std::string& name) {
                     return parse_dump(text, name, {}, small_directions());
                   });
}

}  // namespace
}  // namespace meltstage::dft
