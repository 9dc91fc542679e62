// SPDX-License-Identifier: Apache-2.0
// `meltstage windows`, `meltstage window` and `print --rtl full` with worker processes.
#include "command.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "recording.hpp"
#include "tb/windows/window_state.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class WindowsCommand : public ::testing::Test {
 protected:
  fs::path work() const { return folder_ / "work"; }
  void plan(std::uint64_t clocks, std::uint64_t window_clocks) const {
    const Ran ran = plan_by_command(work(), clocks, window_clocks);
    ASSERT_EQ(ran.status, 0) << ran.output;
  }
  Ran windows(const std::string& verb, const std::string& more = "") const {
    return run_command(fmt::format("windows {} {} {}", verb, work().string(), more));
  }
  // One line, status 2, no result.
  void expect_refused(const std::string& part) const {
    const Ran ran = windows("run", "-j 2");
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, AllOf(StartsWith("meltstage: "), HasSubstr(part)));
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_EQ(count_results(work()), 0u);
  }
  TemporaryFolder folder_;
};

TEST_F(WindowsCommand, RunGivesAWholeVerdict) {
  plan(2'800'000, 350'000);
  const Ran run = windows("run", "-j 2");
  EXPECT_EQ(run.status, 0) << run.output;
  EXPECT_THAT(run.output, AllOf(HasSubstr("8 of 8 equal, 2800000 of 2800000 clocks"), HasSubstr("no gap"),
                                HasSubstr("2 processes on this machine")));
  const Ran verdict = windows("verdict");
  EXPECT_EQ(verdict.status, 0) << verdict.output;
  EXPECT_THAT(verdict.output, HasSubstr("8 of 8 equal"));
}

TEST_F(WindowsCommand, WrongNumbersAreOneLine) {
  plan(2'000, 1'000);
  const auto refused = [](const std::string& command, const std::string& said) {
    const Ran ran = run_command(command);
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_THAT(ran.output, HasSubstr(said)) << command;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
  };
  const std::string folder = work().string();
  refused("window " + folder + " -1", "found -1, expected a whole number from 0");
  refused("window " + folder + " 2", "found window 2, expected 0 to 1");
  refused("windows run -j -1 " + folder, "found -1, expected a whole number from 1 to 1024");
  refused("windows plan pins.mvec " + folder + "2 --window-clocks -5",
          "found -5, expected a whole number from 1");
  refused("windows plan pins.mvec " + folder + "2 --borders 300,-5",
          "found -5, expected a whole number from 1");
}

TEST_F(WindowsCommand, AGapIsNamedAndOnlyItsWindowRunsAgain) {
  plan(50'000, 10'000);
  ASSERT_EQ(windows("run").status, 0);
  fs::remove(work() / "results" / "000003.json");
  const Ran gap = windows("verdict");
  EXPECT_EQ(gap.status, 1);
  EXPECT_THAT(gap.output,
              AllOf(HasSubstr("window 3: no result"), HasSubstr("cycles 30000 to 39999 not checked"),
                    HasSubstr("NOT a whole check")));
  const Ran again = windows("run");
  EXPECT_EQ(again.status, 0) << again.output;
  EXPECT_THAT(again.output, HasSubstr("4 results were there already"));
}

TEST_F(WindowsCommand, ARepeatedResultIsNamed) {
  plan(30'000, 10'000);
  ASSERT_EQ(windows("run").status, 0);
  fs::copy_file(work() / "results" / "000001.json", work() / "results" / "000007.json");
  const Ran ran = windows("verdict");
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, AllOf(HasSubstr("000007.json: window 1: more than one result"),
                                HasSubstr("30000 of 30000 clocks")));
}

TEST_F(WindowsCommand, ADamagedResultRunsAgain) {
  plan(30'000, 10'000);
  ASSERT_EQ(windows("run").status, 0);
  std::string text = text_of(work() / "results" / "000001.json");
  text.replace(text.find("\"clocks\": 10000"), 15, "\"clocks\": 20000");
  set_text(work() / "results" / "000001.json", text);
  const Ran damaged = windows("verdict");
  EXPECT_EQ(damaged.status, 1);
  EXPECT_THAT(damaged.output, AllOf(HasSubstr("000001.json: damaged"), HasSubstr("window 1: no result")));
  EXPECT_EQ(windows("run").status, 0);
}

TEST_F(WindowsCommand, AKilledWorkersWindowRunsAgain) {
  plan(1'500'000, 750'000);
  Background run("windows run -j 1 " + work().string());
  std::optional<pid_t> worker;
  ASSERT_TRUE(wait_until([&] { return (worker = find_worker(work())).has_value(); }));
  ASSERT_EQ(kill(*worker, SIGKILL), 0);
  const Ran ran = run.wait();
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("2 of 2 equal, 1500000 of 1500000 clocks"),
                                HasSubstr("window 0: worker lost (killed by signal 9), run again")));
}

