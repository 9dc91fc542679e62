// SPDX-License-Identifier: Apache-2.0
// The folder that `meltstage print` writes: what it replaces, and what it leaves alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PrintFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("meltstage_print_folder_" + std::string(info->name()) + "." + std::to_string(getpid()));
    fs::create_directories(folder_);
    write("bumps.csv", "x_mm,y_mm\n10,10\n12,10\n");
    write("job.toml",
          "[coordinates]\nfile = \"bumps.csv\"\n[head]\nplant = \"E3D-like\"\n"
          "[temperature]\nsetpoint_degc = 28.0\ndwell_s = 0.3\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::string read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }
  Ran print_to(const std::string& out) const {
    return run_command("print " + (folder_ / "job.toml").string() + " --rtl none --out " +
                       (folder_ / out).string());
  }
  void expect_printed(const std::string& out) const {
    const Ran ran = print_to(out);
    EXPECT_EQ(ran.status, 0) << out << ": " << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("/report.html\n"));
  }
  // Nothing of a run is left beside its folder.
  void expect_alone(const std::string& name) const {
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string found = entry.path().filename().string();
      EXPECT_TRUE(found == name || !found.starts_with(name)) << found;
    }
  }

  fs::path folder_;
};

TEST_F(PrintFolder, ATrailingSlashOrDotNamesTheSameFolder) {
  for (const char* out : {"new/", "new/", "new/.", "new", "new//", "new/./", "other/."}) expect_printed(out);
  EXPECT_TRUE(fs::exists(folder_ / "new/summary.json"));
  EXPECT_TRUE(fs::exists(folder_ / "other/summary.json"));
  expect_alone("new");
  EXPECT_THAT(print_to("new/").output, HasSubstr("/new/report.html\n"));
}

TEST_F(PrintFolder, AFolderWithoutANameOfItsOwnIsRefused) {
  for (const std::string& out :
       {std::string("."), std::string(".."), std::string("/"), (folder_ / "new/..").string()}) {
    const Ran ran = run_command("print " + (folder_ / "job.toml").string() + " --rtl none --out " + out);
    EXPECT_EQ(ran.status, 2) << out << ": " << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("expected the name of a folder")) << out;
  }
  EXPECT_TRUE(fs::exists(folder_ / "job.toml"));
}

TEST_F(PrintFolder, AnEmptyFolderIsFilled) {
  fs::create_directory(folder_ / "empty");
  expect_printed("empty");
  EXPECT_TRUE(fs::exists(folder_ / "empty/report.html"));
}

TEST_F(PrintFolder, ASummaryOfAnotherProgramIsNotReplaced) {
  for (const char* text : {"{}", "not json", "[2]", R"({"schema": 2, "job": "coverage"})", ""}) {
    fs::create_directory(folder_ / "mine");
    write("mine/summary.json", text);
    const Ran ran = print_to("mine");
    EXPECT_EQ(ran.status, 2) << text << ": " << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("mine/summary.json: was not written by `meltstage print`")) << text;
    EXPECT_EQ(read("mine/summary.json"), text);
    fs::remove_all(folder_ / "mine");
  }
}

TEST_F(PrintFolder, FilesBesideItsOwnAreNotLost) {
  expect_printed("out");
  const std::string before = read("out/summary.json");
  write("out/notes.txt", "mine");
  const Ran ran = print_to("out");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("out/notes.txt: was not written by `meltstage print`"));
  EXPECT_EQ(read("out/notes.txt"), "mine");
  EXPECT_EQ(read("out/summary.json"), before);
  fs::remove(folder_ / "out/notes.txt");
  fs::create_directory(folder_ / "out/pins.vcd");  // a folder of that name is none of its files
  write("out/pins.vcd/thesis.txt", "mine");
  EXPECT_EQ(print_to("out").status, 2);
  EXPECT_EQ(read("out/pins.vcd/thesis.txt"), "mine");
  fs::remove_all(folder_ / "out/pins.vcd");
  expect_printed("out");
  expect_alone("out");
}

}  // namespace
}  // namespace meltstage
