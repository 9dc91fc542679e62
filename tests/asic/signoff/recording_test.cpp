// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "asic/dft/files/stil.hpp"
#include "asic/signoff/functional_vectors.hpp"
#include "asic/signoff/vectors_files.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"
#include "cmodel/chip.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/windows/window_plan.hpp"

namespace meltstage::app {
namespace {

// One clock more: the pins as they stand before it.
void record_clock(recording::Recorder& recorder, chip::Chip& chip, const chip::Inputs& in,
                  std::uint64_t cycle, std::uint64_t turned = 0) {
  auto levels = tb::pin_levels(in, chip.outputs(in));
  levels[tb::kPinHeater] ^= turned;
  for (std::uint32_t pin = 0; pin < tb::kChipPinCount; ++pin) recorder.set(pin, levels[pin]);
  recorder.commit(cycle);
  chip.step(in);
}

// The chip's model out of reset with its lines idle; an output is turned over in one cycle when `wrong` names
// it.
recording::Stream recorded(std::uint64_t clocks, std::uint64_t wrong = ~std::uint64_t{0}) {
  recording::Stream stream;
  recording::Recorder recorder(stream, tb::chip_pin_header("test"));
  chip::Chip chip;
  for (std::uint64_t cycle = 0; cycle < clocks; ++cycle) {
    chip::Inputs in;
    in.uart_rx = true;
    in.addr_strap = 5;
    in.rst_n = cycle >= 20;
    record_clock(recorder, chip, in, cycle, cycle == wrong ? 1 : 0);
  }
  recorder.finish(clocks - 1);
  return stream;
}

TEST(Recording, ModelAndRtlGiveWhatWasRecorded) {
  const recording::Stream stream = recorded(30'000);
  for (const ReplayDevice device : {ReplayDevice::model, ReplayDevice::rtl}) {
    const PinReplay replay = replay_pins(stream, device);
    EXPECT_EQ(replay.clocks, 30'000u);
    EXPECT_EQ(replay.strobes, 300'000u);
    EXPECT_EQ(replay.mismatches, 0u) << replay.first;
  }
}

TEST(Recording, OneWrongStrobeIsFound) {
  for (const ReplayDevice device : {ReplayDevice::model, ReplayDevice::rtl}) {
    const PinReplay replay = replay_pins(recorded(2'000, 1'234), device);
    EXPECT_EQ(replay.mismatches, 1u);
    EXPECT_EQ(replay.first, "cycle 1234: heater_o recorded 1, chip 0");
  }
}

TEST(Recording, OtherPinsAreRefused) {
  recording::Stream stream;
  recording::Recorder recorder(
      stream,
      {.pins = {{"a", recording::Direction::in, 1, "chip"}}, .clock_hz = 1e6, .origin = "test", .meta = {}});
  recorder.commit(0);
  recorder.finish(3);
  EXPECT_THROW(replay_pins(stream, ReplayDevice::model), UserError);
}

// The recording under another header: pins in the other order, one of somebody else among them, then
// `change`.
recording::Stream under_another_header(const recording::Stream& from,
                                       const std::function<void(recording::Header&)>& change) {
  recording::Header header = from.header();
  std::reverse(header.pins.begin(), header.pins.end());
  header.pins.insert(header.pins.begin() + 2, {"lamp", recording::Direction::out, 1, "stage"});
  change(header);
  recording::Stream stream;
  stream.begin(header);
  const auto renamed = [&](std::uint32_t pin) {
    const auto turned = static_cast<std::uint32_t>(from.header().pins.size() - 1 - pin);
    return turned < 2 ? turned : turned + 1;
  };
  recording::ChangeReader reader(from);
  std::vector<recording::Change> first{{0, 2, 0}}, others;
  for (recording::Change c; reader.next(c);)
    (c.cycle == 0 ? first : others).push_back({c.cycle, renamed(c.pin), c.value});
  std::sort(first.begin(), first.end(), [](const auto& a, const auto& b) { return a.pin < b.pin; });
  std::stable_sort(others.begin(), others.end(), [](const auto& a, const auto& b) {
    return std::pair(a.cycle, a.pin) < std::pair(b.cycle, b.pin);
  });
  for (const recording::Change& c : first) stream.change(c);
  for (const recording::Change& c : others) stream.change(c);
  stream.end(from.final_cycle());
  return stream;
}

TEST(Recording, AScanTestIsRefused) {
  for (const char* pin : {"scan_en_i", "scan_o"}) {
    const recording::Stream stream =
        under_another_header(recorded(300), [&](recording::Header& header) { header.pins[2].name = pin; });
    recording::Stream scanned;
    scanned.begin(stream.header());
    recording::ChangeReader reader(stream);
    for (recording::Change c; reader.next(c);) {
      if (c.cycle > 6) break;
      scanned.change(c);
    }
    scanned.change({7, 2, 1});
    scanned.end(300);
    const auto message =
        ::testing::ThrowsMessage<UserError>(::testing::HasSubstr(std::string("cycle 7: found ") + pin));
    EXPECT_THAT([&] { replay_pins(scanned, ReplayDevice::model); }, message);
    EXPECT_THAT([&] { chip_cycles(scanned); }, message);
  }
}

// What windows take, a replay takes: the chip's pins in any order, others left out.
TEST(Recording, PinsAreKnownByTheirNames) {
  const recording::Stream plain = recorded(3'000),
                          stream = under_another_header(plain, [](recording::Header&) {});
  EXPECT_EQ(replay_pins(stream, ReplayDevice::model).mismatches, 0u);
  EXPECT_TRUE(dft::same_cycles(chip_cycles(stream), chip_cycles(plain)));
  const std::string name = plain.header().pins.back().name, last = "pin " + name + " out of 1 bits";
  const auto refused = [&](const std::function<void(recording::Header&)>& change, const std::string& said) {
    try {
      chip_cycles(under_another_header(plain, change), {}, nullptr, "x.mvec");
      ADD_FAILURE() << said;
    } catch (const UserError& error) {
      EXPECT_EQ(error.what(), "x.mvec: found " + said + "; record it again");
    }
  };
  refused([](auto& header) { header.pins[0].name = "tx"; }, "no " + last + ", expected all pins of the chip");
  refused([](auto& header) { header.pins[0].direction = recording::Direction::in; },
          "pin " + name + " in of 1 bits, expected " + last + ", as the chip has it");
  refused([](auto& header) { header.clock_hz = 20e6; },
          "a clock of 20000000 Hz, expected the chip's 12000000 Hz");
}

// As a tester's cycles, through a STIL file and back: same verdict, masks told, one wrong strobe found.
TEST(Recording, RunsFromItsStilFile) {
  std::vector<MaskedStrobes> masked;
  const dft::CycleStream stream = chip_cycles(recorded(30'000), {{"reset", 0}, {"rest", 1'000}}, &masked);
  ASSERT_EQ(masked.size(), 1u);
  EXPECT_EQ(masked[0].outputs.size(), 10u);
  EXPECT_EQ(cycle_count(stream), 30'000u);
  dft::CycleStream read = dft::parse_stil(dft::flat_stil_text(stream), "recorded.stil");
  EXPECT_TRUE(same_cycles(read, stream));
  for (const ReplayDevice device : {ReplayDevice::model, ReplayDevice::rtl}) {
    const PinReplay replay = replay_cycles_on(read, device);
    EXPECT_EQ(replay.clocks, 30'000u);
    EXPECT_EQ(replay.strobes, 299'990u);
    EXPECT_EQ(replay.mismatches, 0u) << replay.first;
  }
  read = chip_cycles(recorded(2'000, 1'234));
  const PinReplay wrong = replay_cycles_on(read, ReplayDevice::model);
  EXPECT_EQ(wrong.mismatches, 1u);
  EXPECT_EQ(wrong.first, "cycle 1234: heater_o: found 0, expected H");
}

// The set itself: the same bytes each time, and what its file says holds on the model.
TEST(Recording, FunctionalSetIsTheSameEachTime) {
  const FunctionalSet set = functional_set(FunctionalLength::quick),
                      again = functional_set(FunctionalLength::quick);
  EXPECT_TRUE(set.stream == again.stream);
  ASSERT_GE(set.pieces.size(), 20u);
  for (std::size_t i = 1; i < set.pieces.size(); ++i)
    EXPECT_LT(set.pieces[i - 1].first_cycle, set.pieces[i].first_cycle);
  std::vector<MaskedStrobes> masked;
  const dft::CycleStream cycles = chip_cycles(set.stream, set.pieces, &masked);
  std::size_t strobes = 0;
  for (const MaskedStrobes& entry : masked) strobes += entry.outputs.size();
  EXPECT_EQ(std::count_if(cycles.cycles.begin(), cycles.cycles.end(),
                          [](const dft::TestCycle& c) { return !c.label.empty(); }),
            static_cast<std::ptrdiff_t>(set.pieces.size()));
  const PinReplay replay = replay_cycles_on(cycles, ReplayDevice::model);
  EXPECT_EQ(replay.mismatches, 0u) << replay.first;
  EXPECT_EQ(replay.clocks, set.stream.final_cycle() + 1);
  EXPECT_EQ(replay.strobes, 10 * replay.clocks - strobes);
}

// A recording says the same to everything that reads it: outputs before the clock.
TEST(Recording, WindowsTakeTheFunctionalSetAsItIsWritten) {
  namespace fs = std::filesystem;
  std::string name = (fs::temp_directory_path() / "meltstage_plan.XXXXXX").string();
  const fs::path folder = mkdtemp(name.data());
  const FunctionalSet set = board_set();
  tb::WindowPlanner planner(folder / "windows", {"functional", kFunctionalSeed}, {});
  recording::ChangeReader changes(set.stream);
  planner.begin(set.stream.header());
  for (recording::Change change; changes.next(change);) planner.change(change);
  ASSERT_NO_THROW(planner.end(set.stream.final_cycle()));
  EXPECT_EQ(planner.publish().cycles, set.stream.final_cycle() + 1);
  const PinReplay pins = replay_pins(set.stream, ReplayDevice::model);
  EXPECT_EQ(pins.mismatches, 0u) << pins.first;
  const PinReplay cycles = replay_cycles_on(chip_cycles(set.stream, set.pieces), ReplayDevice::model);
  EXPECT_EQ(cycles.mismatches, 0u) << cycles.first;
  fs::remove_all(folder);
}

// The manifest names what the set was made from and for; same inputs same bytes, another netlist another
// manifest.
TEST(Recording, ManifestHoldsTheHashesOfItsSources) {
  namespace fs = std::filesystem;
  std::string name = (fs::temp_directory_path() / "meltstage_set.XXXXXX").string();
  const fs::path folder = mkdtemp(name.data());
  const FunctionalSet set{recorded(3'000), {{"reset", 0}, {"rest", 1'000}}};
  write_whole(folder / "chip.json", "a netlist");
  write_whole(folder / "cells.lib", "a library");
  const FunctionalSources sources{folder / "chip.json", folder / "cells.lib"};
  const FunctionalFolder written = write_functional_set(set, sources, folder / "a");
  EXPECT_EQ(written.clocks, 3'000u);
  EXPECT_EQ(written.masked, 10u);
  write_functional_set(set, sources, folder / "b");
  const auto manifest = [&](const char* of) { return read_file(folder / of / "manifest.json"); };
  EXPECT_EQ(manifest("a"), manifest("b"));
  const auto json = nlohmann::json::parse(manifest("a"));
  EXPECT_EQ(json.at("netlist").at("file"), "chip.json");
  EXPECT_EQ(json.at("netlist").at("sha256"), sha256_of("a netlist"));
  EXPECT_EQ(json.at("library").at("sha256"), sha256_of("a library"));
  EXPECT_EQ(json.at("rtl").get<std::string>().size(), 64u);
  EXPECT_EQ(json.at("seed"), kFunctionalSeed);
  EXPECT_EQ(json.at("masked").at("strobes"), 10);
  ASSERT_EQ(json.at("files").size(), 6u);
  for (const auto& [file, hash] : json.at("files").items()) {
    EXPECT_EQ(hash, sha256_of(read_file(folder / "a" / file))) << file;
    EXPECT_EQ(read_file(folder / "a" / file), read_file(folder / "b" / file)) << file;
  }
  EXPECT_NE(read_file(folder / "a/masks.txt").find("cycle 0: "), std::string::npos);

  write_whole(folder / "chip.json", "another netlist");
  write_functional_set(set, sources, folder / "c");
  EXPECT_NE(manifest("c"), manifest("a"));
  const FunctionalSet other{recorded(3'000, 1'234), set.pieces};
  write_functional_set(other, sources, folder / "d");
  EXPECT_NE(manifest("d"), manifest("c"));
  EXPECT_THROW(write_functional_set(set, {folder / "nosuch.json", ""}, folder / "e"), UserError);
  EXPECT_FALSE(fs::exists(folder / "e"));
  write_functional_set(set, {}, folder / "f");
  EXPECT_FALSE(nlohmann::json::parse(manifest("f")).contains("netlist"));
  fs::remove_all(folder);
}

TEST(Recording, AResetInOperationIsMasked) {
  recording::Stream stream;
  recording::Recorder recorder(stream, tb::chip_pin_header("test"));
  chip::Chip chip;
  for (std::uint64_t cycle = 0; cycle < 3'000; ++cycle) {
    chip::Inputs in;
    in.rst_n = cycle >= 20 && cycle != 2'000;
    in.inhibit = cycle >= 2'500;
    record_clock(recorder, chip, in, cycle);
  }
  recorder.finish(2'999);
  std::vector<MaskedStrobes> masked;
  const dft::CycleStream cycles = chip_cycles(stream, {}, &masked);
  ASSERT_EQ(masked.size(), 3u);
  EXPECT_EQ(masked[1].cycle, 2'000u);
  EXPECT_EQ(masked[1].outputs.size(), 10u);
  EXPECT_EQ(masked[2].outputs, std::vector<std::string>{"heater_o"});
  for (const ReplayDevice device : {ReplayDevice::model, ReplayDevice::rtl})
    EXPECT_EQ(replay_cycles_on(cycles, device).mismatches, 0u);
}

}  // namespace
}  // namespace meltstage::app
