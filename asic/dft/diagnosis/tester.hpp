// SPDX-License-Identifier: Apache-2.0
// A virtual tester: a stream played on a chip with defects, cycle by cycle, and what fails written down.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/cycles.hpp"
#include "asic/dft/diagnosis/defect.hpp"
#include "asic/dft/diagnosis/fail_log.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

/// Whether a port that clocks flops drives the line. Such have no defects here.
bool is_clock(const CaptureView& view, const Line& line);
/// The lines that may have a defect: sites but those of clocks.
std::vector<Line> data_lines(const CaptureView& view);

/// The chip on the tester. What the flops hold at power-up and what the stream leaves open is drawn from
/// `seed`.
struct TestedChip {
  std::vector<ChipDefect> defects;
  std::uint64_t seed = 1;
};

/// Plays the whole stream. `view` is the capture view of the netlist with nothing held; a netlist without
/// flops is tested cycle by cycle. The state goes on from load to load as on a chip: between two rises of
/// `scan_enable` 512 stretches run side by side, each again until it begins as the one before it ends.
/// Delays are none but those of slow lines: one cycle. Throws UserError as replay() does, for a bridge
/// that swings, and for a defect of a clock.
FailLog test_chip(const CaptureView& view, const CycleStream& stream, const std::string& scan_enable,
                  const TestedChip& chip, const Progress& progress = {});

/// Several chips, at most 512, side by side: the same logs as one after another.
std::vector<FailLog> test_chips(const CaptureView& view, const CycleStream& stream,
                                const std::string& scan_enable, const std::vector<TestedChip>& chips,
                                const Progress& progress = {});

/// What a tester keeps that has room for so many failed strobes.
FailLog kept_in_memory(FailLog log, std::size_t room);

}  // namespace meltstage::dft
