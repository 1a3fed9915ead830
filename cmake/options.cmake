# Compiler, linker and warning options that every floor shares.

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
  # The same bits on every machine: no contraction into fused multiply-adds.
  -ffp-contract=off
  -Wall -Wextra -Wno-unused-parameter)
if(LODESTONE_SANITIZER)
  target_compile_options(lodestone_options INTERFACE -fsanitize=${LODESTONE_SANITIZER} -fno-omit-frame-pointer)
  target_compile_definitions(lodestone_options INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  target_link_options(lodestone_options INTERFACE -fsanitize=${LODESTONE_SANITIZER})
endif()

# Headers that most files read anyway, parsed once for each floor and test program: a third of the build's time. ccache needs
# CCACHE_SLOPPINESS=pch_defines,time_macros to keep what is compiled with them (tools/build.sh sets it).
option(LODESTONE_PRECOMPILED_HEADERS "Parse common headers once" ON)
function(lodestone_precompile target)
  if(LODESTONE_PRECOMPILED_HEADERS)
    target_compile_options(${target} PRIVATE -fpch-preprocess)
    target_precompile_headers(${target} PRIVATE
      <Eigen/Cholesky> <Eigen/Core> <Eigen/Eigenvalues> <Eigen/Geometry> <Eigen/LU> <algorithm> <cmath> <filesystem>
      <functional> <map> <memory> <optional> <span> <string> <vector> ${ARGN})
  endif()
endfunction()

# Sources of a target compiled together, so many at a time: what they all include is read once. For whoever builds everything;
# whoever changes single files waits longer for each. Two files of a target must then not use one name, in anonymous
# namespaces either.
option(LODESTONE_UNITY "Compile sources of a target together" OFF)
set(LODESTONE_UNITY_SIZE 12 CACHE STRING "So many sources together")
function(lodestone_unity target)
  if(LODESTONE_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${LODESTONE_UNITY_SIZE})
    # A .cpp file is then an included one, whose anonymous namespaces g++ takes for a header's.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()

# lodestone_layer(NAME): a static library of every source below the current folder, known as lodestone::NAME.
function(lodestone_layer name)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/simulate/")
  lodestone_library(${name} "${sources}" ${ARGN})
endfunction()

# lodestone_library(NAME SOURCES LIBRARY...): a static library, known as lodestone::NAME.
function(lodestone_library name sources)
  add_library(lodestone_${name} STATIC ${sources})
  add_library(lodestone::${name} ALIAS lodestone_${name})
  target_link_libraries(lodestone_${name} PUBLIC lodestone_options ${ARGN})
  lodestone_precompile(lodestone_${name})
  lodestone_unity(lodestone_${name})
endfunction()
