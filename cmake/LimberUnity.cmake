# Unity builds: several files of a target as one translation unit. Reading the headers of Eigen, protobuf and GoogleTest
# and instantiating their templates once for each file was most of a cold build (docs/build-times.md).
#
# Hot kernels stay apart: what the compiler makes of them must not depend on their neighbours.
#
# A file still has to include what it uses and must compile alone: the preset portable builds it so.

option(LIMBER_UNITY "Compile several files of a target as one translation unit" ON)
set(LIMBER_UNITY_BATCH 10 CACHE STRING "Files in one translation unit")

if(LIMBER_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Types of a unit that have members of its anonymous namespaces: fine, but g++ takes the united file for a header.
  target_compile_options(limber_flags INTERFACE -Wno-subobject-linkage)
endif()

# limber_unite(TARGET [APART FILE ...]): FILEs are compiled alone.
function(limber_unite target)
  cmake_parse_arguments(ARG "" "" "APART" ${ARGN})
  if(NOT LIMBER_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${LIMBER_UNITY_BATCH})
  if(ARG_APART)
    set_source_files_properties(${ARG_APART} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()
