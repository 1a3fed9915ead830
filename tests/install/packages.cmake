# Writes the Debian packages and reads their fields: cmake -DBUILD=... -DWORK=... -P packages.cmake
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
execute_process(COMMAND ${CMAKE_CPACK_COMMAND} -G DEB -B ${WORK} WORKING_DIRECTORY ${BUILD} OUTPUT_QUIET
                COMMAND_ERROR_IS_FATAL ANY)
file(GLOB packages ${WORK}/*.deb)
list(LENGTH packages count)
if(count LESS 2)
  message(FATAL_ERROR "expected a package of the program and one of the library, found: ${packages}")
endif()
foreach(package ${packages})
  execute_process(COMMAND dpkg-deb --field ${package} Package Version OUTPUT_VARIABLE fields
                  COMMAND_ERROR_IS_FATAL ANY)
  message("${fields}")
endforeach()
file(REMOVE_RECURSE ${WORK})
