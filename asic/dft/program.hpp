// SPDX-License-Identifier: Apache-2.0
// From faults to what a tester is given, in one call: scan, tests, statistics, files.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/cycles.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/faults.hpp"
#include "asic/dft/scan/masks.hpp"
#include "asic/dft/scan/scan.hpp"
#include "asic/dft/scan/scan_test.hpp"

namespace meltstage::dft {

/// What tests are generated for.
struct TestSubject {
  Circuit circuit;
  ScanDesign design;  ///< empty for a netlist without flops
  CaptureView view;   ///< likewise
  bool is_scanned = false;
};

/// Reads a netlist of Yosys' write_json and puts scan into it, or one without flops, or a .bench, as it is.
/// Throws UserError.
TestSubject test_subject(const std::filesystem::path& netlist, const CellLibrary& library,
                         const ScanOptions& scan);

enum class FaultModel { stuck_at, transition };

struct ProgramOptions {
  FaultModel model = FaultModel::stuck_at;
  ScanOptions scan;
  GenerateOptions generation;
};

struct TestProgram {
  FaultModel model = FaultModel::stuck_at;
  TestSubject subject;
  TestSet set;
  std::vector<FaultClass> reported;  ///< by fault
  Coverage coverage;
  Grade graded;
  ScanTest scan;       ///< of a scanned netlist
  CycleStream stream;  ///< the same in cycles, or that of a netlist without flops
  std::vector<MaskedStrobes> masked;
};

/// Tests for every fault of the netlist, graded. The result depends on netlist, library and options alone.
/// Throws UserError, also for transition faults of a netlist without flops.
TestProgram make_test_program(const std::filesystem::path& netlist, const CellLibrary& library,
                              const ProgramOptions& options);

/// Writes patterns.stil, .wgl, .avc and .atp, masks.txt and faults.txt, and of a scanned netlist
/// netlist.json, netlist.v and cells.v. Returns the SHA-256 of each by name. Throws UserError.
std::map<std::string, std::string> write_test_program(const TestProgram& program, const CellLibrary& library,
                                                      const std::filesystem::path& folder);

/// One line a fault: class, first pattern that detects it, name.
std::string fault_report(const FaultList& list, const std::vector<FaultClass>& reported, const Grade& graded,
                         const std::function<std::string(std::size_t)>& name);

}  // namespace meltstage::dft
