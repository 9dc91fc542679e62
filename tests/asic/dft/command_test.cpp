// SPDX-License-Identifier: Apache-2.0
// `meltstage dft` as a user meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>

#include "asic/dft/files/formats.hpp"
#include "asic/dft/files/stil.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;

class VectorsCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("meltstage_recording_command." + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  static std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  Ran generate(const std::string& netlist, const std::string& more) const {
    return run_command("dft generate " + netlist + " --out " + (folder_ / "out").string() + " " + more);
  }
  Ran replay() const {
    return run_command("dft replay " + (folder_ / "out/patterns.stil").string() + " --netlist " +
                       (folder_ / "out/netlist.json").string());
  }
  fs::path folder_;
};

constexpr const char* kMachine = CIRCUITS "/machine_gates.json";

TEST_F(VectorsCommand, TellsItsProgressOnATerminal) {
  const std::string command =
      "dft generate " + std::string(kMachine) + " --out " + (folder_ / "out").string();
  const Ran seen = run_in_terminal(command);
  EXPECT_EQ(seen.status, 0) << seen.output;
  for (const char* step : {"quick search, 12 backtracks  ", "merging  ", "dropping  0 %", "grading  0 %"})
    EXPECT_NE(seen.output.find(step), std::string::npos) << step << " in " << seen.output;
  EXPECT_EQ(run_command(command).output.find("grading"), std::string::npos);
}

// Half a set that a full disk left is no stranger's to the next run.
TEST_F(VectorsCommand, ASetThatCouldNotBeWrittenIsWrittenAgain) {
  const std::string command =
      command_line("dft generate " + std::string(kMachine) + " --out " + (folder_ / "out").string());
  const Ran full = run_shell("ulimit -f 2; " + command);
  EXPECT_EQ(full.status, 2) << full.output;
  EXPECT_NE(full.output.find("cannot write: found \"File too large\""), std::string::npos) << full.output;
  EXPECT_EQ(run_shell(command).status, 0);
}

// Of two runs at once the files were mixed.
TEST_F(VectorsCommand, AFolderIsWrittenByOneRunAtATime) {
  const std::string out = (folder_ / "out").string();
  fs::create_directories(out);
  const Ran ran =
      run_shell("flock " + out + " " + command_line("dft scan " + std::string(kMachine) + " --out " + out));
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_NE(ran.output.find("found another process at work in it"), std::string::npos) << ran.output;
}

TEST_F(VectorsCommand, FilesThatNothingReadsAreRefused) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const std::string netlist = (folder_ / "out/netlist.json").string();
  const std::string replayed =
      "dft replay " + (folder_ / "out/patterns.stil").string() + " --netlist " + netlist;
  const auto refused = [&](const std::string& more, const std::string& words) {
    const Ran ran = run_command(replayed + more);
    EXPECT_EQ(ran.status, 2) << more << ran.output;
    EXPECT_NE(ran.output.find(words), std::string::npos) << more << ran.output;
  };
  refused(" --cells " + netlist + " --sdf " + netlist, "--cells: found a file without --on icarus and --sdf");
  refused(" --on icarus --cells " + netlist, "--cells: found a file without --on icarus and --sdf");
  refused(" --readback " + netlist, "--readback: found a file without --on fpga");
  refused(" --report ''", "--report: found nothing, expected a value");
}

