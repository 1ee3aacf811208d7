// Which build this is. The function's body is written by toolchain/build_info.cmake when the programs are compiled.
//
// Thread       any
// Allocation   none but in version_text
#pragma once

#include <string>
#include <string_view>

namespace moldloft::firmware_like {

struct BuildInfo {
  std::string_view version;  // "0.3.0"
  std::string_view
      commit;  // twelve digits; "-dirty" after them where the tree had changes; "unknown" without one
  std::string_view build;  // "Release, GNU 12.2.0, x86_64"
};
const BuildInfo& build_info();

// "0.3.0 (commit 0123456789ab; Release, GNU 12.2.0, x86_64)"
inline std::string version_text() {
  const BuildInfo& info = build_info();
  return std::string{info.version} + " (commit " + std::string{info.commit} + "; " + std::string{info.build} +
         ")";
}

}  // namespace moldloft::firmware_like
