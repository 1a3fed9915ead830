# Installs the packages of package-lock.json into BUILD/node_modules, without running scripts of packages. Variables of
# the caller: NPM, SOURCE, BUILD; WHAT: the part that requires the packages; OPTIONAL: a failure is only a warning.
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