// e is open: with 1 there, y shows nothing of the flop.
TEST_F(VectorsCommand, AFaultThatOneLevelOfAnOpenInputHidesIsNotDetected) {
  const std::string netlist = (folder_ / "or.json").string();
  std::ofstream(folder_ / "or.v")
      << "module orr(input clk_i, input d, input e, output y, output q2); reg q;\n"
         "always @(posedge clk_i) q <= d; assign y = q | e; assign q2 = q; endmodule\n";
  ASSERT_EQ(run_shell("yosys -q -p 'read_verilog " + (folder_ / "or.v").string() +
                      "; synth -flatten -top orr; dfflegalize -cell $_DFF_P_ x; write_json " + netlist + "'")
                .status,
            0);
  const auto grade = [&](const std::string& vectors) {
    std::ofstream(folder_ / "or.stil")
        << "STIL 1.0; Signals { clk_i In; d In; e In; y Out; q2 Out; }\nSignalGroups { pi = 'clk_i+d+e'; po "
           "= 'y+q2'; }\n"
           "Timing { WaveformTable t { Period '100ns'; Waveforms { clk_i { P { '0ns' D; '45ns' U; '55ns' D; "
           "} }\n"
           "clk_i { 01 { '0ns' D/U; } } d { 01 { '0ns' D/U; } } e { 01N { '0ns' D/U/Z; } } po { LHX { '40ns' "
           "L/H/X; } } } } }\n"
           "PatternBurst b { PatList { p; } } PatternExec { PatternBurst b; }\nPattern p { W t; "
        << vectors << " }\n";
    return run_command("dft grade " + netlist + " --patterns " + (folder_ / "or.stil").string() +
                       " --faults 0");
  };
  const Ran open = grade("V { pi=P10; po=XX; } V { pi=01N; po=HX; }");
  EXPECT_EQ(open.status, 0) << open.output;
  EXPECT_THAT(open.output, testing::ContainsRegex("detected +1\n"));
  const Ran fails = grade("V { pi=P00; po=XX; } V { pi=00N; po=LX; }");
  EXPECT_EQ(fails.status, 2) << fails.output;
  EXPECT_THAT(fails.output, testing::HasSubstr("y: found 1, expected L without a fault"));
}

// The file says two clocks a pattern and holds on the netlist; with one expected bit turned it doesn't.
TEST_F(VectorsCommand, TransitionTestsAreWrittenAndHold) {
  const Ran made = generate(kMachine, "--faults transition");
  ASSERT_EQ(made.status, 0) << made.output;
  const auto manifest = nlohmann::json::parse(read(folder_ / "out/manifest.json"));
  EXPECT_EQ(manifest.at("aborted"), 0);
  EXPECT_GT(manifest.at("transition").at("DS"), 200);
  EXPECT_DOUBLE_EQ(manifest.at("transition").at("fault_efficiency"), 1.0);
  EXPECT_NE(read(folder_ / "out/faults.txt").find("slow-to-fall"), std::string::npos);
  const Ran good = replay();
  EXPECT_EQ(good.status, 0) << good.output;
  std::string stil = read(folder_ / "out/patterns.stil");
  std::size_t captures = 0;
  for (std::size_t at = stil.find("Call \"multiclock_capture\""); at != std::string::npos;
       at = stil.find("Call \"multiclock_capture\"", at + 1))
    ++captures;
  EXPECT_EQ(captures, 2 * manifest.at("patterns").get<std::size_t>());
  char& bit = stil[stil.find("\"scan_o[0]\"=", stil.find("\"last unload\"")) + 12];
  bit = bit == 'H' ? 'L' : 'H';
  std::ofstream(folder_ / "out/patterns.stil", std::ios::binary) << stil;
  EXPECT_EQ(replay().status, 1);
}

