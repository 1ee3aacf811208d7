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

# moldloft_part(NAME TYPE PATH... SOURCES ... PUBLIC ... PRIVATE ...): folders or files of the tree as one library.
# Its headers are seen through a folder of its own that holds one link for each path and nothing else: a target that does
# not link the part cannot include from it, so an include against the arrows does not compile.
function(moldloft_part name type)
  cmake_parse_arguments(PART "" "" "PATHS;SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(view ${PROJECT_BINARY_DIR}/rooms/${name})
  foreach(path IN LISTS PART_PATHS)
    cmake_path(GET path PARENT_PATH above)
    file(MAKE_DIRECTORY ${view}/${above})
    file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${path} ${view}/${path} SYMBOLIC)
  endforeach()
  if(NOT PART_SOURCES)  # headers alone
    add_library(moldloft_${name} INTERFACE)
    add_library(moldloft::${name} ALIAS moldloft_${name})
    target_include_directories(moldloft_${name} INTERFACE $<BUILD_INTERFACE:${view}>)
    target_link_libraries(moldloft_${name} INTERFACE ${PART_PUBLIC})
    return()
  endif()
  add_library(moldloft_${name} ${type} ${PART_SOURCES})
  add_library(moldloft::${name} ALIAS moldloft_${name})
  target_include_directories(moldloft_${name} PUBLIC $<BUILD_INTERFACE:${view}>)
  target_link_libraries(moldloft_${name} PUBLIC ${PART_PUBLIC}
    PRIVATE $<BUILD_INTERFACE:moldloft_build_options> ${PART_PRIVATE})
  # A function that is marked as non-blocking and calls what may wait or allocate is an error in every room.
  target_compile_options(moldloft_${name} PRIVATE
    $<$<AND:$<COMPILE_LANG_AND_ID:CXX,Clang>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,20>>:-Werror=function-effects>)
endfunction()

# moldloft_wing(ROOM WING [OBJECT] PUBLIC ... PRIVATE ...): a wing is a folder inside a room, and a library of its own; OBJECT:
# the room archives its wings together. tests/tree reads these lines, holds every include against them and looks for circles.
function(moldloft_wing room wing)
  cmake_parse_arguments(WING "OBJECT" "" "PUBLIC;PRIVATE" ${ARGN})
  set(type STATIC)
  if(WING_OBJECT)
    set(type OBJECT)
  endif()
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${wing}/*.cpp)
  moldloft_part(${room}_${wing} ${type} PATHS ${room}/${wing} SOURCES ${sources}
    PUBLIC ${WING_PUBLIC} PRIVATE ${WING_PRIVATE})
  set_property(GLOBAL APPEND PROPERTY moldloft_wings_of_${room} ${wing})
endfunction()

# moldloft_room(NAME): the room is all of its wings, for those who use it from outside.
function(moldloft_room name)
  get_property(wings GLOBAL PROPERTY moldloft_wings_of_${name})
  add_library(moldloft_${name} INTERFACE)
  add_library(moldloft::${name} ALIAS moldloft_${name})
  list(TRANSFORM wings PREPEND moldloft::${name}_)
  target_link_libraries(moldloft_${name} INTERFACE ${wings})
endfunction()

# moldloft_together(ROOM WING NAME FILES...): what is deployed compiles these files of a wing as one, because most of the time
# goes into the headers that they share (Eigen, JSON, command line). Names that only one of them knows must then differ. Every
# other preset compiles each file alone, and so shows that it stands alone; a file that is named nowhere always does.
option(MOLDLOFT_TOGETHER "Compile files of a wing in groups in every build type" OFF)
function(moldloft_together room wing name)
  if(NOT CMAKE_BUILD_TYPE STREQUAL "Release" AND NOT MOLDLOFT_TOGETHER)
    return()
  endif()
  set(files ${ARGN})
  list(TRANSFORM files PREPEND ${wing}/)
  list(TRANSFORM files APPEND .cpp)
  set_source_files_properties(${files} PROPERTIES UNITY_GROUP ${name})
  set_target_properties(moldloft_${room}_${wing} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
