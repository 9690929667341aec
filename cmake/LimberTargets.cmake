# limber_wing(NAME [DEPENDS ...] [PRIVATE ...]): the library limber_NAME from every .cpp below the current folder.
function(limber_wing name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;PRIVATE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp" "${CMAKE_CURRENT_SOURCE_DIR}/*.h")
  add_library(limber_${name} STATIC ${sources})
  set_target_properties(limber_${name} PROPERTIES LINKER_LANGUAGE CXX)
  target_include_directories(limber_${name} PUBLIC "${PROJECT_SOURCE_DIR}")
  target_link_libraries(limber_${name} PUBLIC ${ARG_DEPENDS} Eigen3::Eigen PRIVATE limber_flags ${ARG_PRIVATE})
endfunction()

# limber_test(NAME [DEPENDS ...] [LABELS ...]): one GoogleTest executable NAME_test from the *_test.cpp below the current folder.
function(limber_test name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;LABELS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*_test.cpp")
  if(NOT sources)
    return()
  endif()
  add_executable(${name}_test ${sources})
  set_target_properties(${name}_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  target_compile_definitions(${name}_test PRIVATE LIMBER_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_include_directories(${name}_test PRIVATE "${PROJECT_SOURCE_DIR}")
  target_link_libraries(${name}_test PRIVATE ${ARG_DEPENDS} GTest::gmock GTest::gtest_main limber_flags)
  target_link_libraries(${name}_test PRIVATE limber_test_printing)
  include(GoogleTest)
  # NO_PRETTY_VALUES: ctest's names are GoogleTest's; printed parameters behind them are noise.
  # TIMEOUT: tests take seconds, with sanitizers on a loaded machine tens of them; a hang must not eat a run of CI.
  gtest_discover_tests(${name}_test NO_PRETTY_VALUES DISCOVERY_TIMEOUT 60 PROPERTIES LABELS "${name};${ARG_LABELS}" TIMEOUT 120)
endfunction()
