# Run by cpack when everything is laid out and nothing packed yet. CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS does not reach the
# folders that an installed file brings along: under umask 077 they were shut to all but root on the cell's computer.
file(CHMOD_RECURSE ${CPACK_TEMPORARY_DIRECTORY}
  DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
