// SPDX-License-Identifier: Apache-2.0
#include "base/sha256.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace meltstage {
namespace {

// FIPS 180-4, the example of one block.
constexpr const char* kOfAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

TEST(Sha256, IsThatOfTheStandardWholeAndInPieces) {
  EXPECT_EQ(sha256("abc"), kOfAbc);
  Sha256 hash;
  hash.update("a");
  hash.update("");
  hash.update("bc");
  EXPECT_EQ(hash.finish(), kOfAbc);
}

TEST(Sha256, IsFinishedOnce) {
  Sha256 hash;
  hash.update("abc");
  EXPECT_EQ(hash.finish(), kOfAbc);
  EXPECT_THROW(hash.finish(), std::logic_error);
  EXPECT_THROW(hash.update("abc"), std::logic_error);
}

}  // namespace
}  // namespace meltstage
