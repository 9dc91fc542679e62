// SPDX-License-Identifier: Apache-2.0
// Throughput of recording, writing, reading and replaying. The load is a chip's pins beside a stage's: an SPI
// clock that toggles every fourth cycle, a PWM, a step pin and a bus, among 32 pins.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "recording/diff.hpp"
#include "recording/stream.hpp"
#include "recording/text.hpp"
#include "recording/vcd.hpp"

namespace meltstage::recording {
namespace {

constexpr std::uint64_t kCycles = 4'000'000;

Header bench_header() {
  Header header{{}, 16e6, "bench_vectors", {}};
  for (int i = 0; i < 31; ++i)
    header.pins.push_back({fmt::format("pin_{}", i), Direction::out, 1, i < 20 ? "chip" : "stage"});
  header.pins.push_back({"duty", Direction::out, 12, "chip"});
  return header;
}

void record(Sink& sink) {
  Recorder recorder(sink, bench_header());
  for (std::uint64_t cycle = 0; cycle < kCycles; ++cycle) {
    recorder.set(3, (cycle >> 2) & 1);
    recorder.set(5, (cycle & 1023) < 300);
    recorder.set(22, (cycle >> 7) & 1);
    recorder.set(31, (cycle >> 6) & 0xfff);
    recorder.commit(cycle);
  }
  recorder.finish(kCycles - 1);
}

const Stream& recorded() {
  static const Stream stream = [] {
    Stream fresh;
    record(fresh);
    return fresh;
  }();
  return stream;
}

/// A file in the system's folder for such, gone with the program.
class ScratchFile {
 public:
  ScratchFile() : path_(std::filesystem::temp_directory_path() / "meltstage_bench_vectors.scratch") {}
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  ~ScratchFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void count(benchmark::State& state) {
  const auto runs = static_cast<double>(state.iterations());
  state.counters["cycles/s"] =
      benchmark::Counter(runs * static_cast<double>(kCycles), benchmark::Counter::kIsRate);
  state.counters["changes/s"] =
      benchmark::Counter(runs * static_cast<double>(recorded().change_count()), benchmark::Counter::kIsRate);
}

void record_to_stream(benchmark::State& state) {
  for (auto _ : state) {
    Stream stream;
    record(stream);
    benchmark::DoNotOptimize(stream.size_bytes());
  }
  count(state);
}
BENCHMARK(record_to_stream)->Unit(benchmark::kMillisecond);

void record_to_text(benchmark::State& state) {
  const ScratchFile file;
  for (auto _ : state) {
    TextWriter writer(file.path());
    record(writer);
  }
  count(state);
}
BENCHMARK(record_to_text)->Unit(benchmark::kMillisecond);

void record_to_vcd(benchmark::State& state) {
  const ScratchFile file;
  for (auto _ : state) {
    VcdWriter writer(file.path());
    record(writer);
  }
  count(state);
}
BENCHMARK(record_to_vcd)->Unit(benchmark::kMillisecond);

void read_text_to_stream(benchmark::State& state) {
  const ScratchFile file;
  write_text(recorded(), file.path());
  for (auto _ : state) benchmark::DoNotOptimize(read_text(file.path()).size_bytes());
  count(state);
}
BENCHMARK(read_text_to_stream)->Unit(benchmark::kMillisecond);

void replay_by_cycle(benchmark::State& state) {
  for (auto _ : state) {
    Cursor cursor(recorded());
    while (cursor.step()) benchmark::DoNotOptimize(cursor.value(3));
  }
  count(state);
}
BENCHMARK(replay_by_cycle)->Unit(benchmark::kMillisecond);

void replay_by_event(benchmark::State& state) {
  for (auto _ : state) {
    Cursor cursor(recorded());
    while (cursor.next_event()) benchmark::DoNotOptimize(cursor.value(3));
  }
  count(state);
}
BENCHMARK(replay_by_event)->Unit(benchmark::kMillisecond);

void diff_equal(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(diff(recorded(), recorded()).same());
  count(state);
}
BENCHMARK(diff_equal)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace meltstage::recording
