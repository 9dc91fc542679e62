// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace meltstage::app {

/// Indices, ascending, of at most `limit` samples that draw the same picture: the series is cut into equal
/// runs of samples, and of each run the first and last sample, every channel's lowest and highest value and
/// the first gap (NaN) of each channel are kept (the M4 aggregation of Jugel et al. 2014, several channels at
/// once). All of them when there are no more than `limit`. `channels` have one length.
std::vector<std::size_t> decimate(std::span<const std::vector<double>> channels, std::size_t limit);

}  // namespace meltstage::app