// The same patterns as STIL, WGL with its chains, and an extended VCD with chains from scan.json or the
// netlist.
TEST_F(VectorsCommand, EveryFormatHitsTheSameFaults) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const fs::path out = folder_ / "out";
  std::ofstream(out / "patterns.evcd") << dft::evcd_text(dft::read_stil(out / "patterns.stil"));
  const auto run = [&](const std::string& command) {
    return run_command("dft " + command + " --report " + (folder_ / "report.txt").string());
  };
  const std::string netlist = (out / "netlist.json").string();
  const auto grade = [&](const std::string& patterns) {
    const Ran ran = run("grade " + netlist + " --patterns " + (out / patterns).string());
    EXPECT_EQ(ran.status, 0) << ran.output;
    return read(folder_ / "report.txt");
  };
  const Ran function =
      run("grade " + netlist + " --patterns " + (out / "patterns.stil").string() + " --faults 9");
  EXPECT_EQ(function.status, 2);
  EXPECT_NE(function.output.find("found scan patterns, expected vectors without scan"), std::string::npos);
  const std::string stil = grade("patterns.stil");
  EXPECT_NE(stil.find("DS "), std::string::npos);
  EXPECT_EQ(grade("patterns.wgl"), stil);
  const std::string traced = "patterns.evcd --chains netlist",
                    listed = "patterns.evcd --chains " + (out / "scan.json").string();
  EXPECT_EQ(grade(traced), stil);
  EXPECT_EQ(grade(listed), stil);
  EXPECT_NE(grade("patterns.evcd"), stil);  // clock by clock

  const auto replays = [&](const std::string& patterns) {
    return run_command("dft replay " + (out / patterns).string() + " --netlist " + netlist).output;
  };
  EXPECT_NE(replays("patterns.stil").find(", 0 mismatches"), std::string::npos);
  EXPECT_EQ(replays("patterns.wgl"), replays("patterns.stil"));
  EXPECT_EQ(replays(traced), replays("patterns.stil"));

  const auto refused = [&](const std::string& patterns, const std::string& reason) {
    const Ran ran = run_command("dft replay " + (out / patterns).string() + " --netlist " + netlist);
    EXPECT_EQ(ran.status, 2);
    EXPECT_NE(ran.output.find(reason), std::string::npos) << ran.output;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
  };
  refused("patterns.stil --chains netlist", "leave it out");
  refused("patterns.evcd --chains " + (out / "manifest.json").string(),
          "found another shape, expected \"chains\"");
  const auto list = [&](const std::string& text) {
    std::ofstream(out / "own.json") << text;
    return "patterns.evcd --chains " + (out / "own.json").string();
  };
  refused(list("{\"chains\": []}"), "own.json: found no chain, expected \"chains\"");
  refused(list("{\"chains\": [}"), "own.json:1:13: found no JSON, expected JSON with \"chains\"");
  refused(list("{\"chains\": [{\"name\": 5}]}"), "own.json: chain 1: found another shape");
  refused(list("{\"chains\": [{\"name\": \"c\", \"in\": \"i\", \"out\": \"o\", \"cells\": [\"" +
               std::string(5000, 'x') + "\"]}]}"),
          "own.json: chain c: found a name of 5000 characters, expected 1 to 4096");
  refused("patterns.evcd --chains nosuch.json", "nosuch.json: no such file");
  std::ofstream(out / "bad.wgl") << "waveforms x\n";
  refused("bad.wgl", "bad.wgl:1:1: found");
}

// Every command that runs a file asks what its edges do: a verdict on another order would be none.
TEST_F(VectorsCommand, ATimingOfAnotherOrderIsRefused) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const fs::path out = folder_ / "out";
  const std::string netlist = (out / "netlist.json").string();
  const auto changed = [&](const std::string& name, const std::string& find, const std::string& put) {
    std::string text = read(out / ("patterns" + fs::path(name).extension().string()));
    std::size_t at = text.find(find);
    EXPECT_NE(at, std::string::npos) << find;
    for (; at != std::string::npos; at = text.find(find, at + put.size())) text.replace(at, find.size(), put);
    std::ofstream(out / name) << text;
    return (out / name).string();
  };
  for (const std::string& file :
       {changed("late.stil", "'40ns'", "'90ns'"),
        changed("high.stil", "'0ns' D; '50ns' U; '80ns' D;", "'0ns' U; '50ns' D; '80ns' U;"),
        changed("exchanged.stil", "'40ns' H;", "'40ns' L;"),
        changed("late.wgl", "40nS:Q, 41nS:X", "85nS:Q, 86nS:X")}) {
    for (const std::string& command :
         {"replay " + file + " --netlist " + netlist, "replay " + file + " --on icarus --netlist " + netlist,
          "grade " + netlist + " --patterns " + file, "lint " + file}) {
      const Ran ran = run_command("dft " + command);
      EXPECT_EQ(ran.status, command.starts_with("lint") ? 1 : 2) << command;
      EXPECT_NE(ran.output.find(file + ":"), std::string::npos) << ran.output;
      EXPECT_NE(ran.output.find(" expected "), std::string::npos) << ran.output;
    }
  }
}

// No clock, and a period that ends before one would come.
TEST_F(VectorsCommand, AFileWithoutAClockRunsInIcarus) {
  std::ofstream(folder_ / "and.json") << R"({"modules":{"m":{"ports":{
    "a":{"direction":"input","bits":[2]},"b":{"direction":"input","bits":[3]},"y":{"direction":"output","bits":[4]}},
    "cells":{"g":{"type":"$_AND_","port_directions":{"A":"input","B":"input","Y":"output"},
    "connections":{"A":[2],"B":[3],"Y":[4]}}},"netnames":{}}}})";
  std::ofstream(folder_ / "and.stil")
      << R"(STIL 1.0; Signals { a In; b In; y Out; } SignalGroups { i = 'a + b'; }
