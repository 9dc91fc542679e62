// SPDX-License-Identifier: Apache-2.0
// `meltstage chip watch`: CSV in a pipe, a chart in a terminal.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <sstream>
#include <vector>

#include "tests/host/served_chip.hpp"

namespace meltstage {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) all.push_back(line);
  return all;
}

TEST(Watch, PrintsCsvInAPipe) {
  ServedChip chip("--speed 10");
  const Ran ran = run_command("chip watch --period 0.05 --for 1 --timeout 10 --port " + chip.port());
  EXPECT_EQ(ran.status, 0) << ran.output;
  const auto rows = lines(ran.output);
  ASSERT_GE(rows.size(), 3u);
  EXPECT_EQ(rows[0], "time_s,temperature_degc,setpoint_degc,duty_percent,state,run,at_temperature,faults");
  for (const std::string& row : rows) EXPECT_EQ(std::count(row.begin(), row.end(), ','), 7) << row;
  EXPECT_THAT(rows.back(), HasSubstr(",25."));  // the room's temperature
}

// A last poll at the end asked for, however long the period is.
TEST(Watch, ItsEndDoesNotWaitForAPeriod) {
  ServedChip chip("");
  const auto begin = std::chrono::steady_clock::now();
  const Ran ran = run_command("chip watch --period 600 --for 0.5 --timeout 10 --port " + chip.port());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(300));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_EQ(lines(ran.output).size(), 3u) << ran.output;
}

TEST(Watch, AFaultIsToldWithWhatToDo) {
  ServedChip chip("--speed 10");
  ASSERT_EQ(run_command("chip set T_MAX=20 --timeout 10 --port " + chip.port()).status, 0);
  const Ran ran = run_command("chip watch --period 0.05 --for 1 --timeout 10 --port " + chip.port());
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(lines(ran.output).back(), StartsWith("OverTemp: "));
  EXPECT_THAT(lines(ran.output).back(), HasSubstr("degC. Limit: T_MAX 20 degC. Next: Check"));
  chip.stop(SIGTERM);  // the server has told it too, once
  EXPECT_THAT(chip.output(),
              ContainsRegex("s: OverTemp: .* Measured: PV 25[0-9.]* degC\\. Limit: T_MAX 20 degC\\."));
  EXPECT_EQ(chip.output().find("OverTemp: "), chip.output().rfind("OverTemp: "));
}

TEST(Watch, LostChipIsOneLine) {
  ServedChip chip("");
  const Ran ran = run_command(fmt::format("chip watch --address 3 --timeout 0.05 --port {}", chip.port()));
  EXPECT_THAT(ran.output, StartsWith("meltstage: "));
  EXPECT_EQ(ran.status, 1);
  EXPECT_EQ(lines(ran.output).size(), 1u);
  EXPECT_THAT(ran.output, HasSubstr("no answer from address 3"));
}

// The screen of a program in a terminal of its own, as bytes.
class InTerminal {
 public:
  explicit InTerminal(const std::string& command) {
    winsize size{.ws_row = 24, .ws_col = 80, .ws_xpixel = 0, .ws_ypixel = 0};
    process_ = forkpty(&terminal_, nullptr, nullptr, &size);
    if (process_ == 0) {
      setenv("TERM", "xterm", 1);
      setenv("LC_ALL", "C.UTF-8", 1);
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
  }
  ~InTerminal() { close(terminal_); }
  InTerminal(const InTerminal&) = delete;
  InTerminal& operator=(const InTerminal&) = delete;

  // Reads until `part` has come; false when the program ends without.
  bool wait_for(const std::string& part) {
    std::array<char, 4096> buffer;
    while (screen_.find(part) == std::string::npos) {
      const ssize_t n = read(terminal_, buffer.data(), buffer.size());
      if (n <= 0) return false;
      screen_.append(buffer.data(), static_cast<std::size_t>(n));
    }
    return true;
  }
  void type(const std::string& keys) const { ASSERT_EQ(write(terminal_, keys.data(), keys.size()), 1); }
  int end() {
    wait_for("\x01");  // never comes: reads to the end
    int status = 0;
    waitpid(process_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  const std::string& screen() const { return screen_; }

 private:
  int terminal_ = -1;
  pid_t process_ = -1;
  std::string screen_;
};

TEST(Watch, DrawsAChartInATerminal) {
  ServedChip chip("--speed 10");
  InTerminal terminal(
      fmt::format("exec {} chip watch --period 0.05 --timeout 10 --port {}", MELTSTAGE_COMMAND, chip.port()));
  EXPECT_TRUE(terminal.wait_for("set-point")) << terminal.screen();
  EXPECT_TRUE(terminal.wait_for("duty %")) << terminal.screen();
  EXPECT_TRUE(terminal.wait_for("\xE2\xA0") || terminal.wait_for("\xE2\xA1")) << "no Braille dots";
  terminal.type("q");
  EXPECT_EQ(terminal.end(), 0) << terminal.screen();
}

TEST(Watch, InATerminalALostChipIsOneLine) {
  ServedChip chip("");
  InTerminal terminal(
      fmt::format("exec {} chip watch --address 3 --timeout 0.05 --port {}", MELTSTAGE_COMMAND, chip.port()));
  EXPECT_EQ(terminal.end(), 1);
  EXPECT_THAT(terminal.screen(), StartsWith("meltstage: "));
}

}  // namespace
}  // namespace meltstage
