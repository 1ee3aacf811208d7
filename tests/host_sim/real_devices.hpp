// The simulated devices as a process of their own, on a TCP port and a pseudo-terminal, and the command that runs the
// deployed program on them.
#pragma once

#include "hal/temporary_folder.hpp"
#include "host_sim/child_process.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace moldloft::host_sim {

// A run takes 18 s of cell time; the rest is for a machine that does other things too.
constexpr auto run_limit = std::chrono::seconds{90};

// The simulated devices, ready to be connected to.
class Devices {
 public:
  explicit Devices(const std::vector<std::string>& more = {}) : child_{words(folder_, more)} {
    REQUIRE_MESSAGE(child_.prints("ready:", std::chrono::seconds{20}), child_.err());
  }
  std::string config() const { return folder_.file("cell.toml"); }
  // The same with one line replaced, told by its beginning.
  std::string config_with(const std::string& begins, const std::string& line) const {
    std::istringstream lines{text_of(config())};
    std::ofstream changed{folder_.file("changed.toml")};
    for (std::string old; std::getline(lines, old);)
      changed << (old.starts_with(begins) ? line : old) << "\n";
    return folder_.file("changed.toml");
  }

 private:
  static std::vector<std::string> words(const hal::TemporaryFolder& folder,
                                        const std::vector<std::string>& more) {
    std::vector<std::string> all = {
        MOLDLOFT_SIM,         "devices", "--scanner-port",        "0", "--robot-pty",
        folder.file("robot"), "--cell",  folder.file("cell.toml")};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  hal::TemporaryFolder folder_;
  ChildProcess child_;
};

inline std::vector<std::string> run_words(const Devices& devices, const std::string& out,
                                          bool resume = false) {
  std::vector<std::string> words = {MOLDLOFT, "run", devices.config(), "--out", out};
  if (resume) words.push_back("--resume");
  return words;
}

}  // namespace moldloft::host_sim
