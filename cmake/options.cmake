# Compiler, linker and warning options of all layers.

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()
find_program(MOLD_PROGRAM mold)
if(MOLD_PROGRAM)
  add_link_options(-fuse-ld=mold)
endif()

add_library(lodestone_options INTERFACE)
target_include_directories(lodestone_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(lodestone_options INTERFACE
  # Debian's PCL is built without AVX: mixing instruction sets changes Eigen's alignment and crashes in free().
  $<$<STREQUAL:${CMAKE_SYSTEM_PROCESSOR},x86_64>:-march=x86-64-v2>
  # Same results on every machine: no contraction into fused multiply-adds.
  -ffp-contract=off
  -Wall -Wextra -Wno-unused-parameter)
if(LODESTONE_SANITIZER)
  target_compile_options(lodestone_options INTERFACE -fsanitize=${LODESTONE_SANITIZER} -fno-omit-frame-pointer)
  target_compile_definitions(lodestone_options INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  target_link_options(lodestone_options INTERFACE -fsanitize=${LODESTONE_SANITIZER})
endif()

# Common headers, parsed once for each layer and test program. This saves a third of the build time. With ccache, set
# CCACHE_SLOPPINESS=pch_defines,time_macros (as tools/build.sh does); otherwise these files are not cached.
option(LODESTONE_PRECOMPILED_HEADERS "Parse common headers once" ON)
function(lodestone_precompile target)
  if(LODESTONE_PRECOMPILED_HEADERS)
    target_compile_options(${target} PRIVATE -fpch-preprocess)
    target_precompile_headers(${target} PRIVATE
      <Eigen/Cholesky> <Eigen/Core> <Eigen/Eigenvalues> <Eigen/Geometry> <Eigen/LU> <algorithm> <cmath> <filesystem>
      <functional> <map> <memory> <optional> <span> <string> <vector> ${ARGN})
  endif()
endfunction()

# Unity build: several sources of a target are compiled together, and common headers are read once. A full build is
# faster; recompiling after a small change is slower. No two files of a target may use the same name, also not in
# anonymous namespaces.
option(LODESTONE_UNITY "Compile sources of a target together" OFF)
set(LODESTONE_UNITY_SIZE 12 CACHE STRING "Number of sources in a unity file")
function(lodestone_unity target)
  if(LODESTONE_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${LODESTONE_UNITY_SIZE})
    # In a unity build, g++ treats the anonymous namespaces of .cpp files like those of headers.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()

# lodestone_layer(NAME): a static library of all sources below the current folder, with the alias lodestone::NAME.
function(lodestone_layer name)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/simulate/")
  lodestone_library(${name} "${sources}" ${ARGN})
endfunction()

# lodestone_library(NAME SOURCES LIBRARY...): a static library with the alias lodestone::NAME.
function(lodestone_library name sources)
  add_library(lodestone_${name} STATIC ${sources})
  add_library(lodestone::${name} ALIAS lodestone_${name})
  # Programs that use the installed libraries have their own options.
  target_link_libraries(lodestone_${name} PUBLIC $<BUILD_INTERFACE:lodestone_options> ${ARGN})
  target_compile_features(lodestone_${name} INTERFACE cxx_std_20)
  # Shared libraries of other programs, such as modules of Python, contain the code too.
  set_target_properties(lodestone_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(lodestone_${name} PRIVATE -fno-semantic-interposition)
  lodestone_precompile(lodestone_${name})
  lodestone_unity(lodestone_${name})
endfunction()
