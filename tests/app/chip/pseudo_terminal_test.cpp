// SPDX-License-Identifier: Apache-2.0
#include "app/chip/pseudo_terminal.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numeric>

#include "base/error.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

class PseudoTerminalTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "meltstage_pty.XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string link() const { return (folder_ / "tc").string(); }
  int open_link() const { return open(link().c_str(), O_RDWR | O_NOCTTY); }
  static bool readable(int file) {
    pollfd state{.fd = file, .events = POLLIN, .revents = 0};
    return poll(&state, 1, 0) > 0 && (state.revents & POLLIN) != 0;
  }

  fs::path folder_;
};

TEST_F(PseudoTerminalTest, EveryByteValuePassesBothWays) {
  PseudoTerminal terminal(link());
  const int port = open_link();
  Bytes all(256);
  std::iota(all.begin(), all.end(), std::uint8_t{0});
  ASSERT_EQ(write(port, all.data(), all.size()), 256);
  ASSERT_TRUE(terminal.wait(10000));
  EXPECT_EQ(terminal.read(), all);
  terminal.write(all);
  Bytes back;
  while (back.size() < all.size()) {
    Bytes part(256);
    part.resize(static_cast<std::size_t>(read(port, part.data(), part.size())));
    back.insert(back.end(), part.begin(), part.end());
  }
  EXPECT_EQ(back, all);
  EXPECT_FALSE(terminal.wait(0)) << "an echo";
  close(port);
}

TEST_F(PseudoTerminalTest, BytesOfAProgramThatHasGoneStillCome) {
  PseudoTerminal terminal(link());
  const int port = open_link();
  ASSERT_EQ(write(port, "abc", 3), 3);
  close(port);
  while (!terminal.wait(1)) {
  }
  EXPECT_EQ(terminal.read(), (Bytes{'a', 'b', 'c'}));
  EXPECT_TRUE(terminal.read().empty());
}

TEST_F(PseudoTerminalTest, WhatNobodyReadsIsLost) {
  PseudoTerminal terminal(link());
  terminal.write(Bytes{1, 2, 3});  // nobody has it open
  int port = open_link();
  EXPECT_FALSE(readable(port));
  terminal.wait(1);
  terminal.write(Bytes{4, 5, 6});  // not read before it is closed
  while (!readable(port)) {
  }
  close(port);
  terminal.wait(1);
  port = open_link();
  EXPECT_FALSE(readable(port));
  close(port);
}

TEST_F(PseudoTerminalTest, AProgramThatReadsNothingStopsNothing) {
  PseudoTerminal terminal(link());
  const int port = open_link();
  for (int i = 0; i < 1000; ++i) terminal.write(Bytes(1000, 0x55));
  EXPECT_FALSE(terminal.wait(0));
  close(port);
}

TEST_F(PseudoTerminalTest, ItsLinkGoesWithItAndNobodyElses) {
  { PseudoTerminal terminal(link()); }
  EXPECT_FALSE(fs::is_symlink(link()));
  {
    PseudoTerminal terminal(link());
    fs::remove(link());
    fs::create_symlink("/dev/null", link());  // somebody else's by now
  }
  EXPECT_TRUE(fs::is_symlink(link()));
  EXPECT_THROW(PseudoTerminal{link()}, UserError);
}

TEST_F(PseudoTerminalTest, ALinkThatAKilledServerLeftIsReplaced) {
  fs::create_symlink("/dev/pts/99999", link());  // the pseudo-terminal has gone
  {
    const PseudoTerminal terminal(link());
    EXPECT_EQ(fs::read_symlink(link()), terminal.device());
  }
  EXPECT_FALSE(fs::is_symlink(link()));
}

// Another program's port, nobody's, a device: a link to it may be anybody's.
TEST_F(PseudoTerminalTest, ALinkOfSomebodyElseIsLeftAlone) {
  const int other = posix_openpt(O_RDWR | O_NOCTTY);
  for (const std::string& device :
       {std::string(ptsname(other)), std::string("/dev/pts/ptmx"), std::string("/dev/pts/gone"),
        std::string("/dev/pts/99999/.."), std::string("/dev/ttyUSB99"), std::string("../pts/99999")}) {
    fs::create_symlink(device, link());
    EXPECT_THROW(PseudoTerminal{link()}, UserError) << device;
    EXPECT_EQ(fs::read_symlink(link()), device);
    fs::remove(link());
  }
  close(other);
}

TEST_F(PseudoTerminalTest, ALinkThatIsServedIsLeftAlone) {
  const PseudoTerminal terminal(link());
  EXPECT_THROW(PseudoTerminal{link()}, UserError);
  EXPECT_THROW(PseudoTerminal{folder_ / "." / "tc"}, UserError);
  EXPECT_EQ(fs::read_symlink(link()), terminal.device());
}

TEST_F(PseudoTerminalTest, AFileOfThatNameIsLeftAlone) {
  std::ofstream(link()) << "mine";
  EXPECT_THROW(PseudoTerminal{link()}, UserError);
  EXPECT_TRUE(fs::is_regular_file(link()));
}

}  // namespace
}  // namespace meltstage::app
