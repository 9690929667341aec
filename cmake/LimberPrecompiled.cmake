# Precompiled headers: two fifths of a cold build went into reading Eigen, the standard library, GoogleTest and the
# generated messages again for every file. They change nothing about what a file has to include.
#
# limber_precompile(TARGET KIND [HEADER ...]): HEADERs, the standard library, and as KIND says numerics (for the engine),
# messages (for clients) or both (service, for the server).
# limber_precompile_tests(TARGET KIND): the same after tests/support/printing/print.h, with GoogleTest; once for each kind.

set(limber_standard_headers <algorithm> <array> <atomic> <charconv> <chrono> <cmath> <cstddef> <cstdint> <cstring> <deque>
  <filesystem> <fstream> <functional> <limits> <map> <memory> <mutex> <numbers> <numeric> <optional> <random> <set> <span>
  <sstream> <string> <string_view> <thread> <tuple> <unordered_map> <utility> <variant> <vector> <fmt/format.h>)
set(limber_eigen_headers <Eigen/Dense> <Eigen/SparseCore>)
set(limber_message_headers <limber/v1/service.pb.h> <limber/v1/stream.pb.h>)

if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
  # g++ 12 warns wrongly of what it inlines from std::string (gcc bug 105329 and its kin) where it has read that from a
  # precompiled header. With CMAKE_DISABLE_PRECOMPILE_HEADERS these warnings are on.
  target_compile_options(limber_flags INTERFACE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread)
endif()

function(limber_precompile target kind)
  target_precompile_headers(${target} PRIVATE ${ARGN} ${limber_standard_headers})
  if(NOT kind MATCHES "^(numerics|service|messages)$")
    message(FATAL_ERROR "limber_precompile: there is no kind ${kind}")
  endif()
  if(NOT kind STREQUAL "messages")
    target_precompile_headers(${target} PRIVATE ${limber_eigen_headers})
  endif()
  if(NOT kind STREQUAL "numerics")
    target_precompile_headers(${target} PRIVATE ${limber_message_headers})
  endif()
endfunction()

function(limber_precompile_tests target kind)
  get_property(first GLOBAL PROPERTY limber_tests_precompiled_${kind})
  if(first)
    target_precompile_headers(${target} REUSE_FROM ${first})
    return()
  endif()
  set_property(GLOBAL PROPERTY limber_tests_precompiled_${kind} ${target})
  limber_precompile(${target} ${kind} "${PROJECT_SOURCE_DIR}/tests/support/printing/print.h")
  target_precompile_headers(${target} PRIVATE <gtest/gtest.h> <gmock/gmock.h>)
endfunction()
