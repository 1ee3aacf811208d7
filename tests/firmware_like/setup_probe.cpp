// Sets the process up as far as it may, then asks for memory and threads as a program does later on, and says
// what it got.
#include "firmware_like/realtime/process_setup.hpp"

#include <fmt/format.h>

#include <fstream>
#include <thread>
#include <vector>

using namespace moldloft::firmware_like;

int main() {
  const ProcessSetup process{{.cpu_latency_us = -1}};
  std::string locked = "0";
  std::ifstream file{"/proc/self/status"};
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("VmLck:")) locked = std::to_string(std::stol(line.substr(6)));
  }
  bool grown = true;
  try {
    const std::vector<char> large(64 << 20, 1);
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) threads.emplace_back([] {});
  } catch (const std::exception&) {
    grown = false;
  }
  for (const auto& row : process.rows()) {
    if (row.item != SetupItem::memory_lock) continue;
    fmt::print("{{\"got\": \"{}\", \"ok\": {}, \"hint\": \"{}\", \"locked_kib\": {}, \"grown\": {}}}\n",
               row.got, row.ok, row.hint, locked, grown);
  }
}
