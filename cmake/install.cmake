# SPDX-License-Identifier: Apache-2.0
# Parts for other projects: `cmake --install build --component NAME` and find_package(meltstage COMPONENTS NAME...), headers as
# <meltstage/ROOM/...>, and NAME as meltstage-NAME for pkg-config. A part brings only the packages that it needs itself.
include(CMakePackageConfigHelpers)
set(MELTSTAGE_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/meltstage)
if(NOT PROJECT_IS_TOP_LEVEL)  # headers are <meltstage/ROOM/...> for whoever takes the sources in, too
  set(MELTSTAGE_INCLUDE ${PROJECT_BINARY_DIR}/include)
  file(MAKE_DIRECTORY ${MELTSTAGE_INCLUDE})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR} ${MELTSTAGE_INCLUDE}/meltstage SYMBOLIC)
endif()

# meltstage_part(NAME TARGET library HEADERS files... NEEDS parts... PACKAGES "find_dependency arguments"... LIBS linker names...): in the
# room's CMakeLists.txt. Headers that aren't named are private. A part may need only parts that came before it.
function(meltstage_part name)
  cmake_parse_arguments(P "" "TARGET" "HEADERS;NEEDS;PACKAGES;LIBS" ${ARGN})
  set_target_properties(${P_TARGET} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(${P_TARGET} INTERFACE
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/meltstage>)
  if(NOT TARGET meltstage::${name})  # the name by which other projects know it, also inside this build
    add_library(meltstage::${name} ALIAS ${P_TARGET})
  endif()
  if(NOT PROJECT_IS_TOP_LEVEL)
    target_include_directories(${P_TARGET} INTERFACE $<BUILD_INTERFACE:${MELTSTAGE_INCLUDE}>)
  endif()
  install(TARGETS ${P_TARGET} EXPORT meltstage-${name} ARCHIVE COMPONENT ${name})
  install(EXPORT meltstage-${name} NAMESPACE meltstage:: DESTINATION ${MELTSTAGE_CMAKE_DIR} COMPONENT ${name})
  file(RELATIVE_PATH room ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  install(FILES ${P_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/meltstage/${room} COMPONENT ${name})

  get_target_property(kind ${P_TARGET} TYPE)
  set(archive)
  if(kind STREQUAL STATIC_LIBRARY)
    set(archive -l${P_TARGET})
    # For plug-ins and Python modules. A program's calls within a part are inlined all the same: nothing is put in their place.
    set_target_properties(${P_TARGET} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_compile_options(${P_TARGET} PRIVATE -fno-semantic-interposition)
  endif()
  list(TRANSFORM P_LIBS PREPEND -l)
  list(TRANSFORM P_NEEDS PREPEND meltstage- OUTPUT_VARIABLE needed)
  if("${P_PACKAGES}" MATCHES "Eigen3")  # its headers are in those of the part
    list(APPEND needed eigen3)
  endif()
  list(JOIN P_LIBS " " libs)
  list(JOIN needed " " needed)
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/meltstage-${name}.pc @ONLY CONTENT
"prefix=\${pcfiledir}/../..
Name: meltstage-${name}
Description: @PROJECT_DESCRIPTION@: ${name}
Version: @PROJECT_VERSION@
Requires: ${needed}
Cflags: -std=c++20 -I\${prefix}/@CMAKE_INSTALL_INCLUDEDIR@ -I\${prefix}/@CMAKE_INSTALL_INCLUDEDIR@/meltstage
Libs: -L\${prefix}/@CMAKE_INSTALL_LIBDIR@ ${archive} ${libs}
")
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/meltstage-${name}.pc DESTINATION lib/pkgconfig COMPONENT ${name})

  list(JOIN P_NEEDS " " needs)
  set(packages)
  foreach(package ${P_PACKAGES})
    string(APPEND packages " \"${package}\"")
  endforeach()
  # A file of each part's own, so that parts of several builds can share a prefix.
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/meltstage-${name}-part.cmake @ONLY CONTENT
"list(APPEND meltstage_parts ${name})
set(meltstage_${name}_needs ${needs})
set(meltstage_${name}_packages${packages})
")
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/meltstage-${name}-part.cmake DESTINATION ${MELTSTAGE_CMAKE_DIR} COMPONENT ${name})
  set_property(GLOBAL APPEND PROPERTY MELTSTAGE_PART_NAMES ${name})
  set_property(GLOBAL APPEND PROPERTY MELTSTAGE_PART_TARGETS ${P_TARGET})
endfunction()

# At the end of the top CMakeLists.txt: the package's own files. They belong to every part, so each part installs them.
function(meltstage_package)
  get_property(names GLOBAL PROPERTY MELTSTAGE_PART_NAMES)
  list(JOIN names ", " MELTSTAGE_PARTS_OF_BUILD)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/meltstage-config.cmake.in ${PROJECT_BINARY_DIR}/meltstage-config.cmake
    INSTALL_DESTINATION ${MELTSTAGE_CMAKE_DIR})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/meltstage-config-version.cmake COMPATIBILITY SameMinorVersion)
  foreach(part ${names})
    install(FILES ${PROJECT_BINARY_DIR}/meltstage-config.cmake ${PROJECT_BINARY_DIR}/meltstage-config-version.cmake
      DESTINATION ${MELTSTAGE_CMAKE_DIR} COMPONENT ${part})
  endforeach()
endfunction()
