// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/solver_formats.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "hls/subprocess.hpp"

namespace meltstage::hls {

std::string for_solvers(SolverFormat format, const std::string& verilog, const std::string& module) {
  const TemporaryFolder folder;
  write_whole(folder.file("circuit.sv"), verilog);
  write_whole(
      folder.file("write.ys"),
      fmt::format(
          "read_verilog -sv {}\nhierarchy -check -top {}\nproc\nflatten\nasync2sync\ndffunmap\n{} {}\n",
          folder.file("circuit.sv").string(), module,
          format == SolverFormat::kAiger ? "techmap\nopt_clean\naigmap\nwrite_aiger -symbols"
                                         : "opt_clean\nwrite_btor",
          folder.file("circuit").string()));
  const Finished yosys = run_tool("yosys", "yosys", {"-q", "-s", folder.file("write.ys").string()});
  if (yosys.status != 0)
    throw UserError(fmt::format("hls: Yosys refuses the circuit: {}", line_with(yosys.output, "ERROR")));
  return read_file(folder.file("circuit"), "what Yosys wrote");
}

}  // namespace meltstage::hls
