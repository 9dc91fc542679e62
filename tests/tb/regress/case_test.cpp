// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "base/error.hpp"
#include "tb/regress/failing_case.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage::tb {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Case, KeepsFlopsAndPinsInItsFile) {
  const ScratchFolder folder;
  FailingCase failing;
  failing.origin = "random.17";
  failing.state.guard.pv_q = -5;
  failing.state.mem.active_q[3] ^= 1u;
  failing.state.mem.refresh_params();
  failing.inputs = {{}, {.uart_rx = 0, .addr_strap = 5}};
  failing.differs = {"heater_o", "u_guard.heater_q", "u_mem.active_q[3]", "u_uartc.u_rx.state_q"};
  write_case(folder.at("case.json"), failing);
  const FailingCase read = read_case(folder.at("case.json"));
  EXPECT_EQ(read.origin, "random.17");
  EXPECT_EQ(read.state.guard.pv_q, -5);
  EXPECT_EQ(read.state.mem.active_q, failing.state.mem.active_q);
  ASSERT_EQ(read.inputs.size(), 2u);
  EXPECT_EQ(read.inputs[1].addr_strap, 5);
  EXPECT_EQ(read.inputs[1].uart_rx, 0);
  EXPECT_EQ(read.differs, failing.differs);
  EXPECT_THAT(describe(read), HasSubstr("2 clocks from a state that differs from reset in 2 flops"));
}

TEST(Case, OfASoundChipIsEqual) {
  FailingCase sound;
  sound.inputs.resize(100);
  EXPECT_TRUE(replay(sound, *make_verilated_rtl()).differs.empty());
}

TEST(Case, MistakesOfItsFileAreNamed) {
  const ScratchFolder folder;
  const auto refused = [&](const std::string& content, const std::string& said) {
    const auto path = folder.write("case.json", content);
    EXPECT_THAT([&] { read_case(path); }, ThrowsMessage<UserError>(HasSubstr(said))) << content;
  };
  const auto with = [](const std::string& rest) { return "{\"format\": \"meltstage-case\", " + rest + "}"; };
  refused("", "not a case");
  refused("[]", "not a case");
  refused(std::string(100'000, '['), "not a case");
  refused("{\"format\": 3}", "not a case");
  refused(with("\"clocks\": []"), "found 0 clocks, expected 1 to 1000000");
  refused(with("\"clocks\": [3]"), "found 3, expected a list of objects");
  refused(with("\"clocks\": [{\"heater_o\": 1}]"), "found heater_o, expected the name of an input pin");
  refused(with("\"clocks\": [{\"addr_strap_i\": 8}]"), "found 8, expected 0 to 7");
  refused(with("\"clocks\": [{}], \"flops\": {\"guard.nothing\": 1}"),
          "found guard.nothing, expected the name of a flop");
  refused(with("\"clocks\": [{}], \"flops\": {\"guard.run_q\": 2}"), "found 2, expected 0 to 1");
  refused(with("\"clocks\": [{}], \"flops\": {\"guard.run_q\": -1}"), "found -1, expected 0 to 1");
  refused(with("\"clocks\": [{}], \"flops\": [1]"), "expected an object");
  refused(with("\"clocks\": [{}], \"flop\": {}"),
          "flop: found a key that no case has, expected one of: format,");
  refused(with("\"clocks\": [{}], \"origin\": 3"), "origin: found 3, expected a text");
  refused(with("\"clocks\": [{}], \"differs\": \"heater_o\""),
          "differs: found \"heater_o\", expected a list");
  refused(with("\"clocks\": [{}], \"differs\": [1]"), "differs: found 1, expected a text");
  refused(with("\"clocks\": [{}], \"differs\": [\"heater_i\"]"),
          "differs: found heater_i, expected the name of a flop such as u_guard.fault_q");
  refused(with("\"clocks\": [{}], \"flops\": {\"guard.run_q\": 1, \"guard.run_q\": 0}"),
          "guard.run_q: found this key twice in one object, expected once");
}

}  // namespace
}  // namespace meltstage::tb
