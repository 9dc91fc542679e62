// SPDX-License-Identifier: Apache-2.0
// `meltstage chip serve`: its link, its end, its pace, bytes of any kind.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <regex>
#include <thread>
#include <vector>

#include "host/controller.hpp"
#include "tests/host/served_chip.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

void expect_refused(const Ran& ran, const std::string& part) {
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, StartsWith("meltstage"));
  EXPECT_THAT(ran.output, HasSubstr(part));
  EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
}

TEST(Serve, EndsCleanlyOnASignal) {
  for (const int signal : {SIGINT, SIGTERM}) {
    ServedChip chip("");
    const std::string link = chip.port();
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_EQ(chip.stop(signal), 0) << chip.output();
    EXPECT_FALSE(fs::is_symlink(link));
    EXPECT_THAT(chip.output(), HasSubstr("s of the chip at"));
  }
}

TEST(Serve, TakesNobodysFile) {
  ServedChip chip("");
  expect_refused(run_command("chip serve --port " + chip.port()), "found a link to /dev/pts/");
  EXPECT_TRUE(fs::is_symlink(chip.port()));
  const fs::path file = chip.folder() / "thesis";
  std::ofstream(file) << "x";
  expect_refused(run_command("chip serve --port " + file.string()), "expected a name that is free");
  EXPECT_EQ(fs::file_size(file), 1u);
  expect_refused(run_command("chip serve --port " + (chip.folder() / "absent" / "tc").string()),
                 "cannot be made");
}

// A server that was killed leaves its link behind; the next one takes the name.
TEST(Serve, ReplacesAStaleLink) {
  const TemporaryFolder folder;
  const fs::path link = folder.path() / "stale";
  fs::create_symlink("/dev/pts/99999", link);
  const Ran ran = run_command("chip serve --port " + link.string() + " & sleep 1; readlink " + link.string() +
                              "; kill -INT $!; wait $!");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, ::testing::ContainsRegex("/dev/pts/[0-9]"));
  EXPECT_FALSE(fs::is_symlink(link));
}

TEST(Serve, WrongUseIsOneLine) {
  const TemporaryFolder folder;
  const std::string port = "chip serve --port " + (folder.path() / "tc").string();
  expect_refused(run_command(port + " --speed fast"),
                 "--speed: found \"fast\", expected 0.001 to 1000000 or max");
  expect_refused(run_command(port + " --speed 0"), "--speed");
  expect_refused(run_command(port + " --plant PH-9"), "--plant: ");
  EXPECT_EQ(run_command(port + " --vcd " + (folder.path() / "no" / "w.vcd").string()).status, 2);
  expect_refused(run_command(port + " --vcd " + (folder.path() / "." / "tc").string()), "the name of --port");
  expect_refused(run_command("chip serve --port ''"), "--port: found nothing");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

// The chip's time never runs ahead of what was asked for; how far it stays behind is the machine's business.
TEST(Serve, IsNotFasterThanAskedFor) {
  for (const double speed : {1.0, 30.0}) {
    const auto begin = std::chrono::steady_clock::now();
    ServedChip chip(fmt::format("--speed {}", speed));
    EXPECT_EQ(run_command("chip watch --for 0.5 --port " + chip.port()).status, 0);
    chip.stop(SIGTERM);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    std::smatch match;
    ASSERT_TRUE(std::regex_search(chip.output(), match, std::regex(R"(\n([0-9.]+) s of the chip)")))
        << chip.output();
    const double chip_s = std::stod(match[1]);
    EXPECT_LE(chip_s, speed * took.count());
    EXPECT_GT(chip_s, 0.0);
  }
}

// A port as a program without a Modbus library uses it.
class RawPort {
 public:
  explicit RawPort(const std::string& name) : file_(open(name.c_str(), O_RDWR | O_NOCTTY)) {}
  ~RawPort() { close(file_); }
  RawPort(const RawPort&) = delete;
  RawPort& operator=(const RawPort&) = delete;
  void send(const std::vector<std::uint8_t>& bytes) const {
    ASSERT_EQ(write(file_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

 private:
  int file_;
};

// Noise, cut frames and frames on each other's heels are no frames; the next good one is answered.
TEST(Serve, SurvivesAnyBytes) {
  ServedChip chip("");
  host::Connection connection;
  connection.device = chip.port();
  connection.timeout_s = 2.0;
  connection.attempts = 5;  // a busy machine may hand the noise over together with the frame behind it
  host::Controller controller(connection);
  std::mt19937 random(3);
  const auto& errors = host::find_register("CRC_ERRORS");
  const double before = controller.read(errors);
  for (int i = 0; i < 10; ++i) {
    std::vector<std::uint8_t> bytes(std::uniform_int_distribution<std::size_t>(4, 300)(random));
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
    RawPort(chip.port()).send(bytes);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the silence that ends it
    EXPECT_EQ(controller.read(host::find_register("SETPOINT")), 0.0);
  }
  EXPECT_GT(controller.read(errors) + controller.read(host::find_register("CHAR_ERRORS")), before);
}

}  // namespace
}  // namespace meltstage