Timing { WaveformTable t { Period '20ns'; Waveforms { i { 01 { '5ns' D/U; } } y { LH { '15ns' L/H; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Pattern main { W t; V { i=11; y=H; } V { i=10; y=L; } })";
  for (const char* on : {"netlist", "icarus"})
    EXPECT_EQ(run_command("dft replay " + (folder_ / "and.stil").string() + " --netlist " +
                          (folder_ / "and.json").string() + " --on " + on)
                  .output,
              "2 cycles, 2 strobes, 0 mismatches\n");
}

// The figures hang on the order of the cells, which no strobe of the good netlist shows.
TEST_F(VectorsCommand, ChainsOfAnotherOrderAreNotGraded) {
  ASSERT_EQ(generate(kMachine, "--chains 2").status, 0);
  const fs::path out = folder_ / "out";
  const std::string netlist = (out / "netlist.json").string(), stil = read(out / "patterns.stil");
  std::ofstream(out / "patterns.evcd") << dft::evcd_text(dft::read_stil(out / "patterns.stil"));
  const auto chains = nlohmann::json::parse(read(out / "scan.json")).at("chains");
  const std::string first = chains[0]["cells"][0], second = chains[0]["cells"][1],
                    other = chains[1]["cells"][0];
  const auto refused = [&](const std::string& patterns, const std::string& said) {
    const Ran ran = run_command("dft grade " + netlist + " --patterns " + (out / patterns).string());
    EXPECT_EQ(ran.status, 2) << said;
    EXPECT_NE(ran.output.find(said), std::string::npos) << ran.output;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
  };
  const auto replaced = [](std::string text, const std::string& find, const std::string& put) {
    EXPECT_NE(text.find(find), std::string::npos) << find;
    return text.replace(text.find(find), find.size(), put);
  };
  const std::string in_order = '"' + first + "\" \"" + second + '"',
                    swapped = '"' + second + "\" \"" + first + '"',
                    said =
                        "found " + second + " as cell 1, expected " + first + ", as " + netlist + " shifts";
  std::ofstream(out / "swapped.stil") << replaced(stil, in_order, swapped);
  refused("swapped.stil", said);
  const std::string wgl = read(out / "patterns.wgl");
  std::ofstream(out / "swapped.wgl") << replaced(wgl, ", \"" + first + "\", \"" + second + "\"",
                                                 ", \"" + second + "\", \"" + first + "\"");
  refused("swapped.wgl", said);
  const auto listed = [&](const std::function<void(nlohmann::json&)>& change) {
    nlohmann::json json = {{"chains", chains}};
    change(json["chains"]);
    std::ofstream(out / "own.json") << json;
    return "patterns.evcd --chains " + (out / "own.json").string();
  };
  refused(listed([](auto& list) { std::swap(list[0]["cells"][0], list[0]["cells"][1]); }), said);
  refused(listed([](auto& list) { list[0]["cells"][1] = list[0]["cells"][0]; }),
          "found " + first + " as cell 2, expected " + second);
  refused(listed([](auto& list) { list[1]["cells"][0] = list[0]["cells"][0]; }),
          "found " + first + " as cell 1, expected " + other);
  refused(listed([](auto& list) { list[1]["cells"].erase(0); }), "as cell 1, expected " + other);
  refused(listed([](auto& list) { list[1]["in"] = list[0]["in"]; }),
          "found the input scan_i[0], expected scan_i[1]");
  refused(listed([](auto& list) { list[1] = list[0]; }), "found cell " + first + " again");
  refused(listed([](auto& list) { list.erase(1); }), "found no chain with flop ");
}

// No strobe shows what the file says of its cells; a replay says that it is so.
TEST_F(VectorsCommand, ChainsOfAnotherOrderAreNotReplayed) {
  ASSERT_EQ(generate(kMachine, "--chains 2").status, 0);
  const fs::path out = folder_ / "out";
  const std::string netlist = (out / "netlist.json").string(), stil = read(out / "patterns.stil");
  const auto chains = nlohmann::json::parse(read(out / "scan.json")).at("chains");
  const std::string first = chains[0]["cells"][0], second = chains[0]["cells"][1],
                    both = '"' + first + "\" \"" + second + '"';
  const auto replay_with = [&](const std::string& put) {
    std::string text = stil;
    EXPECT_NE(text.find(both), std::string::npos);
    text.replace(text.find(both), both.size(), put);
    std::ofstream(out / "own.stil") << text;
    return (out / "own.stil").string();
  };
  for (const char* on : {"netlist", "icarus"}) {
    const auto refused = [&](const std::string& put, const std::string& said) {
      const Ran ran = run_command("dft replay " + replay_with(put) + " --netlist " + netlist + " --on " + on);
      EXPECT_EQ(ran.status, 2) << put;
      EXPECT_NE(ran.output.find(said), std::string::npos) << ran.output;
      EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    };
    refused('"' + second + "\" \"" + first + '"', "found " + second + " as cell 1, expected " + first);
    refused("\"nosuch\" \"" + second + '"', "found nosuch as cell 1, expected " + first);
    refused("! \"" + first + "\" ! \"" + second + '"',
            "found " + first + " inverse to what is shifted in, expected no inversion");
    EXPECT_EQ(run_command("dft replay " + replay_with(both) + " --netlist " + netlist + " --on " + on).status,
              0);
  }
  // chains of which nothing is told but their ports
  std::string text = stil;
  for (std::size_t at = text.find("ScanCells"); at != std::string::npos; at = text.find("ScanCells"))
    text.erase(at, text.find(';', at) + 1 - at);
  std::ofstream(out / "own.stil") << text;
  EXPECT_EQ(run_command("dft replay " + (out / "own.stil").string() + " --netlist " + netlist).status, 0);
}

// Neither a file that somebody put there nor a manifest of something else.
TEST_F(VectorsCommand, AForeignFileIsNotWrittenOver) {
  std::ofstream(folder_ / "redundant.bench")
      << "INPUT(a)\nINPUT(b)\nOUTPUT(y)\nn = AND(a, b)\ny = OR(a, n)\n";
  const std::string bench = (folder_ / "redundant.bench").string();
  const auto refused = [&](const std::string& command, const std::string& name, const std::string& content) {
    const fs::path out = folder_ / "foreign";
    fs::remove_all(out);
    fs::create_directories(out);
    std::ofstream(out / name) << content;
    std::ofstream(out / "notes.txt") << "mine";
    const Ran ran = run_command("dft " + command + " --out " + out.string());
    EXPECT_EQ(ran.status, 2) << command << ' ' << name << ran.output;
    EXPECT_NE(ran.output.find((out / name).string() + ": was not written by an earlier run"),
              std::string::npos)
        << ran.output;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_EQ(read(out / name), content) << command;
    EXPECT_EQ(std::distance(fs::directory_iterator(out), fs::directory_iterator()), 2) << command;
  };
  const std::string machine = kMachine;
  for (const char* name : {"faults.txt", "patterns.stil", "netlist.v", "scan.json"})
    refused("generate " + machine, name, "mine");
  for (const char* json : {"{\"files\": {\"index.html\": \"1\"}}", "{}", "mine"})
    refused("generate " + machine, "manifest.json", json);
  refused("scan " + machine, "netlist.json", "{}");
  refused("functional --quick", "functional.wgl", "mine");
  refused("functional --quick", "masks.txt", "mine");
  refused("prove " + bench, "index.txt", "mine");
  refused("prove " + bench, "class0.cnf", "mine");
  // one's own are, of whichever command, and other files are left alone
  const fs::path out = folder_ / "own";
  fs::create_directories(out);
  std::ofstream(out / "notes.txt") << "mine";
  for (const std::string& command : {"scan " + machine, "generate " + machine, "scan " + machine,
                                     "prove " + bench, "prove " + bench, "generate " + bench})
    EXPECT_EQ(run_command("dft " + command + " --out " + out.string()).status, 0) << command;
  EXPECT_EQ(read(out / "notes.txt"), "mine");
  EXPECT_FALSE(fs::exists(out / "index.txt"));
  std::ofstream(folder_ / "file") << "mine";
  const Ran ran = run_command("dft generate " + machine + " --out " + (folder_ / "file").string());
  EXPECT_EQ(ran.status, 2);
  EXPECT_NE(ran.output.find("found what is no folder"), std::string::npos) << ran.output;
}

// What the files leave open: told where they are made, and by replay from any of them.
TEST_F(VectorsCommand, MasksAreToldWithTheirReasons) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const fs::path out = folder_ / "out", report = folder_ / "report.txt";
  const auto manifest = nlohmann::json::parse(read(out / "manifest.json"));
  const auto& masked = manifest.at("masked");
  EXPECT_GT(masked.at("strobes"), 100);
  std::size_t sum = 0;
  for (const auto& [reason, strobes] : masked.at("reasons").items()) sum += strobes.get<std::size_t>();
  EXPECT_EQ(masked.at("strobes"), sum);
  EXPECT_TRUE(manifest.at("files").contains("masks.txt"));
  const std::string told = read(out / "masks.txt");
  const Ran ran = run_command("dft replay " + (out / "patterns.wgl").string() + " --netlist " +
                              (out / "netlist.json").string() + " --report " + report.string());
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_EQ(read(report), told);
  EXPECT_NE(ran.output.find(std::to_string(sum) + " of "), std::string::npos) << ran.output;
  const Ran unwritable =
      run_command("dft replay " + (out / "patterns.wgl").string() + " --netlist " +
                  (out / "netlist.json").string() + " --report " + (folder_ / "no/such").string());
  EXPECT_EQ(unwritable.status, 2) << unwritable.output;
}

TEST_F(VectorsCommand, ATestersProfileIsReadOrRefused) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const auto lint = [&](const std::string& profile) {
    std::ofstream(folder_ / "tester.toml") << profile;
    return run_command("dft lint " + (folder_ / "out/patterns.stil").string() + " --tester " +
                       (folder_ / "tester.toml").string());
  };
  const std::string limits = "least_period_ns = 10\nedge_resolution_ns = 1\nleast_pulse_ns = 5\npins = 256\n";
  EXPECT_EQ(lint("name = \"bench\"\nvector_memory = 100000\n" + limits).status, 0);
  EXPECT_EQ(lint("vector_memory = 3\n" + limits).status, 1);
  const auto expect_refused = [&](const std::string& profile, const std::string& said) {
    const Ran ran = lint(profile);
    EXPECT_EQ(ran.status, 2) << profile;
    EXPECT_NE(ran.output.find("tester.toml:" + said), std::string::npos) << ran.output;
  };
  expect_refused("vector_memory = \"3\"\n", "1:17: vector_memory: found \"3\", expected a whole number");
  expect_refused("pins = 0\n", "1:8: pins: found 0, expected 1 to");
  expect_refused("\nleast_period_ns = nan\n", "2:19: least_period_ns: found nan, expected");
  expect_refused("edge_resolution_ns = -1\n", "1:22: edge_resolution_ns: found -1, expected");
  expect_refused("least_periods_ns = 3\n", "1:20: least_periods_ns: found an unknown key, expected one of: ");
  expect_refused("", " is empty");
  for (const char* limit :
       {"least_period_ns", "edge_resolution_ns", "least_pulse_ns", "pins", "vector_memory"}) {
    std::string others = "vector_memory = 100000\n" + limits;
    const std::size_t at = others.find(limit);
    others.erase(at, others.find('\n', at) + 1 - at);
    const Ran ran = lint(others);
    EXPECT_EQ(ran.status, 2) << others;
    EXPECT_NE(ran.output.find(std::string(limit) + ": found nothing, expected every limit"),
              std::string::npos)
        << ran.output;
  }
  EXPECT_EQ(
      run_command("dft lint " + (folder_ / "out/patterns.stil").string() + " --tester /dev/zero").status, 2);
}

TEST_F(VectorsCommand, OnFpgaAsksForTheReadback) {
  const fs::path evcd = folder_ / "pins.evcd", readback = folder_ / "readback.v";
  dft::CycleStream stream;
  stream.title = "pins";
  stream.signals = {{"clk_i", true}, {"d[0]", true}, {"q_o", false}};
  stream.cycles = {{"P0X", ""}, {"P1L", ""}, {"P1H", "", 3}, {"P0H", ""}, {"00L", ""}};
  std::ofstream(evcd) << dft::evcd_text(stream);
  const auto verilog = [&](const std::string& ports, const std::string& initial) {
    std::ofstream(readback) << "module bitstream (" << ports
                            << ");\ninput clk_i; input \\d[0] ; output reg q_o;\n"
                            << "initial q_o = " << initial
                            << ";\nalways @(posedge clk_i) q_o <= \\d[0] ;\nendmodule\n";
  };
  const auto run = [&](const std::string& more) {
    return run_command("dft replay " + evcd.string() + " --on fpga" + more);
  };
  const std::string with = " --readback " + readback.string();
  verilog("clk_i, \\d[0] , q_o", "0");
  EXPECT_EQ(run(with).output, "7 cycles, 6 strobes, 0 mismatches\n");
  EXPECT_EQ(run("").status, 2);
  EXPECT_EQ(run(" --readback nosuch.v").status, 2);
  stream.cycles[3].states[2] = 'L';
  std::ofstream(evcd) << dft::evcd_text(stream);
  EXPECT_EQ(run(with).status, 1);
  EXPECT_NE(run(with).output.find("cycle 5: q_o: found 1, expected 0"), std::string::npos)
      << run(with).output;
  std::ofstream(readback)
      << "module bitstream (input clk_i, input en_i, input \\d[0] , output q_o);\nendmodule\n";
  EXPECT_EQ(run(with).status, 2);
  EXPECT_NE(run(with).output.find("found other ports"), std::string::npos) << run(with).output;
}

TEST_F(VectorsCommand, SameInputsSameBytes) {
  ASSERT_EQ(generate(kMachine, "--seed 3").status, 0);
  const std::string first = read(folder_ / "out/manifest.json");  // holds the hashes of all files
  ASSERT_EQ(generate(kMachine, "--seed 3").status, 0);
  EXPECT_EQ(read(folder_ / "out/manifest.json"), first);
  ASSERT_EQ(generate(kMachine, "--seed 4").status, 0);
  EXPECT_NE(read(folder_ / "out/manifest.json"), first);
}

TEST_F(VectorsCommand, NoInputIsOverwritten) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const std::string out = (folder_ / "out").string(), netlist = out + "/netlist.json",
                    stil = out + "/patterns.stil", before = read(netlist), patterns = read(stil);
  for (const std::string& command :
       {"grade " + netlist + " --patterns " + stil + " --report " + netlist,
        "grade " + netlist + " --patterns " + stil + " --report " + stil,
        "replay " + stil + " --netlist " + netlist + " --report " + stil,
        "generate " + netlist + " --out " + out, "scan " + netlist + " --out " + out,
        "prove " + netlist + " --out " + out, "functional --quick --netlist " + netlist + " --out " + out}) {
    const Ran ran = run_command("dft " + command);
    EXPECT_EQ(ran.status, 2) << command << ran.output;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_EQ(read(netlist), before) << command;
    EXPECT_EQ(read(stil), patterns) << command;
  }
}

