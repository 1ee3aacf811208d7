# Read by cpack before it packs (CPACK_PROJECT_CONFIG_FILE).
if(NOT CPACK_GENERATOR STREQUAL "DEB")
  return()
endif()

# Without these cpack would go on: without `file`, halfway; without dpkg-shlibdeps, to a package that names nothing it needs.
foreach(program file dpkg-shlibdeps strip)
  find_program(path_of_${program} ${program} NO_CACHE NO_DEFAULT_PATH PATHS ENV PATH)
  if(NOT path_of_${program})
    message(FATAL_ERROR "cpack: ${program} is missing, so the packages would be broken; toolchain/setup.sh installs it")
  endif()
endforeach()

# The same tree makes the same bytes: what is packed bears the date of the version, as the distribution's packages do.
if(NOT DEFINED ENV{SOURCE_DATE_EPOCH})
  file(STRINGS ${CPACK_MOLDLOFT_CHANGELOG} signed REGEX "^ -- ")
  list(GET signed 0 signed)
  string(REGEX REPLACE "^.*>  " "" date "${signed}")
  execute_process(COMMAND date -u -d "${date}" +%s OUTPUT_VARIABLE seconds OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  set(ENV{SOURCE_DATE_EPOCH} ${seconds})
endif()
