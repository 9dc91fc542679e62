// SPDX-License-Identifier: Apache-2.0
// The other forms of a cycle stream: for testers, simulators, viewers.
#pragma once

#include <string>

#include "asic/dft/core/cycles.hpp"
#include "asic/dft/scan/scan_test.hpp"

namespace meltstage::dft {

/// WGL with one timeplate and flat vectors.
std::string wgl_text(const CycleStream& stream);
/// WGL with scan cells, chains and states; a scan row a load. States stand in the order of the chain's cells.
std::string wgl_text(const ScanTest& test);
/// Extended VCD ($dumpports, IEEE 1364-2005 clause 18): D and U on inputs, L H X on outputs, at their edges
/// within the cycle.
std::string evcd_text(const CycleStream& stream);
/// Four-state VCD of the driven and expected values, one variable a signal.
std::string vcd_text(const CycleStream& stream);
/// Teradyne J750 .atp: repeat counts up to 65,535.
std::string atp_text(const CycleStream& stream);
/// Advantest 93K .avc: FORMAT line, R lines.
std::string avc_text(const CycleStream& stream);
/// Two bits a signal and a cycle for $readmemb: value, and clock pulse or compared.
std::string mem_text(const CycleStream& stream);

}  // namespace meltstage::dft
