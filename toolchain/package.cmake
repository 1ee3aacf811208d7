# What `cpack` makes of a build tree: the Debian package of the controller.
#
#     cmake --preset release && cmake --build --preset release --target moldloft
#     (cd build/release && cpack)                                  # leaves moldloft_VERSION_ARCHITECTURE.deb there
#
# One component, `controller`; the geometry library is for other programs and stays out (install.cmake). Included at the
# end of the top CMakeLists.txt.
set(package ${PROJECT_SOURCE_DIR}/toolchain/package)
set(documents ${CMAKE_INSTALL_DATAROOTDIR}/doc/moldloft)

install(TARGETS moldloft RUNTIME DESTINATION bin COMPONENT controller)
install(FILES ${package}/moldloft@.service DESTINATION lib/systemd/system COMPONENT controller)
install(FILES ${package}/60-moldloft.rules ${package}/91-moldloft-braille.rules DESTINATION lib/udev/rules.d COMPONENT controller)
install(FILES ${package}/sysusers.conf RENAME moldloft.conf DESTINATION lib/sysusers.d COMPONENT controller)
# The file that explains every key is the configuration that is installed: there is no second one to grow old.
install(FILES firmware_like/cell.example.toml RENAME cell.toml DESTINATION /etc/moldloft COMPONENT controller)

# gzip as the distribution's own pages are, without a date; made when CMake configures.
function(install_compressed file name destination)
  execute_process(COMMAND gzip -9n -c ${file} OUTPUT_FILE ${PROJECT_BINARY_DIR}/package/${name} COMMAND_ERROR_IS_FATAL ANY)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  install(FILES ${PROJECT_BINARY_DIR}/package/${name} DESTINATION ${destination} COMPONENT controller)
endfunction()
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/package)
install_compressed(${package}/moldloft.1 moldloft.1.gz ${CMAKE_INSTALL_DATAROOTDIR}/man/man1)
install_compressed(${package}/changelog changelog.gz ${documents})

install(FILES ${package}/copyright hal/PROTOCOLS.md toolchain/TUNING.md DESTINATION ${documents} COMPONENT controller)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME moldloft)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "Moldloft developers <moldloft@localhost>")  # dpkg wants an address, and there is none to give
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL controller)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_CONTROLLER_PACKAGE_NAME moldloft)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# systemd-sysusers makes the user, udevadm is asked to read the rule; on a machine without systemd neither is missed.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "systemd")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "controller of a cell that measures formed ship plates")
set(CPACK_COMPONENT_CONTROLLER_DESCRIPTION
"A robot carries a laser-stripe scanner to a plate, finds its edge, walks
round it and sweeps it; the result is the outline and the surface as one
B-spline, also as STEP and IGES, with the timing of the run.

The package holds the program, a hardened systemd unit, a configuration
that explains every key, a rule that names the serial port of the robot,
and a guide to a quiet machine.")
set(CPACK_DEBIAN_CONTROLLER_PACKAGE_CONTROL_EXTRA
  ${package}/postinst ${package}/prerm ${package}/postrm ${package}/conffiles)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
