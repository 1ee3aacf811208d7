# Cross-building for 64-bit Arm with the distribution's own cross compiler and its arm64 packages:
#
#     dpkg --add-architecture arm64 && apt-get update
#     apt-get install g++-aarch64-linux-gnu libserialport-dev:arm64 libsqlite3-dev:arm64 libfmt-dev:arm64 libtomlplusplus-dev:arm64
#     cmake --preset aarch64 && cmake --build --preset aarch64
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

# Headers without machine code (Eigen, CLI11, doctest, Asio, nlohmann-json) serve both; libraries must be arm64's.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(ENV{PKG_CONFIG_LIBDIR} /usr/lib/aarch64-linux-gnu/pkgconfig:/usr/share/pkgconfig)
# Tests run under qemu-user where it is installed; ask for them with -D MOLDLOFT_TESTS=ON. The geometry library alone
# (-D MOLDLOFT_GEOMETRY_ONLY=ON) needs the compiler and no arm64 package.
set(MOLDLOFT_TESTS OFF CACHE BOOL "Build the tests")
find_program(moldloft_emulator qemu-aarch64)
if(moldloft_emulator)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${moldloft_emulator} -L /usr/aarch64-linux-gnu)
endif()