TEST_F(WindowsCommand, AWorkerThatIsAlwaysLostIsGivenUpAndNamed) {
  plan(1'500'000, 1'500'000);
  Background run("windows run -j 1 --attempts 2 " + work().string());
  for (int i = 0; i < 2; ++i) {
    std::optional<pid_t> worker;
    ASSERT_TRUE(wait_until([&] { return (worker = find_worker(work())).has_value(); }));
    kill(*worker, SIGKILL);
    ASSERT_TRUE(wait_until([&] { return find_worker(work()) != worker; }));
  }
  const Ran ran = run.wait();
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("given up"), HasSubstr("window 0: no result")));
}

TEST_F(WindowsCommand, AnInterruptedRunGoesOnWithWhatIsMissing) {
  plan(1'500'000, 150'000);
  Background run("windows run -j 1 " + work().string());
  ASSERT_TRUE(wait_until([&] { return count_results(work()) >= 2; }));
  ASSERT_EQ(kill(run.pid(), SIGTERM), 0);
  const Ran stopped = run.wait();
  EXPECT_EQ(stopped.status, 1);
  EXPECT_THAT(stopped.output, HasSubstr("interrupted; results so far stay"));
  EXPECT_FALSE(find_worker(work()).has_value());
  const std::size_t there = count_results(work());
  ASSERT_LT(there, 10u);
  const Ran again = windows("run", "-j 2");
  EXPECT_EQ(again.status, 0) << again.output;
  EXPECT_THAT(again.output, HasSubstr(fmt::format("{} results were there already", there)));
}

TEST_F(WindowsCommand, ADifferenceGivesStatusOneAndNamesWindowAndFlop) {
  plan(300'000, 100'000);
  seed_difference(work(), 2, "u_algor.i_q");
  const Ran ran = windows("run", "-j 2");
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, AllOf(HasSubstr("window 1 differs"), HasSubstr("u_algor.i_q")));
  const Ran by_hand = run_command(fmt::format("window {} 1", work().string()));
  EXPECT_EQ(by_hand.status, 1);
  EXPECT_THAT(by_hand.output, HasSubstr("u_algor.i_q"));
}

TEST_F(WindowsCommand, DamagedFilesAreRefusedInOneLine) {
  for (const char* name :
       {"states/000001.state", "states/000003.state", "stimulus/000002.mvec", "plan.json"}) {
    plan(30'000, 10'000);
    const fs::path path = work() / name;
    std::string text = text_of(path);
    const std::size_t digit = text.find_first_of("0123456789", text.size() / 2);
    text[digit] = text[digit] == '1' ? '2' : '1';
    set_text(path, text);
    expect_refused(path.filename().string());
  }
}

TEST_F(WindowsCommand, APlanReplacesNothingOfSomebodyElse) {
  fs::create_directory(work());
  set_text(work() / "plan.json", "{\"my\": \"plan\"}");
  Ran ran = plan_by_command(work(), 30'000, 10'000);
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("work: exists and is no window plan"));
  EXPECT_EQ(text_of(work() / "plan.json"), "{\"my\": \"plan\"}");
  fs::remove(work() / "plan.json");
  plan(30'000, 10'000);  // an empty folder is filled, a plan replaced
  plan(30'000, 15'000);
  set_text(work() / "notes.txt", "mine");
  ran = plan_by_command(work(), 30'000, 10'000);
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("notes.txt: is no part of a window plan"));
  EXPECT_EQ(text_of(work() / "notes.txt"), "mine");
}

TEST_F(WindowsCommand, MissingFilesAreRefusedInOneLine) {
  plan(30'000, 10'000);
  fs::remove(work() / "states/000002.state");
  expect_refused("000002.state: no such file");
  fs::remove(work() / "plan.json");
  expect_refused("no window plan there");
}

TEST_F(WindowsCommand, APlanOfAnotherBuildOrSpecIsNamed) {
  plan(30'000, 10'000);
  const auto good = nlohmann::ordered_json::parse(text_of(work() / "plan.json"));
  const auto with = [&](const char* key, const char* value) {
    auto plan = good;
    plan["content"][key] = value;
    plan["sha256"] = sha256(plan["content"].dump());
    set_text(work() / "plan.json", plan.dump(1));
  };
  with("build", "0123");
  expect_refused("another build");
  with("spec", "version 0x0000 crc 0x0000");
  expect_refused("another spec");
}

