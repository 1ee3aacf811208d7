# Cross-building for 64-bit Arm with the distribution's own cross compiler, g++-aarch64-linux-gnu, against the arm64
# libraries that sysroot.sh has unpacked. build.sh does all of it:
#
#     toolchain/aarch64/build.sh
#
# The geometry library alone (-D MOLDLOFT_GEOMETRY_ONLY=ON) needs the compiler and no sysroot.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

set(moldloft_sysroot ${CMAKE_CURRENT_LIST_DIR}/../../build/aarch64-sysroot)
get_filename_component(moldloft_sysroot ${moldloft_sysroot} ABSOLUTE)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
if(EXISTS ${moldloft_sysroot}/.complete)
  set(CMAKE_SYSROOT ${moldloft_sysroot})
  set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
  set(ENV{PKG_CONFIG_SYSROOT_DIR} ${moldloft_sysroot})
  set(ENV{PKG_CONFIG_LIBDIR} ${moldloft_sysroot}/usr/lib/aarch64-linux-gnu/pkgconfig)
  # What a package depends on: the libraries of the sysroot and dpkg's notes on them.
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS
    ${moldloft_sysroot}/usr/lib/aarch64-linux-gnu ${moldloft_sysroot}/lib/aarch64-linux-gnu)
endif()
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)

# Tests run under qemu-user where it is installed; ask for them with -D MOLDLOFT_TESTS=ON.
set(MOLDLOFT_TESTS OFF CACHE BOOL "Build the tests")
find_program(moldloft_emulator qemu-aarch64)
if(moldloft_emulator)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${moldloft_emulator} -L ${moldloft_sysroot})
  if(NOT EXISTS ${moldloft_sysroot}/.complete)
    set(CMAKE_CROSSCOMPILING_EMULATOR ${moldloft_emulator} -L /usr/aarch64-linux-gnu)
  endif()
endif()
