# SPDX-License-Identifier: Apache-2.0
# cmake -DIN=FILE -DOUT=HEADER -DNAMESPACE=... -DNAME=... -P embed_file.cmake: a text that the build made, as an array of C++ (a string_view would have the compiler count it).
cmake_minimum_required(VERSION 3.25)
file(READ ${IN} text)
file(CONFIGURE OUTPUT ${OUT} @ONLY
     CONTENT "#pragma once\nnamespace ${NAMESPACE} {\ninline constexpr char ${NAME}[] = R\"embedded(@text@)embedded\";\n}\n")
