# SPDX-License-Identifier: Apache-2.0
# A list of pins, a constant, and in the RTL a constant, codes and places of fields, typed by hand into a scratch room: each must be named.
file(REMOVE_RECURSE ${SCRATCH})
file(COPY ${SOURCE}/spec/chip.toml DESTINATION ${SCRATCH}/spec)
file(COPY ${SOURCE}/cmodel/spec.hpp DESTINATION ${SCRATCH}/cmodel)
file(WRITE ${SCRATCH}/tb/pins.hpp "const char* kNames[] = {\"rst_ni\", \"uart_rx_i\", \"uart_tx_o\", \"uart_de_o\", \"tlm_tx_o\", \"heater_o\"};\n"
  "constexpr int kExcBusy = 6;\n")
file(COPY ${SOURCE}/rtl/tc_pkg.sv DESTINATION ${SCRATCH}/rtl)
file(WRITE ${SCRATCH}/rtl/tc_block.sv "  localparam logic [7:0] ExcBusy = 8'd6;\n  assign full = segment_i == 2'd1;\n  assign ff_en = params_i.ctrl[2];\n"
  "      form_exc = 8'd3;\n  assign word = status_i[15:9];\n")
execute_process(COMMAND /usr/bin/python3 -B ${SOURCE}/tests/spec/said_once.py ${SCRATCH} RESULT_VARIABLE status ERROR_VARIABLE message OUTPUT_QUIET)
if(NOT status EQUAL 1 OR NOT message MATCHES "tb/pins.hpp:1: found 6 pins" OR NOT message MATCHES "tb/pins.hpp:2: found a value of kExcBusy"
   OR NOT message MATCHES "rtl/tc_block.sv:1: found a value of ExcBusy" OR NOT message MATCHES "tc_block.sv:2: found segment_i"
   OR NOT message MATCHES "tc_block.sv:3: found params_i.ctrl" OR NOT message MATCHES "tc_block.sv:4: found _exc" OR NOT message MATCHES "tc_block.sv:5: found status_i")
  message(FATAL_ERROR "status ${status}, message: ${message}")
endif()
