// SPDX-License-Identifier: Apache-2.0
// What the tests of this room share: a small known recording, random ones, and a folder of their own.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "recording/stream.hpp"

namespace meltstage::recording {

/// A folder that lives as long as the test.
class Folder {
 public:
  Folder()
      : path_(std::filesystem::path(::testing::TempDir()) /
              (fmt::format("meltstage_recording_{}", ::getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directory(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { std::filesystem::remove_all(path_); }

  std::filesystem::path operator/(std::string_view name) const { return path_ / name; }
  bool empty() const { return std::filesystem::is_empty(path_); }

 private:
  std::filesystem::path path_;
};

inline std::string load(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void save(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

inline Header small_header() {
  return {{{"rst_n", Direction::in, 1, "chip"},
           {"duty", Direction::out, 12, "chip"},
           {"step_x", Direction::out, 1, "stage"}},
          16e6,
          "unit test",
          {{"seed", "42"}}};
}

inline Stream small_stream() {
  Stream stream;
  stream.begin(small_header());
  for (const Change& change : {Change{0, 0, 0}, {0, 1, 0}, {0, 2, 0}, {5, 0, 1}, {9, 1, 0xabc}, {9, 2, 1}}) {
    stream.change(change);
  }
  stream.end(20);
  return stream;
}

/// Pin values of every cycle: the slow and plain form of a recording.
struct Table {
  Header header;
  std::uint64_t first_cycle = 0;
  std::vector<std::vector<std::uint64_t>> rows;
};

inline Table random_table() {
  Table table;
  const auto pins = *rc::gen::inRange<std::size_t>(1, 70);
  for (std::size_t i = 0; i < pins; ++i) {
    const auto direction = *rc::gen::element(Direction::in, Direction::out, Direction::inout);
    const auto width = *rc::gen::element(1U, 1U, 1U, 2U, 12U, 63U, 64U);
    table.header.pins.push_back(
        {fmt::format("p{}", i), direction, width, *rc::gen::element<std::string>("chip", "stage")});
  }
  table.header.clock_hz = *rc::gen::element(16e6, 48e6, 1.0 / 3.0 * 1e7, 1e10);
  table.header.origin = *rc::gen::nonEmpty(rc::gen::container<std::string>(rc::gen::arbitrary<char>()));
  table.header.meta["value"] = *rc::gen::container<std::string>(rc::gen::arbitrary<char>());
  table.first_cycle = *rc::gen::element<std::uint64_t>(0, 1, 1000, std::uint64_t{1} << 40);
  const auto rows = *rc::gen::inRange<std::size_t>(1, 40);
  std::vector<std::uint64_t> row(pins);
  for (std::size_t i = 0; i < rows; ++i) {
    const auto touched = *rc::gen::inRange<std::size_t>(0, 4);
    for (std::size_t t = 0; t < touched; ++t) {
      const auto pin = *rc::gen::inRange<std::size_t>(0, pins);
      row[pin] = *rc::gen::arbitrary<std::uint64_t>() & max_value(table.header.pins[pin].width);
    }
    table.rows.push_back(row);
  }
  return table;
}

inline void record(const Table& table, Sink& sink) {
  Recorder recorder(sink, table.header);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    // Last pin first: the recorder sorts.
    for (std::size_t pin = table.rows[i].size(); pin-- > 0;)
      recorder.set(static_cast<std::uint32_t>(pin), table.rows[i][pin]);
    recorder.commit(table.first_cycle + i);
  }
  recorder.finish(table.first_cycle + table.rows.size() - 1);
}

inline Stream record(const Table& table) {
  Stream stream;
  record(table, stream);
  return stream;
}

}  // namespace meltstage::recording
