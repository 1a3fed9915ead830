# Installs what package-lock.json pins into BUILD/node_modules. No script of any package is run. Given by the caller: NPM,
# SOURCE, BUILD; WHAT needs the packages; with OPTIONAL their absence is a warning only.
file(MAKE_DIRECTORY ${BUILD})
file(COPY ${SOURCE}/package.json ${SOURCE}/package-lock.json DESTINATION ${BUILD})
foreach(attempt RANGE 1 3)
  execute_process(
    COMMAND ${NPM} ci --ignore-scripts --prefer-offline --no-audit --no-fund --loglevel=error --fetch-retries=4
    WORKING_DIRECTORY ${BUILD}
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(result EQUAL 0)
    file(TOUCH ${BUILD}/packages.stamp)
    return()
  endif()
  execute_process(COMMAND ${CMAKE_COMMAND} -E sleep 5)
endforeach()
file(WRITE ${BUILD}/npm.log "${output}")
string(REGEX MATCH "npm (ERR!|error) [^\n]*" reason "${output}")
set(severity FATAL_ERROR)
if(OPTIONAL)
  set(severity WARNING)
endif()
message(${severity} "npm could not fetch the packages of ${WHAT} after 3 attempts (${reason}); npm requires its "
                    "registry or a filled cache; its output is in ${BUILD}/npm.log")
