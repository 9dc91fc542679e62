// SPDX-License-Identifier: Apache-2.0
#include "tb/jobs/process.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

namespace meltstage::tb {
namespace {

// As a shell leaves it behind `trap '' CHLD`: the kernel then keeps no child's status.
class IgnoredChildren : public ::testing::Test {
 protected:
  void SetUp() override { std::signal(SIGCHLD, SIG_IGN); }
  void TearDown() override { std::signal(SIGCHLD, SIG_DFL); }
};

TEST_F(IgnoredChildren, FailingCommandsFail) {
  EXPECT_EQ(run_command({"false"}).status, 1);
  EXPECT_EQ(run_command({"true"}).status, 0);
}

TEST_F(IgnoredChildren, EndedChildrenHaveEnded) {
  Child child({"false"});
  std::optional<int> status;
  for (int i = 0; i < 500 && !(status = child.poll()); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_TRUE(status.has_value());
  EXPECT_EQ(describe_end(*status), "exit status 1");
}

}  // namespace
}  // namespace meltstage::tb