// Two clocks between load and unload: every fault runs through the file.
TEST_F(VectorsCommand, TransitionPatternsAreGraded) {
  ASSERT_EQ(generate(kMachine, "--faults transition").status, 0);
  const std::string out = (folder_ / "out").string();
  const Ran ran = run_command("dft grade " + out + "/netlist.json --patterns " + out + "/patterns.stil");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_EQ(ran.output.find("DS                              0"), std::string::npos) << ran.output;
}

// A refutation for each, at each run; and not those that an earlier run left.
TEST_F(VectorsCommand, ProofsAreMadeAgain) {
  const std::string proofs = (folder_ / "proofs").string();
  const fs::path bench = folder_ / "redundant.bench";
  std::ofstream(bench) << "INPUT(a)\nINPUT(b)\nOUTPUT(y)\nn = AND(a, b)\ny = OR(a, n)\n";
  const Ran first = run_command("dft prove " + bench.string() + " --out " + proofs);
  EXPECT_EQ(first.status, 0) << first.output;
  EXPECT_EQ(first.output.find("0 classes"), std::string::npos) << first.output;
  EXPECT_EQ(run_command("dft prove " + bench.string() + " --out " + proofs).output, first.output);
}

TEST_F(VectorsCommand, ANetlistWithoutACellIsRefused) {
  const fs::path empty = folder_ / "empty.json";
  std::ofstream(empty) << R"({"modules":{"top":{"ports":{},"cells":{}}}})";
  const Ran ran = run_command("dft rules " + empty.string());
  EXPECT_EQ(ran.status, 2);
  EXPECT_EQ(ran.output, "meltstage: " + empty.string() +
                            ": found a top module without a cell, expected a netlist of cells\n");
}

