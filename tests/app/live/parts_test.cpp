// SPDX-License-Identifier: Apache-2.0
// Bounds that a browser would take long to reach.
#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <vector>

#include "app/live/access.hpp"
#include "app/live/answers.hpp"
#include "app/live/command.hpp"
#include "app/live/feed.hpp"
#include "app/live/reading.hpp"
#include "app/live/samples.hpp"
#include "base/error.hpp"

namespace meltstage::app::live {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

TEST(Feed, DropsWhoIsTooFarBehind) {
  Feed feed;
  const auto slow = feed.listen(""), quick = feed.listen("");
  slow->next(0ms);  // what the stream begins with
  quick->next(0ms);
  for (std::size_t i = 0; i <= Feed::kMostKept; ++i) {
    feed.tell("reading", std::to_string(i));
    const auto heard = quick->next(0ms);
    ASSERT_TRUE(heard);
    ASSERT_THAT(*heard, HasSubstr("data: " + std::to_string(i) + "\n"));
  }
  EXPECT_FALSE(slow->next(0ms));
}

TEST(Feed, SendsAllThatWasMissedAsLongAsItIsKept) {
  Feed feed;
  const auto slow = feed.listen("");
  slow->next(0ms);
  for (std::size_t i = 0; i < Feed::kMostKept; ++i) feed.tell("reading", std::to_string(i));
  const auto heard = slow->next(0ms);
  ASSERT_TRUE(heard);
  EXPECT_THAT(*heard, HasSubstr("data: 0\n"));
  EXPECT_THAT(*heard, HasSubstr("data: " + std::to_string(Feed::kMostKept - 1) + "\n"));
}

TEST(Feed, BoundsItsListenersAndLetsNewOnesInWhenOthersGo) {
  Feed feed;
  std::vector<std::unique_ptr<Feed::Stream>> listeners;
  for (std::size_t i = 0; i < Feed::kMostListeners; ++i) listeners.push_back(feed.listen(""));
  EXPECT_TRUE(listeners.back());
  EXPECT_FALSE(feed.listen(""));
  listeners.pop_back();
  EXPECT_TRUE(feed.listen(""));
}

TEST(Feed, EndsItsStreams) {
  Feed feed;
  const auto listener = feed.listen("");
  listener->next(0ms);
  EXPECT_EQ(listener->next(0ms), ":\n\n");
  feed.close();
  EXPECT_FALSE(listener->next(1h));
  EXPECT_FALSE(feed.listen(""));
}

TEST(Command, HasEachKeyOnce) {
  EXPECT_EQ(parse_command(R"({"id":"1","do":"set","register":"SETPOINT","value":50})").text,
            "set SETPOINT 50 degC");
  EXPECT_THROW(parse_command(R"({"id":"1","do":"stop","do":"run"})"), UserError);
  EXPECT_THROW(parse_command(R"({"id":"1","do":"set","register":"SETPOINT","value":50,"value":60})"),
               UserError);
}

TEST(Answers, KeepTheLastOnes) {
  Answers answers;
  for (std::size_t i = 0; i <= Answers::kMostKept; ++i) {
    answers.put({std::to_string(i), "run", Outcome::waiting, ""});
    answers.put({std::to_string(i), "run", Outcome::done, ""});
  }
  EXPECT_FALSE(answers.find("0"));
  ASSERT_TRUE(answers.find("1"));
  EXPECT_EQ(answers.find("1")->outcome, Outcome::done);
}

TEST(Samples, KeepTheLastOnes) {
  Samples samples;
  for (std::size_t i = 0; i <= Samples::kMostKept; ++i) samples.add({static_cast<double>(i), 25.0, 0.0, 0.0});
  EXPECT_THAT(samples.json(), testing::StartsWith("[[1.000,25.000,0.000,0.000],"));
}

TEST(Address, TellsLoopbackFromOthers) {
  EXPECT_TRUE(parse_address("127.0.0.1:0").loopback);
  EXPECT_TRUE(parse_address("127.9.8.7:65535").loopback);
  EXPECT_TRUE(parse_address("[::1]:80").loopback);
  EXPECT_TRUE(parse_address("localhost:80").loopback);
  EXPECT_FALSE(parse_address("0.0.0.0:80").loopback);
  EXPECT_FALSE(parse_address("[::]:80").loopback);
  EXPECT_FALSE(parse_address("128.0.0.1:80").loopback);
  EXPECT_EQ(authority(parse_address("[::1]:80")), "[::1]:80");
  for (const char* wrong : {"", ":", "80", "127.0.0.1", "127.0.0.1:", "127.0.0.1:-1", "127.0.0.1:65536",
                            "::1:80", "127.1:80", "example.org:80", "[127.0.0.1:80", "127.0.0.1:80 "})
    EXPECT_THROW(parse_address(wrong), UserError) << wrong;
}

TEST(Counter, GoesBackOnlyWhenItBeganAnew) {
  EXPECT_FALSE(went_back(0, 0));
  EXPECT_FALSE(went_back(65'535, 0));
  EXPECT_FALSE(went_back(60'000, 1'000));
  EXPECT_TRUE(went_back(1, 0));
  EXPECT_TRUE(went_back(30'000, 2));
}

}  // namespace
}  // namespace meltstage::app::live
