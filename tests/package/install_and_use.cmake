# Installs the geometry library into a scratch root, builds the program beside this file against it, and runs it.
# Called by ctest with -D BUILD=, SOURCE=, SCRATCH=, GENERATOR=, COMPILER=.
file(REMOVE_RECURSE ${SCRATCH})
foreach(command IN ITEMS
    "${CMAKE_COMMAND};--install;${BUILD};--component;geometry;--prefix;${SCRATCH}/root"
    "${CMAKE_COMMAND};-S;${SOURCE};-B;${SCRATCH}/build;-G;${GENERATOR};-DCMAKE_CXX_COMPILER=${COMPILER};-DCMAKE_PREFIX_PATH=${SCRATCH}/root"
    "${CMAKE_COMMAND};--build;${SCRATCH}/build"
    "${SCRATCH}/build/flat_plate")
  execute_process(COMMAND ${command} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endforeach()
file(REMOVE_RECURSE ${SCRATCH})
