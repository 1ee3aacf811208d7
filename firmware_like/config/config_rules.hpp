// What no key of a configuration can say alone: values that contradict each other, and values that are possible but
// look like a slip. One list, for `moldloft run`, which refuses the errors, and for `moldloft check`, which prints all.
//
// A rule is an error only where a run with it cannot measure: what a run could do is at most a warning.
//
// Units        mm, degrees, percent, as the keys say; poses in world
// Thread       any; pure
// Allocation   yes
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

struct CellConfig;

enum class Severity { error, warning };

struct ConfigFinding {
  Severity severity = Severity::error;
  int line = 0;                        // 0: the file has none of the keys
  std::string what;                    // "[robot] baud: ..."
  std::vector<std::string> keys = {};  // "robot.baud", the first being the one that is named
};

std::vector<ConfigFinding> contradictions(const CellConfig&);

// "cell.toml:12: [robot] baud: ..."
std::string finding_text(const std::string& path, const ConfigFinding&);

}  // namespace moldloft::firmware_like
