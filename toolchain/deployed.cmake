# How what is deployed (build type Release) is compiled, beyond the language: as the distribution compiles its own packages, and
# to the same bytes wherever the tree lies. The presets for development have what serves them instead. Included by rooms.cmake.
if(NOT CMAKE_BUILD_TYPE STREQUAL "Release")
  return()
endif()
include(CheckCXXCompilerFlag)
include(CheckPIESupported)

# A return address that was overwritten, a copy beyond its buffer, or a jump to where no function begins ends the program. A link
# is done with before main(), and its table is then read-only.
check_pie_supported()
set(moldloft_hardening -fstack-protector-strong -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2 -Wformat -Werror=format-security)
foreach(flag -fstack-clash-protection -fcf-protection)  # the second is for amd64 alone
  string(MAKE_C_IDENTIFIER "moldloft_has${flag}" has)
  check_cxx_compiler_flag(${flag} ${has})
  if(${has})
    list(APPEND moldloft_hardening ${flag})
  endif()
endforeach()
add_compile_options(${moldloft_hardening})
add_link_options(-Wl,-z,relro -Wl,-z,now)

# Where the tree lies stands in no file that is made of it.
add_compile_options(-ffile-prefix-map=${PROJECT_SOURCE_DIR}=.)