TEST_F(WindowsCommand, AWindowBeyondThePlanIsRefused) {
  plan(30'000, 10'000);
  const Ran ran = run_command(fmt::format("window {} 3", work().string()));
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("found window 3, expected 0 to 2"));
}

// ---- print --rtl full ----

class PrintFull : public WindowsCommand {
 protected:
  // Stopped by its button after 0.1 s, so that there are few clocks.
  void SetUp() override {
    std::ofstream(folder_ / "bumps.csv") << "x_mm,y_mm\n10,10\n12,10\n";
    std::ofstream(folder_ / "job.toml")
        << "[coordinates]\nfile = \"bumps.csv\"\n[head]\nplant = \"E3D-like\"\nsensor = \"MAX31865\"\n"
           "[temperature]\nperiod_ms = 20\n"
           "[[event]]\nat_s = 0.12\nwhat = \"emergency-stop\"\n";
  }
  std::string arguments(const std::string& more) const {
    return fmt::format("print {} --out {} --rtl full --window-clocks 500000 {}",
                       (folder_ / "job.toml").string(), out().string(), more);
  }
  fs::path out() const { return folder_ / "out"; }
};

TEST_F(PrintFull, ChecksTheWholeJobAndSaysSoInItsSummary) {
  const Ran ran = run_command(arguments("-j 2"));
  EXPECT_EQ(ran.status, 1) << ran.output;  // the emergency stop
  EXPECT_THAT(ran.output, AllOf(HasSubstr("Inhibit"), HasSubstr("no gap")));
  const auto summary = nlohmann::json::parse(text_of(out() / "summary.json"));
  const auto& check = summary.at("windows");
  EXPECT_TRUE(check.at("whole").get<bool>());
  EXPECT_EQ(check.at("clocks"), check.at("cycles"));
  EXPECT_GT(check.at("cycles").get<std::uint64_t>(), 1'500'000u);
  EXPECT_EQ(check.at("windows"), check.at("list").size());
  EXPECT_EQ(check.at("equal"), check.at("windows"));
  EXPECT_TRUE(check.at("faults").empty());
  for (std::size_t i = 1; i < check.at("list").size(); ++i)
    EXPECT_EQ(check.at("list")[i].at("start_state"), check.at("list")[i - 1].at("end_state"));
  EXPECT_EQ(summary.at("lockstep")[0].at("clocks"), check.at("clocks"));
  EXPECT_THAT(text_of(out() / "report.html"), HasSubstr("window_strip"));
  EXPECT_FALSE(fs::exists(out().string() + ".windows"));
}

TEST_F(PrintFull, GoesOnAfterAnInterrupt) {
  Background run(arguments("-j 1"));
  const fs::path windows = out().string() + ".windows";
  ASSERT_TRUE(wait_until([&] { return count_results(windows) >= 1; }));
  ASSERT_EQ(kill(run.pid(), SIGINT), 0);
  const Ran stopped = run.wait();
  EXPECT_EQ(stopped.status, 1);
  EXPECT_THAT(stopped.output, AllOf(HasSubstr("nothing written"), HasSubstr("goes on from there")));
  EXPECT_FALSE(fs::exists(out()));
  EXPECT_THAT(run_command(arguments("-j 2")).output,
              AllOf(HasSubstr("results were there already"), HasSubstr("no gap")));
}

TEST_F(PrintFull, KeepsANamedWorkFolder) {
  const Ran ran = run_command(arguments("-j 2 --work " + work().string()));
  EXPECT_THAT(ran.output, HasSubstr("no gap"));
  EXPECT_EQ(windows("verdict").status, 0);
}

TEST_F(PrintFull, ADifferenceIsInVerdictAndPage) {
  ASSERT_THAT(run_command(arguments("-j 2 --work " + work().string())).output, HasSubstr("no gap"));
  // The results of the same plan stay, so a differing one does too.
  const fs::path path = work() / "results" / "000002.json";
  auto result = nlohmann::ordered_json::parse(text_of(path));
  result["content"]["equal"] = false;
  result["content"]["report"] = "MISMATCH\n  flop u_algor.i_q dut=0x1 model=0x0\n";
  result["sha256"] = sha256(result["content"].dump());
  set_text(path, result.dump());
  const Ran ran = run_command(arguments("-j 2 --work " + work().string()));
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, AllOf(HasSubstr("window 2 differs"), HasSubstr("u_algor.i_q")));
  const auto summary = nlohmann::json::parse(text_of(out() / "summary.json"));
  EXPECT_FALSE(summary.at("good").get<bool>());
  EXPECT_THAT(summary.at("verdict").get<std::string>(), HasSubstr("window 2 differs"));
  EXPECT_EQ(summary.at("windows").at("list")[2].at("verdict"), "differs");
}

}  // namespace
}  // namespace meltstage::tb
