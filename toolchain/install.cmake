# What `cmake --install --component geometry` leaves: the geometry library for other programs, found by
#
#     find_package(moldloft 0.3 REQUIRED)
#     target_link_libraries(... moldloft::geometry)        # and #include "geometry/fit/surface_fit.hpp"
#
# or by `pkg-config --cflags --libs moldloft-geometry`.
#
# It leans on Eigen and the standard library alone. Included at the end of the top CMakeLists.txt.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(moldloft_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/moldloft)

set_target_properties(moldloft_geometry PROPERTIES EXPORT_NAME geometry)
target_include_directories(moldloft_geometry INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/moldloft>)
target_compile_features(moldloft_geometry PUBLIC cxx_std_23)
install(TARGETS moldloft_geometry EXPORT moldloft_targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT geometry)
install(DIRECTORY geometry/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/moldloft/geometry COMPONENT geometry
  FILES_MATCHING PATTERN "*.hpp")
install(EXPORT moldloft_targets NAMESPACE moldloft:: FILE moldloft-targets.cmake
  DESTINATION ${moldloft_package_dir} COMPONENT geometry)

configure_package_config_file(toolchain/package/moldloft-config.cmake.in
  ${PROJECT_BINARY_DIR}/moldloft-config.cmake INSTALL_DESTINATION ${moldloft_package_dir})
# Before 1.0 a minor version may change a signature.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/moldloft-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/moldloft-config.cmake ${PROJECT_BINARY_DIR}/moldloft-config-version.cmake
  DESTINATION ${moldloft_package_dir} COMPONENT geometry)

# The same for whoever asks pkg-config. Its paths are relative to where it lies, so the tree may be moved.
set(pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH moldloft_prefix_from_pc /prefix/${pkgconfig_dir} /prefix)
configure_file(toolchain/package/moldloft-geometry.pc.in ${PROJECT_BINARY_DIR}/moldloft-geometry.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/moldloft-geometry.pc DESTINATION ${pkgconfig_dir} COMPONENT geometry)
