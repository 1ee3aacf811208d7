# What `cpack` makes of a build tree: the Debian packages.
#
#     toolchain/package.sh                    # sets up, builds, and leaves them in build/release/
#     (cd build/release && cpack)             # the last step alone; before it: cmake --build --preset release --target packaged
#
# Component `controller` is the package moldloft, for the cell's computer; `simulation` is moldloft-sim, simulated devices for a
# rehearsal there; `geometry` is libmoldloft-geometry-dev, for programs of others (install.cmake); `cad` is moldloft-cad, which
# reads CAD files and is made where OpenCASCADE is installed.
#
# Included at the end of the top CMakeLists.txt.
set(package ${PROJECT_SOURCE_DIR}/toolchain/package)
set(documents ${CMAKE_INSTALL_DATAROOTDIR}/doc)
set(manuals ${CMAKE_INSTALL_DATAROOTDIR}/man/man1)

# Everything that a package holds, and nothing else.
add_custom_target(packaged DEPENDS moldloft moldloft-sim pty_modem moldloft_geometry)

install(TARGETS moldloft RUNTIME DESTINATION bin COMPONENT controller)
install(FILES ${package}/moldloft@.service DESTINATION lib/systemd/system COMPONENT controller)
install(FILES ${package}/60-moldloft.rules ${package}/91-moldloft-braille.rules DESTINATION lib/udev/rules.d COMPONENT controller)
install(FILES ${package}/sysusers.conf RENAME moldloft.conf DESTINATION lib/sysusers.d COMPONENT controller)
# The file that explains every key is the configuration that is installed: there is no second one to grow old.
# Under another prefix than the package's it stays below that prefix, so that cmake --install needs no root.
install(CODE "
  set(configuration \${CMAKE_INSTALL_PREFIX}/etc/moldloft)
  if(CMAKE_INSTALL_PREFIX STREQUAL /usr)
    set(configuration /etc/moldloft)
  endif()
  file(INSTALL \"${PROJECT_SOURCE_DIR}/firmware_like/cell.example.toml\" RENAME cell.toml DESTINATION \${configuration})"
  COMPONENT controller)
install(FILES hal/PROTOCOLS.md toolchain/TUNING.md toolchain/SECURITY.md toolchain/TROUBLESHOOTING.md
  DESTINATION ${documents}/moldloft COMPONENT controller)
# bash looks for a program's completion under the program's name.
set(completions ${CMAKE_INSTALL_DATAROOTDIR}/bash-completion/completions)
install(FILES ${package}/moldloft.bash RENAME moldloft DESTINATION ${completions} COMPONENT controller)
install(FILES ${package}/moldloft.bash RENAME moldloft-sim DESTINATION ${completions} COMPONENT simulation)

# The preloaded shim is the simulation's alone, in a folder where no other program looks for libraries.
install(TARGETS moldloft-sim RUNTIME DESTINATION bin COMPONENT simulation)
install(TARGETS pty_modem LIBRARY DESTINATION lib/moldloft COMPONENT simulation)
install(PROGRAMS ${package}/moldloft-rehearse DESTINATION bin COMPONENT simulation)

if(TARGET moldloft-cad)
  add_dependencies(packaged moldloft-cad)
  install(TARGETS moldloft-cad RUNTIME DESTINATION bin COMPONENT cad)
  install(FILES ${package}/moldloft.bash RENAME moldloft-cad DESTINATION ${completions} COMPONENT cad)
endif()

# gzip as the distribution's own pages are, without a date; made when CMake configures.
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/package)
function(install_compressed file name destination component)
  execute_process(COMMAND gzip -9n -c ${file} OUTPUT_FILE ${PROJECT_BINARY_DIR}/package/${name} COMMAND_ERROR_IS_FATAL ANY)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  install(FILES ${PROJECT_BINARY_DIR}/package/${name} DESTINATION ${destination} COMPONENT ${component})
