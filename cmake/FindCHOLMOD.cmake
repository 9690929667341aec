# CHOLMOD::CHOLMOD. Debian 12's SuiteSparse 5.12 ships no CMake config. OpenBLAS is linked explicitly, so that the
# engine can pin it to one thread: results must not depend on the number of threads.
find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse)
find_library(CHOLMOD_LIBRARY cholmod)
find_library(CHOLMOD_OPENBLAS_LIBRARY openblas)
find_library(CHOLMOD_OPENMP_LIBRARY NAMES gomp libgomp.so.1)  # which CHOLMOD runs on: to keep it from threads
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(CHOLMOD REQUIRED_VARS CHOLMOD_LIBRARY CHOLMOD_INCLUDE_DIR CHOLMOD_OPENBLAS_LIBRARY
  CHOLMOD_OPENMP_LIBRARY)
if(CHOLMOD_FOUND AND NOT TARGET CHOLMOD::CHOLMOD)
  add_library(CHOLMOD::CHOLMOD INTERFACE IMPORTED)
  target_include_directories(CHOLMOD::CHOLMOD SYSTEM INTERFACE "${CHOLMOD_INCLUDE_DIR}")
  target_link_libraries(CHOLMOD::CHOLMOD INTERFACE "${CHOLMOD_LIBRARY}" "${CHOLMOD_OPENBLAS_LIBRARY}"
    "${CHOLMOD_OPENMP_LIBRARY}")
endif()
mark_as_advanced(CHOLMOD_INCLUDE_DIR CHOLMOD_LIBRARY CHOLMOD_OPENBLAS_LIBRARY CHOLMOD_OPENMP_LIBRARY)
