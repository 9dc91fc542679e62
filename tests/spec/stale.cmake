# SPDX-License-Identifier: Apache-2.0
# Alters one generated file at a time in a scratch copy; the check must name just that file and fail.
set(generated rtl/tc_pkg.sv cmodel/spec.hpp cmodel/pins.hpp cmodel/fault_advice.hpp docs/chip/registers.md docs/host/modbus_map.csv docs/host/modbus_map.json)
foreach(altered IN LISTS generated)
  file(REMOVE_RECURSE ${SCRATCH})
  foreach(name IN LISTS generated)
    get_filename_component(folder ${name} DIRECTORY)
    file(COPY ${SOURCE}/${name} DESTINATION ${SCRATCH}/${folder})
  endforeach()
  file(APPEND ${SCRATCH}/${altered} " ")
  execute_process(COMMAND /usr/bin/python3 ${SOURCE}/spec/generate.py --check --out ${SCRATCH}
                  RESULT_VARIABLE status ERROR_VARIABLE message)
  if(status EQUAL 0 OR NOT message MATCHES "^${altered}: stale[^\n]*\n$")
    message(FATAL_ERROR "${altered} was altered; status ${status}, message: ${message}")
  endif()
endforeach()
