# SPDX-License-Identifier: Apache-2.0
# A list of pins, a constant, codes and places of fields, in C++ and in the RTL, typed by hand into a scratch room: each must be named.
file(REMOVE_RECURSE ${SCRATCH})
file(COPY ${SOURCE}/spec/chip.toml DESTINATION ${SCRATCH}/spec)
file(COPY ${SOURCE}/cmodel/spec.hpp DESTINATION ${SCRATCH}/cmodel)
file(WRITE ${SCRATCH}/tb/pins.hpp "const char* kNames[] = {\"rst_ni\", \"uart_rx_i\", \"uart_tx_o\", \"uart_de_o\", \"tlm_tx_o\", \"heater_o\"};\n"
  "constexpr int kExcBusy = 6;\n")
# Each line is one that is found; the last ones are none.
file(WRITE ${SCRATCH}/tb/codes.cpp "bool a = uart.cmd_fc() == 43;\nbool b = params().bit(spec::kRegCtrl, 3);\nbool c = (param(spec::kRegMode) & 1) != 0;\nset(kRegCtrl, 0x37);\n"
  "p[spec::kRegMode] = 1;\nauto first = chip.read_register(spec::kInFirstFault) >> 8;\nbool d = pv == INT16_MIN;\nconst Setting s{kRegCtrl, 0b0010011};\n"
  "bool e = write(reg, 9).exception_code == 3;\nconstexpr double kClock_hz = 12'000'000;\n"
  "bool f = uart.cmd_fc() == spec::kFcDiagnostics;  // cmd_fc() == 8\nset(kRegMode, 0);\nset(kRegCtrl, 0);\nset(kRegCtrl, kDither);\n")
file(COPY ${SOURCE}/rtl/tc_pkg.sv DESTINATION ${SCRATCH}/rtl)
file(WRITE ${SCRATCH}/rtl/tc_block.sv "  localparam logic [7:0] ExcBusy = 8'd6;\n  assign full = segment_i == 2'd1;\n  assign ff_en = params_i.ctrl[2];\n"
  "      form_exc = 8'd3;\n  assign word = status_i[15:9];\n  assign length = sens.frame[5:0];\n")
execute_process(COMMAND /usr/bin/python3 -B ${SOURCE}/tests/spec/said_once.py ${SCRATCH} RESULT_VARIABLE status ERROR_VARIABLE message OUTPUT_QUIET)
if(NOT status EQUAL 1 OR NOT message MATCHES "tb/pins.hpp:1: found 6 pins" OR NOT message MATCHES "tb/pins.hpp:2: found a value of kExcBusy"
   OR NOT message MATCHES "rtl/tc_block.sv:1: found a value of ExcBusy" OR NOT message MATCHES "tc_block.sv:2: found segment_i"
   OR NOT message MATCHES "tc_block.sv:3: found params_i.ctrl" OR NOT message MATCHES "tc_block.sv:4: found _exc" OR NOT message MATCHES "tc_block.sv:5: found status_i"
   OR NOT message MATCHES "tc_block.sv:6: found sens.frame")
  message(FATAL_ERROR "status ${status}, message: ${message}")
endif()
foreach(line RANGE 1 14)
  string(FIND "${message}" "tb/codes.cpp:${line}: found" at)
  if((line LESS 11 AND at LESS 0) OR (line GREATER 10 AND at GREATER -1))
    message(FATAL_ERROR "line ${line} of codes.cpp: place ${at}, message: ${message}")
  endif()
endforeach()