TEST_F(VectorsCommand, AskedForCellsABenchNetlistIsRefused) {
  const fs::path bench = folder_ / "wire.bench";
  std::ofstream(bench) << "INPUT(a)\nOUTPUT(b)\nb = NOT(a)\n";
  ASSERT_EQ(generate(bench.string(), "").status, 0);
  const std::string stil = (folder_ / "out/patterns.stil").string();
  EXPECT_EQ(run_command("dft replay " + stil + " --netlist " + bench.string()).status, 0);
  for (const std::string& command : {"replay " + stil + " --on icarus --netlist " + bench.string(),
                                     "replay " + stil + " --chains netlist --netlist " + bench.string(),
                                     "rules " + bench.string(), "scan " + bench.string() + " --out x"}) {
    const Ran ran = run_command("dft " + command);
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_EQ(ran.output,
              "meltstage: " + bench.string() + ": found .bench, expected a netlist of Yosys' write_json\n");
  }
}

TEST_F(VectorsCommand, WrongNumbersAndWordsAreOneLine) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const std::string out = (folder_ / "out").string(), netlist = out + "/netlist.json",
                    patterns = out + "/patterns.stil";
  const auto refused = [](const std::string& command, const std::string& said) {
    const Ran ran = run_command("dft " + command);
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_NE(ran.output.find(said), std::string::npos) << ran.output;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
  };
  refused("generate " + netlist + " --faults 0 --out x", "found 0, expected one of: stuck-at, transition");
  refused("generate " + netlist + " --seed -1 --out x", "found -1, expected a whole number from 0");
  refused("grade " + netlist + " --patterns " + patterns + " --faults -1",
          "found -1, expected a whole number");
  refused("grade " + netlist + " --patterns " + patterns + " --faults 0",
          "found scan patterns, expected vectors without scan of a netlist with flops for --faults");
  refused("replay " + patterns + " --netlist " + netlist + " --cycles -5",
          "found -5, expected a whole number");
  refused("replay " + patterns + " --on asic", "found asic, expected one of: netlist, icarus");
}

