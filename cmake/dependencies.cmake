# All packages of the build. third_party/packages.txt lists them for the set-up script.

macro(lodestone_find)
  find_package(${ARGN} REQUIRED)
endmacro()
include(cmake/library_dependencies.cmake)
# Debian has no package file for SuiteSparse; Ceres' package file finds it.
if(NOT TARGET SuiteSparse::CHOLMOD OR NOT TARGET SuiteSparse::SPQR)
  message(FATAL_ERROR "This Ceres was built without SuiteSparse. Install libceres-dev and libsuitesparse-dev.")
endif()
find_package(PCL 1.12 REQUIRED COMPONENTS common io filters registration)
find_path(LZ4_INCLUDE_DIR lz4frame.h REQUIRED)
find_library(LZ4_LIBRARY lz4 REQUIRED)
find_path(ZSTD_INCLUDE_DIR zstd.h REQUIRED)
find_library(ZSTD_LIBRARY zstd REQUIRED)

# The program only.
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(embree 3 REQUIRED)
find_path(CAIRO_INCLUDE_DIR cairo/cairo.h REQUIRED)
find_library(CAIRO_LIBRARY cairo REQUIRED)
