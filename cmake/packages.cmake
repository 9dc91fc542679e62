# SPDX-License-Identifier: Apache-2.0
# Debian packages: `./run packages` (cpack -G DEB). Each holds the components that its programs or its users need; what they depend on is
# read from the programs by dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME meltstage)
set(CPACK_PACKAGE_VENDOR Meltstage)
set(CPACK_PACKAGE_CONTACT "Meltstage maintainers <maintainers@meltstage.invalid>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_COMPONENTS_ALL)

# meltstage_deb(NAME TITLE text TEXT text SECTION section [ALL] DEPENDS packages SUGGESTS packages COMPONENTS names...): NAME_VERSION_ARCHITECTURE.deb. ALL: for
# every architecture.
function(meltstage_deb name)
  cmake_parse_arguments(D ALL "TITLE;TEXT;SECTION;DEPENDS;SUGGESTS" COMPONENTS ${ARGN})
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/debian/copyright ${PROJECT_BINARY_DIR}/changelog.gz
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${name}-doc)
  string(TOUPPER ${name} group)
  foreach(component ${D_COMPONENTS} ${name}-doc)
    string(TOUPPER ${component} upper)
    set(CPACK_COMPONENT_${upper}_GROUP ${name} PARENT_SCOPE)
  endforeach()
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${D_COMPONENTS} ${name}-doc PARENT_SCOPE)
  set(CPACK_DEBIAN_${group}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${group}_PACKAGE_SECTION ${D_SECTION} PARENT_SCOPE)
  set(CPACK_DEBIAN_${group}_DESCRIPTION "${D_TITLE}\n${D_TEXT}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${group}_PACKAGE_DEPENDS "${D_DEPENDS}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${group}_PACKAGE_SUGGESTS "${D_SUGGESTS}" PARENT_SCOPE)
  if(D_ALL)
    set(CPACK_DEBIAN_${group}_PACKAGE_ARCHITECTURE all PARENT_SCOPE)
    set(CPACK_DEBIAN_${group}_PACKAGE_SHLIBDEPS OFF PARENT_SCOPE)
  endif()
endfunction()

find_program(MELTSTAGE_GZIP gzip REQUIRED)
add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/changelog.gz
  COMMAND ${MELTSTAGE_GZIP} -9nc ${PROJECT_SOURCE_DIR}/cmake/debian/changelog > ${PROJECT_BINARY_DIR}/changelog.gz
  DEPENDS ${PROJECT_SOURCE_DIR}/cmake/debian/changelog VERBATIM)

get_property(parts GLOBAL PROPERTY MELTSTAGE_PART_NAMES)
set(own "= ${PROJECT_VERSION}")
meltstage_deb(meltstage SECTION electronics TITLE "electronics and motion of a print head"
  TEXT "The bit-accurate temperature-controller chip of a print head, compared with its\nRTL clock by clock, in a virtual printer; test patterns for chips, and G-code for\nreal machines."
  COMPONENTS meltstage meltstage-conformal meltstage-regress meltstage-dft meltstage-live meltstage-page reference)
meltstage_deb(meltstage-vision SECTION electronics TITLE "print jobs with an alignment by cameras"
  TEXT "The program that prints jobs with [alignment] on the virtual printer of\nMeltstage." DEPENDS "meltstage (${own})"
  COMPONENTS meltstage-aligned)
meltstage_deb(meltstage-hls SECTION electronics TITLE "C++ functions as circuits, proved equal to RTL"
  TEXT "Translates pure C++ functions into circuits, and proves that RTL is the\nsame one for every state and input."
  DEPENDS "meltstage (${own}), clang-14, yosys, iverilog, berkeley-abc" COMPONENTS meltstage-hls hls)
meltstage_deb(libmeltstage-dev SECTION libdevel TITLE "chip model, driver and motion planning for programs"
  TEXT "Static libraries and headers: the bit-accurate chip, its Modbus driver, pin\nrecordings, velocity profiles, tours, calibration. For CMake and pkg-config."
  SUGGESTS "libceres-dev, libopencv-imgproc-dev"
  DEPENDS "libfmt-dev, libeigen3-dev, libssl-dev, libmodbus-dev, libnlopt-cxx-dev, libpugixml-dev, libfreexl-dev, libcsv-dev, libzip-dev"
  COMPONENTS ${parts} c)
set(CPACK_DEBIAN_LIBMELTSTAGE-DEV_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/triggers)  # its shared library
meltstage_deb(python3-meltstage SECTION python TITLE "chip model, bench and motion planning in Python"
  TEXT "The bit-accurate chip on its simulated head, pin recordings, profiles and\ntours, with NumPy arrays."
  DEPENDS "python3 (>= 3.11), python3 (<< 3.12), python3-numpy" COMPONENTS python)
meltstage_deb(meltstage-rtl ALL SECTION electronics TITLE "the chip in SystemVerilog"
  TEXT "The temperature-controller chip for designs of one's own: file list,\nFuseSoC core, lint waivers, and a system to begin with."
  COMPONENTS rtl)
include(CPack)
get_property(programs GLOBAL PROPERTY MELTSTAGE_APP_PROGRAMS)
get_property(libraries GLOBAL PROPERTY MELTSTAGE_PART_TARGETS)
add_custom_target(debian_packages
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${PROJECT_BINARY_DIR}/packages
  COMMAND ${CMAKE_CPACK_COMMAND} --config ${PROJECT_BINARY_DIR}/CPackConfig.cmake > ${PROJECT_BINARY_DIR}/packages.log
  DEPENDS ${programs} ${libraries} meltstage_c meltstage_python command_reference ${PROJECT_BINARY_DIR}/changelog.gz
  COMMENT "Debian packages (packages.log)" VERBATIM)
