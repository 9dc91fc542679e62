// SPDX-License-Identifier: Apache-2.0
// replay CLOCKS [SEED [RECORDING]]: the harness of the RTL and the netlist read back from the bitstream, the
// same random bits into both, the bit that comes out compared on every clock. Exits with 1 on a mismatch.
// RECORDING becomes the RTL's pins as extended VCD (IEEE 1364-2005 clause 18), in a tester's cycle of 100 ns:
// inputs change at 0, the clock is high from 50 to 80.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "Vbitstream.h"
#include "Vharness.h"

namespace {

constexpr std::array<const char*, 5> kPins = {"clk_i", "rst_ni", "serial_i", "latch_i", "serial_o"};

class Recording {
 public:
  explicit Recording(const std::string& path)
      : path_(path), file_(path.empty() ? nullptr : std::fopen((path + ".part").c_str(), "w")) {
    if (path.empty()) return;
    if (file_ == nullptr) {
      std::fprintf(stderr, "replay: %s: can't be written, expected a place for a new file\n", path.c_str());
      std::exit(2);
    }
    std::fprintf(file_, "$version\n  replay\n$end\n$timescale\n  1 ns\n$end\n$scope module harness $end\n");
    for (std::size_t pin = 0; pin < kPins.size(); ++pin)
      std::fprintf(file_, "$var port 1 <%zu %s $end\n", pin, kPins[pin]);
    std::fprintf(file_, "$upscope $end\n$enddefinitions $end\n");
  }
  void take(long ns, const Vharness& top, bool clock) {
    const std::array<int, 5> now = {clock, top.rst_ni, top.serial_i, top.latch_i, top.serial_o};
    if (file_ == nullptr || now == shown_) return;
    std::fprintf(file_, "#%ld\n", ns);
    for (std::size_t pin = 0; pin < now.size(); ++pin) {
      if (now[pin] == shown_[pin]) continue;
      const bool high = now[pin] != 0;
      std::fprintf(file_, "p%c %d %d <%zu\n", pin == 4 ? "LH"[high] : "DU"[high], high ? 0 : 6, high ? 6 : 0,
                   pin);
    }
    shown_ = now;
  }
  bool finish(long ns) {
    if (file_ == nullptr) return true;
    std::fprintf(file_, "#%ld\n", ns);
    const bool good = std::fclose(file_) == 0 && std::rename((path_ + ".part").c_str(), path_.c_str()) == 0;
    if (!good) std::fprintf(stderr, "replay: %s: can't be written, expected free space\n", path_.c_str());
    return good;
  }

 private:
  std::string path_;
  std::FILE* file_;
  std::array<int, 5> shown_ = {-1, -1, -1, -1, -1};
};

}  // namespace

int main(int argc, char** argv) {
  const long clocks = argc > 1 ? std::atol(argv[1]) : 100'000;
  std::mt19937_64 random(argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
  Recording recording(argc > 3 ? argv[3] : "");
  Vharness rtl;
  Vbitstream netlist;
  long mismatches = 0;
  long moved = 0;
  bool last = false;
  const auto step = [&](auto& top, bool reset_n, bool serial, bool latch, const auto& before_clock) {
    top.rst_ni = reset_n;
    top.serial_i = serial;
    top.latch_i = latch;
    top.clk_i = 0;
    top.eval();
    before_clock();
    top.clk_i = 1;
    top.eval();
  };
  for (long clock = 0; clock < clocks; ++clock) {
    const bool reset_n = clock >= 4;
    const bool serial = random() & 1;
    const bool latch = random() % 48 == 0;
    step(rtl, reset_n, serial, latch, [&] { recording.take(100 * clock, rtl, false); });
    recording.take(100 * clock + 50, rtl, true);
    recording.take(100 * clock + 80, rtl, false);
    step(netlist, reset_n, serial, latch, [] {});
    if (reset_n && rtl.serial_o != netlist.serial_o && ++mismatches <= 3)
      std::printf("clock %ld: the bit that comes out differs\n", clock);
    moved += rtl.serial_o != last;
    last = rtl.serial_o;
  }
  std::printf("%ld clocks, %ld mismatches; the output moved %ld times\n", clocks, mismatches, moved);
  if (!recording.finish(100 * clocks)) return 2;
  return mismatches == 0 && moved > clocks / 1000 ? 0 : 1;
}
