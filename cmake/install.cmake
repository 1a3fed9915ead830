# Installation: component `program` is the command with its data, component `library` the headers and static libraries.

include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(lodestone_layers core factors frontends estimators localization)
set(lodestone_cmake_folder ${CMAKE_INSTALL_LIBDIR}/cmake/lodestone)

install(TARGETS lodestone RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(DIRECTORY config DESTINATION ${CMAKE_INSTALL_DATADIR}/lodestone COMPONENT program)
install(DIRECTORY tools/fleet DESTINATION ${CMAKE_INSTALL_DATADIR}/lodestone COMPONENT program USE_SOURCE_PERMISSIONS)
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY docs/user docs/design docs/results docs/pictures docs/examples
        DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs COMPONENT program)
install(FILES docs/index.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs COMPONENT program)

# The program writes its manual page and its completion from the declarations of its options.
install(CODE "execute_process(COMMAND \"$<TARGET_FILE:lodestone>\" manual --out \"${PROJECT_BINARY_DIR}/manual\"
                              COMMAND_ERROR_IS_FATAL ANY)" COMPONENT program)
install(FILES ${PROJECT_BINARY_DIR}/manual/lodestone.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${PROJECT_BINARY_DIR}/manual/lodestone.bash RENAME lodestone
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)

# Includes are written from the root of the source tree ("core/time.h"): that folder is include/lodestone.
foreach(layer IN LISTS lodestone_layers)
  set_target_properties(lodestone_${layer} PROPERTIES EXPORT_NAME ${layer})
  target_include_directories(lodestone_${layer} SYSTEM INTERFACE
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/lodestone>)
  install(TARGETS lodestone_${layer} EXPORT lodestone-targets
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library)
  install(DIRECTORY ${layer} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lodestone COMPONENT library
          FILES_MATCHING PATTERN "*.h")
endforeach()
# The libraries are compiled without AVX. With AVX, Eigen would align matrices of other programs differently.
target_compile_definitions(lodestone_core INTERFACE $<INSTALL_INTERFACE:EIGEN_MAX_ALIGN_BYTES=16>)

install(EXPORT lodestone-targets NAMESPACE lodestone:: DESTINATION ${lodestone_cmake_folder} COMPONENT library)
configure_package_config_file(cmake/lodestone-config.cmake.in ${PROJECT_BINARY_DIR}/lodestone-config.cmake
                              INSTALL_DESTINATION ${lodestone_cmake_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lodestone-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/lodestone-config.cmake ${PROJECT_BINARY_DIR}/lodestone-config-version.cmake
              cmake/library_dependencies.cmake
        DESTINATION ${lodestone_cmake_folder} COMPONENT library)
install(DIRECTORY docs/examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT library)
