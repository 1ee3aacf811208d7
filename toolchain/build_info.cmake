# Writes the one source file that knows which build this is: version, commit, compiler. Run by every build:
#
#     cmake -D SOURCE=... -D VERSION=... -D BUILD=... -D OUT=... -P build_info.cmake
#
# The file is replaced only when its content changes, so a new commit compiles one file and links again. No date and no
# machine's name go in: the same commit gives the same bytes.

# `git archive` fills this in, so that a tarball knows its commit where there is no repository.
set(archived "$Format:%H$")

set(commit unknown)
if(archived MATCHES "^[0-9a-f]+$")
  string(SUBSTRING ${archived} 0 12 commit)
endif()
find_program(git git)
if(git)
  # A tree that was unpacked inside somebody else's repository does not have that one's commit.
  execute_process(COMMAND ${git} -c safe.directory=* -C ${SOURCE} rev-parse --show-toplevel
    OUTPUT_VARIABLE top OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE no_repository)
  if(no_repository EQUAL 0)
    file(REAL_PATH "${top}" top)
    file(REAL_PATH "${SOURCE}" source)
  endif()
  if(no_repository EQUAL 0 AND top STREQUAL source)
    execute_process(COMMAND ${git} -c safe.directory=* -C ${SOURCE} rev-parse --short=12 HEAD
      OUTPUT_VARIABLE head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE no_commit)
    execute_process(COMMAND ${git} -c safe.directory=* --no-optional-locks -C ${SOURCE} status --porcelain --untracked-files=no
      OUTPUT_VARIABLE changed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(no_commit EQUAL 0)
      set(commit ${head})
      if(changed)
        string(APPEND commit "-dirty")
      endif()
    endif()
  endif()
endif()

set(text "// Written by toolchain/build_info.cmake.
#include \"firmware_like/process/build_info.hpp\"

namespace moldloft::firmware_like {

const BuildInfo& build_info() {
  static constexpr BuildInfo info{\"${VERSION}\", \"${commit}\", \"${BUILD}\"};
  return info;
}

}  // namespace moldloft::firmware_like
")
set(before "")
if(EXISTS ${OUT})
  file(READ ${OUT} before)
endif()
if(NOT text STREQUAL before)
  file(WRITE ${OUT} "${text}")
endif()
