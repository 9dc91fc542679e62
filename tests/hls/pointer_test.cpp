// SPDX-License-Identifier: Apache-2.0
// `meltstage hls`: pointers and loops of the C++, as the standard library's algorithms use them.
#include "tests/hls/hls_command.hpp"

namespace meltstage {
namespace {

using ::testing::HasSubstr;

// The state: a_q, b_q[4], and the pin x_i, of 8 bits each; c_q of 10 bits with its sign.
TEST_F(Hls, PointersAreComparedSubtractedAndOrdered) {
  for (const char* body : {
           "  const std::uint8_t* found = nullptr;\n"
           "  for (const std::uint8_t& b : s->b_q)\n    if (b == in->x_i) found = &b;\n"
           "  s->a_q = found ? *found : 7;",
           "  const auto* at = std::find(s->b_q, s->b_q + 4, in->x_i);\n"
           "  s->a_q = at == s->b_q + 4 ? 9 : static_cast<std::uint8_t>(at - s->b_q);",
           "  s->a_q = static_cast<std::uint8_t>(std::max_element(s->b_q, s->b_q + 4) - s->b_q);",
           "  static const std::uint32_t kTable[8] = {0, 2, 3, 5, 70, 90, 120, 240};\n"
           "  s->a_q = static_cast<std::uint8_t>(std::upper_bound(kTable, kTable + 8, in->x_i) - kTable);",
           "  unsigned sum = 0;\n  for (const std::uint8_t* p = s->b_q; p < s->b_q + (in->x_i & 3); ++p) sum "
           "+= *p;\n"
           "  s->a_q = static_cast<std::uint8_t>(sum);",
           "  struct Node {\n    std::uint8_t value;\n    const Node* next;\n  };\n"
           "  static const Node last{3, nullptr}, first{2, &last};\n  unsigned sum = 0;\n"
           "  for (const Node* node = &first; node != nullptr; node = node->next) sum += node->value * "
           "in->x_i;\n"
           "  s->a_q = static_cast<std::uint8_t>(sum);",
       }) {
    write_block(body);
    write("block.cpp", "#include <algorithm>\n" + text_of(at("block.cpp")));
    ASSERT_EQ(translate().status, 0) << body << "\n" << translate().output;
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 0) << body << "\n" << ran.output;
  }
}

TEST_F(Hls, MemoryThatAPointerMayNotReachIsABrokenPromise) {
  const std::pair<const char*, const char*> bodies[] = {
      {"  const std::uint8_t* p = nullptr;\n  if (in->x_i & 1) p = &s->b_q[in->x_i & 3];\n  s->a_q = *p;",
       "block.cpp:13: memory is read or written through a pointer that points nowhere"},
      {"  const std::uint8_t* p;\n  if (in->x_i < 14) p = &in->x_i;\n  s->a_q = *p;",
       "memory is read or written through a pointer that points nowhere"},
      {"  std::uint8_t other[4] = {};\n  s->a_q = static_cast<std::uint8_t>((in->x_i & 1 ? other : s->b_q) - "
       "s->b_q);",
       "addresses in different objects are subtracted or ordered"},
      {"  std::uint8_t v[4] = {1, 2, 3, s->a_q};\n  unsigned sum = 0;\n  for (const std::uint8_t* p = v; p < "
       "v + (in->x_i & 7); ++p) sum += "
       "*p;\n"
       "  s->a_q = static_cast<std::uint8_t>(sum);",
       "block.cpp:13: undefined behaviour of C++"},
      // a new object in each round, though a switch passes by its declaration
      {"  std::uint8_t r = 0;\n  for (int i = 0; i < 2; ++i) {\n    switch (i) {\n      std::uint8_t held;\n"
       "      case 0: held = in->x_i; break;\n      case 1: r = held; break;\n    }\n  }\n  s->a_q = r;",
       "held is read before it is written"},
  };
  for (const auto& [body, message] : bodies) expect_broken_promise(body, message);
}

// Their number of rounds depends on flops and pins, and has a bound.
TEST_F(Hls, ALoopEndsWhereNoStateGoesOn) {
  for (const char* body : {
           "  unsigned x = in->x_i, n = 0;\n  while (x != 0) {\n    x &= x - 1;\n    ++n;\n  }\n"
           "  s->a_q = static_cast<std::uint8_t>(n);",
           "  unsigned a = s->a_q & 15u, b = in->x_i & 15u;\n  while (b != 0) {\n    const unsigned rest = a "
           "% b;\n"
           "    a = b;\n    b = rest;\n  }\n  s->a_q = static_cast<std::uint8_t>(a);",
       }) {
    write_block(body);
    ASSERT_EQ(translate().status, 0) << body << "\n" << translate().output;
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 0) << body << "\n" << ran.output;
  }
}

TEST_F(Hls, WhatIsNoCircuitIsCalledByItsName) {
  write_block("  unsigned x = in->x_i;\n  asm(\"inc %0\" : \"+r\"(x));\n  s->a_q = x & 15;");
  expect_refusal("block.cpp:12: found assembler, expected C++");
  write_block("  static int calls = 0;\n  s->a_q = static_cast<std::uint8_t>(++calls);");
  expect_refusal("block.cpp:12: found the global hls_step::calls, expected one that is constant and known");
}

}  // namespace
}  // namespace meltstage
