# All packages of the build. third_party/packages.txt lists them for the set-up script.

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(Ceres 2.1 REQUIRED)
# Debian has no package file for SuiteSparse; Ceres' package file finds it.
if(NOT TARGET SuiteSparse::CHOLMOD OR NOT TARGET SuiteSparse::SPQR)
  message(FATAL_ERROR "This Ceres was built without SuiteSparse. Install libceres-dev and libsuitesparse-dev.")
endif()
find_package(yaml-cpp REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(PCL 1.12 REQUIRED COMPONENTS common io filters registration)
find_package(embree 3 REQUIRED)
find_package(TIFF REQUIRED)

find_package(OpenCV 4.5 REQUIRED COMPONENTS core imgproc imgcodecs)
find_path(CAIRO_INCLUDE_DIR cairo/cairo.h REQUIRED)
find_library(CAIRO_LIBRARY cairo REQUIRED)

# Log formats: CDR messages, SQLite bags, compressed chunks and checksums.
find_package(fastcdr REQUIRED)
find_package(SQLite3 REQUIRED)
find_package(BZip2 REQUIRED)
find_package(ZLIB REQUIRED)
find_path(LZ4_INCLUDE_DIR lz4frame.h REQUIRED)
find_library(LZ4_LIBRARY lz4 REQUIRED)
find_path(ZSTD_INCLUDE_DIR zstd.h REQUIRED)
find_library(ZSTD_LIBRARY zstd REQUIRED)
