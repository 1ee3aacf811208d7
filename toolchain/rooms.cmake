# What every room of the house shares: language, warnings, and the rule that includes point one way.

set(CMAKE_CXX_STANDARD 23)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib)

include(${CMAKE_CURRENT_LIST_DIR}/deployed.cmake)

add_library(moldloft_build_options INTERFACE)
target_compile_options(moldloft_build_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wnon-virtual-dtor;-Woverloaded-virtual>
  # A fused multiply-add rounds once where two operations round twice: with contraction on, a seed would mean
  # different bytes on different machines.
  -ffp-contract=off)

# moldloft_room(NAME SOURCES ... PUBLIC ... PRIVATE ...): one room as one static library.
# A room's headers are seen through a folder of its own that holds one link, to that room alone: a target that does
# not link a room cannot include from it, so an include against the arrows does not compile.
function(moldloft_room name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(view ${PROJECT_BINARY_DIR}/rooms/${name})
  file(MAKE_DIRECTORY ${view})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${name} ${view}/${name} SYMBOLIC)
  add_library(moldloft_${name} STATIC ${ROOM_SOURCES})
  add_library(moldloft::${name} ALIAS moldloft_${name})
  target_include_directories(moldloft_${name} PUBLIC $<BUILD_INTERFACE:${view}>)
  target_link_libraries(moldloft_${name} PUBLIC ${ROOM_PUBLIC}
    PRIVATE $<BUILD_INTERFACE:moldloft_build_options> ${ROOM_PRIVATE})
  # A function that is marked as non-blocking and calls what may wait or allocate is an error in every room.
  target_compile_options(moldloft_${name} PRIVATE
    $<$<AND:$<COMPILE_LANG_AND_ID:CXX,Clang>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,20>>:-Werror=function-effects>)
endfunction()

# moldloft_together(ROOM NAME FILES...): what is deployed compiles these files of a room as one, because most of the time goes into
# the headers that they share (Eigen, JSON, command line). Names that only one of them knows must then differ. Every other
# preset compiles each file alone, and so shows that it stands alone; a file that is named nowhere always does.
option(MOLDLOFT_TOGETHER "Compile files of a room in groups in every build type" OFF)
function(moldloft_together room name)
  if(NOT CMAKE_BUILD_TYPE STREQUAL "Release" AND NOT MOLDLOFT_TOGETHER)
    return()
  endif()
  set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${name})
  set_target_properties(moldloft_${room} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
