// SPDX-License-Identifier: Apache-2.0
// Programs that were copied or installed look for files where they lie themselves, never where they were
// built.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const fs::path kPrograms = MELTSTAGE_BINARY_DIR "/app";

class Copied : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("meltstage_copied." + std::to_string(getpid()));
    fs::create_directories(folder_ / "bin");
    for (const char* program : {"meltstage", "meltstage-bench"})
      fs::copy(kPrograms / program, folder_ / "bin" / program);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Ran run(const std::string& arguments) const {
    return run_shell("cd " + folder_.string() + " && bin/meltstage " + arguments);
  }

  fs::path folder_;
};

TEST_F(Copied, PrintsInAnotherFolder) {
  fs::copy(MELTSTAGE_SOURCE_DIR "/examples", folder_ / "examples", fs::copy_options::recursive);
  const Ran ran = run("print examples/first.toml --rtl none");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_TRUE(fs::exists(folder_ / "out/first/report.html"));
}

TEST_F(Copied, BenchLooksBesideItselfAndWhereItIsInstalled) {
  const Ran nothing = run("bench vectors --quick");
  EXPECT_EQ(nothing.status, 2);
  EXPECT_THAT(nothing.output, HasSubstr((folder_ / "bin/data/netlist.json").string() + ": isn't there"));
  EXPECT_THAT(nothing.output, HasSubstr("chip_netlist"));
  for (const char* place : {"share/meltstage", "bin/data"}) {
    fs::create_directories(folder_ / place);
    std::ofstream(folder_ / place / "netlist.json") << "no netlist";
    EXPECT_THAT(run("bench vectors --quick").output, HasSubstr((folder_ / place / "netlist.json").string()));
  }
}

TEST_F(Copied, BenchOfTheFlowAsksForACheckout) {
  const Ran ran = run("bench silicon --quick");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("asic/flow/Makefile: found in no folder above " + folder_.string()));
  EXPECT_THAT(ran.output, HasSubstr("change into a checkout"));
}

// What is left of the sources' place are names of sources in messages of assertions.
TEST(Programs, HoldNoPathOfTheSourcesButNamesOfSources) {
  for (const char* program :
       {"meltstage", "meltstage-aligned", "meltstage-conformal", "meltstage-dft", "meltstage-bench"}) {
    std::ostringstream bytes;
    bytes << std::ifstream(kPrograms / program, std::ios::binary).rdbuf();
    const std::string text = bytes.str(), root = MELTSTAGE_SOURCE_DIR "/";
    for (std::size_t at = text.find(root); at != std::string::npos; at = text.find(root, at + 1)) {
      std::size_t end = at;
      while (end < text.size() && std::isprint(static_cast<unsigned char>(text[end])) != 0) ++end;
      const std::string found = text.substr(at, end - at), kind = fs::path(found).extension();
      EXPECT_TRUE(kind == ".sv" || kind == ".cpp" || kind == ".hpp") << program << " holds " << found;
    }
  }
}

}  // namespace
}  // namespace meltstage
