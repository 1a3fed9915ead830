# Debian packages, one for each component (tools/package.sh).

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR Lodestone)
set(CPACK_PACKAGE_CONTACT "Lodestone developers")
set(CPACK_COMPONENTS_ALL program library)
if(LODESTONE_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME lodestone)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "Localization of logged LiDAR, IMU and magnetometer data in prior maps")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS fonts-dejavu-core)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "snakemake, libopenblas0-pthread")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME liblodestone-dev)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "Headers and static libraries of lodestone")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libdevel)
# The packages that cmake/library_dependencies.cmake finds.
set(development_packages
  libeigen3-dev libtbb-dev libboost-dev libceres-dev libsuitesparse-dev libyaml-cpp-dev libfmt-dev libpcl-dev
  libtiff-dev libopencv-dev libfastcdr-dev libsqlite3-dev libbz2-dev zlib1g-dev liblz4-dev libzstd-dev)
list(JOIN development_packages ", " development_packages)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS "${development_packages}")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-lodestone)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Localization of LiDAR, IMU and magnetometer data in prior maps, from Python")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
# A compiled module fits one version of Python.
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= 3.11), python3 (<< 3.12), python3-numpy, python3-pandas")
include(CPack)