TEST_F(VectorsCommand, ARunInIcarusTellsItsProgress) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const std::string command = "dft replay " + (folder_ / "out/patterns.stil").string() + " --netlist " +
                              (folder_ / "out/netlist.json").string() + " --on icarus";
  const Ran seen = run_in_terminal(command);
  EXPECT_EQ(seen.status, 0) << seen.output;
  EXPECT_NE(seen.output.find("replay in Icarus  "), std::string::npos) << seen.output;
  const Ran piped = run_command(command);
  EXPECT_EQ(std::count(piped.output.begin(), piped.output.end(), '\n'), 1) << piped.output;
  EXPECT_NE(piped.output.find(" 0 mismatches"), std::string::npos) << piped.output;
}

// Files of an earlier netlist don't pass for this one's; what somebody changed or put there stays.
TEST_F(VectorsCommand, NothingOfAnEarlierRunStays) {
  ASSERT_EQ(generate(kMachine, "").status, 0);
  const fs::path out = folder_ / "out";
  std::ofstream(out / "cells.v", std::ios::app) << "// mine\n";
  std::ofstream(out / "notes.txt") << "mine\n";
  std::ofstream(folder_ / "wire.bench") << "INPUT(a)\nOUTPUT(b)\nb = NOT(a)\n";
  ASSERT_EQ(generate((folder_ / "wire.bench").string(), "").status, 0);
  for (const char* gone : {"netlist.json", "netlist.v", "scan.json"})
    EXPECT_FALSE(fs::exists(out / gone)) << gone;
  for (const char* kept :
       {"cells.v", "notes.txt", "patterns.stil", "masks.txt", "faults.txt", "manifest.json"})
    EXPECT_TRUE(fs::exists(out / kept)) << kept;
}

TEST_F(VectorsCommand, TransitionsAskForFlops) {
  std::ofstream(folder_ / "wire.bench") << "INPUT(a)\nOUTPUT(b)\nb = NOT(a)\n";
  const Ran ran = generate((folder_ / "wire.bench").string(), "--faults transition");
  EXPECT_EQ(ran.status, 2);
  EXPECT_NE(ran.output.find("found no flops"), std::string::npos) << ran.output;
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace meltstage