endfunction()
file(GLOB pages CONFIGURE_DEPENDS RELATIVE ${package} ${package}/*.1)
foreach(page ${pages})
  set(component controller)
  if(page MATCHES "sim|rehearse")
    set(component simulation)
  elseif(page MATCHES "cad")
    if(NOT TARGET moldloft-cad)
      continue()
    endif()
    set(component cad)
  endif()
  install_compressed(${package}/${page} ${page}.gz ${manuals} ${component})
endforeach()

set(packages_controller moldloft)
set(packages_simulation moldloft-sim)
set(packages_geometry libmoldloft-geometry-dev)
set(packages_cad moldloft-cad)
set(components controller simulation geometry)
if(TARGET moldloft-cad)
  list(APPEND components cad)
endif()
foreach(component ${components})
  install_compressed(${package}/changelog changelog.gz ${documents}/${packages_${component}} ${component})
  install(FILES ${package}/copyright DESTINATION ${documents}/${packages_${component}} COMPONENT ${component})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME moldloft)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "Moldloft developers <moldloft@packages.invalid>")  # dpkg wants an address, and there is none to give
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL ${components})
# The rights of folders are the packages' own, whatever the umask of who builds them.
set(CPACK_PRE_BUILD_SCRIPTS ${package}/rights.cmake)
# Refuses what would come out wrong without a word, and dates the packages by the changelog.
set(CPACK_PROJECT_CONFIG_FILE ${package}/before_cpack.cmake)
set(CPACK_MOLDLOFT_CHANGELOG ${package}/changelog)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package's own is the first line of its description

set(CPACK_DEBIAN_CONTROLLER_PACKAGE_NAME moldloft)
set(CPACK_DEBIAN_CONTROLLER_PACKAGE_SECTION science)
# systemd-sysusers makes the user, udevadm is asked to read the rule; on a machine without systemd neither is missed.
set(CPACK_DEBIAN_CONTROLLER_PACKAGE_RECOMMENDS "systemd")
set(CPACK_DEBIAN_CONTROLLER_PACKAGE_SUGGESTS "moldloft-sim, moldloft-cad")
set(CPACK_COMPONENT_CONTROLLER_DESCRIPTION
"controller of a cell that measures formed ship plates
A robot carries a laser-stripe scanner to a plate, finds its edge, walks
round it and sweeps it; the result is the outline and the surface as one
B-spline, also as STEP and IGES, with the timing of the run.

The package holds the program, a hardened systemd unit, a configuration
that explains every key, a rule that names the serial port of the robot,
and a guide to a quiet machine.")
set(CPACK_DEBIAN_CONTROLLER_PACKAGE_CONTROL_EXTRA
  ${package}/postinst ${package}/prerm ${package}/postrm ${package}/conffiles)

set(CPACK_DEBIAN_SIMULATION_PACKAGE_NAME moldloft-sim)
set(CPACK_DEBIAN_SIMULATION_PACKAGE_SECTION science)
set(CPACK_DEBIAN_SIMULATION_PACKAGE_DEPENDS "moldloft (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_SIMULATION_DESCRIPTION
"simulated devices for the controller moldloft
Simulated devices for a rehearsal on the computer of the cell: a scanner
on loopback TCP and a robot on a pseudo-terminal, served in real time to
the installed controller. moldloft-rehearse measures one simulated plate
and says how far the result is from the truth.")

set(CPACK_DEBIAN_CAD_PACKAGE_NAME moldloft-cad)
set(CPACK_DEBIAN_CAD_PACKAGE_SECTION science)
set(CPACK_DEBIAN_CAD_PACKAGE_DEPENDS "moldloft (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_CAD_DESCRIPTION
"designs of plates from STEP and IGES files, for moldloft
Reads the B-spline faces of CAD files, trimmed or not, for the command
moldloft inspect, which compares a measured plate with its design. It is a
package of its own because it needs OpenCASCADE, which is larger than all
the rest.")

set(CPACK_DEBIAN_GEOMETRY_PACKAGE_NAME libmoldloft-geometry-dev)
set(CPACK_DEBIAN_GEOMETRY_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_GEOMETRY_PACKAGE_SHLIBDEPS OFF)  # headers and a static library: what it needs is needed when one compiles
set(CPACK_DEBIAN_GEOMETRY_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4)")
set(CPACK_COMPONENT_GEOMETRY_DESCRIPTION
"splines, fits and CAD files of measured plates, for programs
Splines, edges of stripes, surface fits, inspection, STEP and IGES, for
programs in C++23: a static library with headers that leans on Eigen alone,
found with find_package(moldloft).")
include(CPack)
