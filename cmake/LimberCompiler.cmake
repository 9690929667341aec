# Compiler flags: warnings are errors, one instruction set for every file (Eigen's alignment depends on it).

option(LIMBER_WERROR "Treat warnings as errors" ON)
set(LIMBER_SANITIZE "" CACHE STRING "Sanitizers, comma-separated: address,undefined or thread")
option(LIMBER_FUZZ "Build the targets of tests/fuzz with libFuzzer; clang alone has it" OFF)
set(LIMBER_ARCH "auto" CACHE STRING "-march value; auto: x86-64-v3 where the building machine has AVX2 and FMA, else the default")

add_library(limber_flags INTERFACE)
target_compile_options(limber_flags INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual)
if(LIMBER_WERROR)
  target_compile_options(limber_flags INTERFACE -Werror)
endif()

if(LIMBER_ARCH STREQUAL "auto")
  set(limber_march "")
  if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64" AND EXISTS /proc/cpuinfo)
    file(READ /proc/cpuinfo cpuinfo LIMIT 8192)
    if(cpuinfo MATCHES " avx2 " AND cpuinfo MATCHES " fma " AND cpuinfo MATCHES " bmi2 ")
      set(limber_march "x86-64-v3")
    endif()
  endif()
else()
  set(limber_march "${LIMBER_ARCH}")
endif()
if(limber_march)
  target_compile_options(limber_flags INTERFACE -march=${limber_march})
endif()
message(STATUS "limber: instruction set ${limber_march}")

# -ffp-contract is left at GCC's default; -ffast-math is not used anywhere: NaN checks must work.
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
if(LIMBER_SANITIZE)
  # -O1 and line tables only: building costs more than running here, and reports are easier to read.
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1 -DNDEBUG")
  target_compile_options(limber_flags INTERFACE -fsanitize=${LIMBER_SANITIZE} -fno-omit-frame-pointer)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # g++ 12 takes the checks that it inserts itself for reads of unset variables (in Eigen and the standard library).
    target_compile_options(limber_flags INTERFACE -Wno-maybe-uninitialized)
  endif()
  target_link_options(limber_flags INTERFACE -fsanitize=${LIMBER_SANITIZE})
  if(LIMBER_FUZZ)
    target_compile_options(limber_flags INTERFACE -fsanitize=fuzzer-no-link)
  endif()
  if(LIMBER_SANITIZE MATCHES "undefined")
    target_compile_options(limber_flags INTERFACE -fno-sanitize-recover=undefined)
  endif()
endif()

find_program(LIMBER_CCACHE ccache)
if(LIMBER_CCACHE)
  # What ccache asks for where headers are precompiled.
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND};-E;env;CCACHE_DEPEND=1;CCACHE_SLOPPINESS=pch_defines,time_macros;${LIMBER_CCACHE}")
endif()
