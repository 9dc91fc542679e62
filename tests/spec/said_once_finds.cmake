# SPDX-License-Identifier: Apache-2.0
# A list of pins and a constant, typed by hand into a scratch room: both must be named.
file(REMOVE_RECURSE ${SCRATCH})
file(COPY ${SOURCE}/spec/chip.toml DESTINATION ${SCRATCH}/spec)
file(COPY ${SOURCE}/cmodel/spec.hpp DESTINATION ${SCRATCH}/cmodel)
file(WRITE ${SCRATCH}/tb/pins.hpp "const char* kNames[] = {\"rst_ni\", \"uart_rx_i\", \"uart_tx_o\", \"uart_de_o\", \"tlm_tx_o\", \"heater_o\"};\n"
  "constexpr int kExcBusy = 6;\n")
execute_process(COMMAND /usr/bin/python3 -B ${SOURCE}/tests/spec/said_once.py ${SCRATCH} RESULT_VARIABLE status ERROR_VARIABLE message OUTPUT_QUIET)
if(NOT status EQUAL 1 OR NOT message MATCHES "tb/pins.hpp:1: found 6 pins" OR NOT message MATCHES "tb/pins.hpp:2: found a value of kExcBusy")
  message(FATAL_ERROR "status ${status}, message: ${message}")
endif()
