# Installs the project into an empty folder, builds docs/examples/localize against the installation, and runs the
# example. Its trajectory must be that of the installed program: both use the same function.
#
#   cmake -DBUILD=FOLDER -DSOURCE=FOLDER -DWORK=FOLDER -DGENERATOR=NAME -P example.cmake

function(run)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE code)
  message("${output}")
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "exit code ${code}: ${ARGN}")
  endif()
endfunction()

function(read_poses file out)
  file(STRINGS ${file} lines REGEX "^[^#]")
  set(${out} "${lines}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
set(prefix ${WORK}/prefix)
foreach(component program library)
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --component ${component})
endforeach()

run(${CMAKE_COMMAND} -S ${SOURCE}/docs/examples/localize -B ${WORK}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=Release
    -DCMAKE_PREFIX_PATH=${prefix})
run(${CMAKE_COMMAND} --build ${WORK}/build)

# From here on only installed files are used.
set(lodestone ${prefix}/bin/lodestone)
set(drive ${WORK}/drive)
run(${lodestone} simulate ${prefix}/share/lodestone/config/worlds/corridor.yaml --out ${drive}
    --duration 5 --only log,cloud
    --set sensors.lidar.rows=16 --set sensors.lidar.columns=512)
read_poses(${drive}/truth.tum truth)
list(GET truth 0 first)
string(REGEX MATCH " (.*)" ignored "${first}")
set(pose "${CMAKE_MATCH_1}")
set(input ${drive}/log.bag --platform ${drive}/platform.yaml --cloud ${drive}/cloud.pcd --initial-pose "${pose}")
run(${lodestone} run ${input} --set initial.position_sigma_m=0.1 --out ${WORK}/run)
run(${WORK}/build/localize ${drive}/log.bag ${drive}/platform.yaml ${drive}/cloud.pcd "${pose}" ${WORK}/example.tum)

read_poses(${WORK}/run/smoother/trajectory.tum expected)
read_poses(${WORK}/example.tum poses)
list(LENGTH poses count)
if(count LESS 40)
  message(FATAL_ERROR "expected at least 40 poses, found ${count}")
endif()
if(NOT poses STREQUAL expected)
  message(FATAL_ERROR "${WORK}/example.tum differs from the trajectory of lodestone run")
endif()
file(REMOVE_RECURSE ${WORK})
