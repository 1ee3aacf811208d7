// Rules about several keys of a configuration: values that contradict each other, and values that are
// possible but look like a slip. The list is one. `moldloft run` refuses its errors, `moldloft check`
// prints all findings.
//
// A finding is an error only when no run can measure with it. Otherwise it is at most a warning.
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
