// SPDX-License-Identifier: Apache-2.0
// A cycle stream, as read back from a file, run on the netlist: what the outputs are against what the stream
// compares.
#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/cycles.hpp"
#include "asic/dft/core/faults.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

/// Ways to fill what is unknown: all 0, all 1, and ten times drawn values.
inline constexpr std::size_t kFills = 12;

struct ReplayResult {
  std::size_t cycles = 0;
  std::size_t strobes = 0;                    ///< comparisons with H or L
  std::size_t mismatches = 0;                 ///< strobes that fail; in replay(), with one fill at least
  std::string first;                          ///< "cycle 12 (pattern 3): so[0]: found 0, expected H"
  std::array<std::size_t, kFills> by_fill{};  ///< of replay(): strobes that fail with each fill
};

/// A defect put into the netlist for the replay.
struct ReplayFault {
  std::optional<Fault> line;              ///< stuck line of view.circuit
  std::optional<std::size_t> dead_clock;  ///< flop whose clock pin is stuck
};

/// Runs the stream without delays. `view` is the capture view of the netlist with nothing held. With
/// `scan_enable` named, the stream is cut where that signal rises, and the pieces run side by side: each
/// begins with a whole load, so that nothing is carried over. What is unknown, the state at the beginning of
/// each piece and every input in every cycle in which the stream leaves it open, is filled in kFills ways,
/// the drawn ones from `seed`; a strobe that hangs on it fails. Throws UserError when the stream names other
/// ports than the netlist has, its timing has another order, or a clock is none (require_clocks).
ReplayResult replay(const CaptureView& view, const CycleStream& stream, const std::string& scan_enable = "",
                    std::uint64_t seed = 1, const ReplayFault& fault = {}, const Progress& progress = {});

/// Throws UserError when the stream leaves a clock open or high, or pulses a port that clocks no flop: what
/// flops see then isn't what a run without times does.
void require_clocks(const CaptureView& view, const CycleStream& stream);

/// Names signals and chain ends as the ports of a laid out netlist, which has one for each bit: a[3] becomes
/// a_3 where the netlist has no a[3] but an a_3.
void name_as_ports(CycleStream& stream, const Netlist& netlist);

/// Verilog of the library's cells that the netlist uses: behaviour alone, no delays.
std::string cell_models(const Netlist& netlist, const CellLibrary& library);
/// Delays for a run in Icarus: Verilog of the cells with specify blocks, and the SDF file of the netlist's
/// instances. Both empty: none.
struct IcarusDelays {
  std::filesystem::path cells, sdf;
};

/// How long Icarus may take. One that takes longer is killed, with all that it has started.
struct IcarusLimits {
  std::chrono::milliseconds compile{600'000};
  std::chrono::milliseconds silence{300'000};  ///< without another hundred cycles, or the end
};

/// Self-checking bench: reads `vectors.txt` (one line a cycle), prints "N cycles, N strobes, M mismatches",
/// and on the way a thousand times "done N", at least every hundred cycles. Delays are annotated from `sdf`
/// where one is named. Throws UserError when a port of the netlist has no signal.
std::string icarus_bench(const Netlist& netlist, const CycleStream& stream,
                         const std::filesystem::path& sdf = {});
/// Lines of vectors.txt.
std::string icarus_vectors(const CycleStream& stream);
/// Runs the stream on the netlist in Icarus (four-state), in the existing folder `work`. Throws UserError
/// when Icarus can't be run, takes too long, or complains about the delays.
ReplayResult replay_in_icarus(const Netlist& netlist, const CellLibrary& library, const CycleStream& stream,
                              const std::filesystem::path& work, const IcarusDelays& delays = {},
                              const Progress& progress = {}, const IcarusLimits& limits = {});

/// Runs a stream on the first module of a Verilog file, whose ports have the names of the stream's signals,
/// as icebox_vlog reads a bitstream back. Four-state; no scan. Throws UserError when the file has no module,
/// its ports are others, or Icarus can't be run, takes too long, or ends before the vectors do.
ReplayResult replay_verilog_in_icarus(const std::filesystem::path& verilog, const CycleStream& stream,
                                      const std::filesystem::path& work, const Progress& progress = {},
                                      const IcarusLimits& limits = {});

}  // namespace meltstage::dft
