// The hard campaign: plates, devices and configurations that go wrong on purpose, and a judge of honesty. A run
// may be measured, warned of or held. It may not be complete and wrong, nor in doubt for another cause than the
// one that is known.
#pragma once

#include "firmware_like/process/json_text.hpp"
#include "host_sim/runs/campaign.hpp"
#include "host_sim/runs/hard_case.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace moldloft::host_sim {

inline constexpr std::string_view hard_plates = "hard";
inline constexpr SeedRange hard_seeds{1, 400};

struct HardRow {
  std::uint64_t seed = 0;
  std::string cause, what;
  int exit_code = 1;
  std::string said{};                // the message and every finding
  std::vector<std::string> words{};  // the same, one by one
  firmware_like::Json truth = firmware_like::Json::object();
  bool measured() const { return exit_code == 0; }
  bool warned() const;  // measured, with warnings
};

// Complete, and beyond the limits.
bool is_untrue(const HardRow&);
// What was said names the known cause; a run about which nothing was said has nothing to be wrong in.
bool says_cause(const HardRow&);

// What a run's summary says in words: its message, and the text of each finding.
std::vector<std::string> words_of_summary(const firmware_like::Json& summary);

// The program's exit code: 0 when no run is untrue and none failed to run.
int run_hard_campaign(const CampaignOptions&);

}  // namespace moldloft::host_sim
