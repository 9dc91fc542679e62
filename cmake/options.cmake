# SPDX-License-Identifier: Apache-2.0
# How the project is compiled; what is compiled stands in each room's CMakeLists.txt.
include(GNUInstallDirs)

find_program(MELTSTAGE_CCACHE ccache)
if(MELTSTAGE_CCACHE)
  set(CMAKE_C_COMPILER_LAUNCHER ${MELTSTAGE_CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${MELTSTAGE_CCACHE})
endif()
find_program(MELTSTAGE_MOLD mold)
if(MELTSTAGE_MOLD)
  add_link_options(-fuse-ld=mold)
endif()

set(MELTSTAGE_SANITIZE "" CACHE STRING "Sanitizers, e.g. address,undefined")
option(MELTSTAGE_COVERAGE "Compile with gcov counters" OFF)
option(MELTSTAGE_FUZZ "Build the libFuzzer targets (clang)" OFF)
if(MELTSTAGE_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
if(MELTSTAGE_SANITIZE)
  # GCC 12 warns falsely of its own <regex> when that is instrumented
  add_compile_options(-fsanitize=${MELTSTAGE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  add_link_options(-fsanitize=${MELTSTAGE_SANITIZE})
endif()
if(MELTSTAGE_COVERAGE)
  add_compile_options(--coverage)
  add_link_options(--coverage)
endif()

# runs_once(TARGET): what reads, checks and writes once a command. It waits for files, not for the processor, so compiling it fast counts more.
function(runs_once target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# Warnings are errors in our own code only, and only where it is the whole project: link this target PRIVATE.
set(as_errors)
if(PROJECT_IS_TOP_LEVEL)
  set(as_errors -Werror)
endif()
add_library(meltstage_warnings INTERFACE)
target_compile_options(meltstage_warnings INTERFACE
  -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Woverloaded-virtual ${as_errors}
  $<$<CXX_COMPILER_ID:Clang>:-Wno-missing-braces>
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)  # false alarms on std::string in GCC 12 (GCC bug 105651)

# Stops where OPTION is on and another one that it needs is off.
function(meltstage_needs option)
  foreach(needed ${ARGN})
    if(${option} AND NOT ${needed})
      message(FATAL_ERROR "${option}: found ${needed} off, expected it on; give -D${needed}=ON, or -D${option}=OFF")
    endif()
  endforeach()
endfunction()
