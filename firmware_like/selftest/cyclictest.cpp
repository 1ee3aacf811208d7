#include "firmware_like/selftest/cyclictest.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <spawn.h>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

std::unexpected<Failure> error(std::string what) { return std::unexpected{Failure{std::move(what)}}; }

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream{path, std::ios::binary}.rdbuf();
  return text.str();
}

std::string last_line(const std::string& text) {
  const auto end = text.find_last_not_of("\r\n ");
  if (end == text.npos) return "it says nothing";
  const auto begin = text.find_last_of("\n", end);
  return text.substr(begin == text.npos ? 0 : begin + 1, end - (begin == text.npos ? 0 : begin + 1) + 1);
}

// Its exit status as waitpid gives it; what it says goes to `log`.
std::expected<int, int> run_program(const std::vector<std::string>& words, const fs::path& log) {
  std::vector<char*> arguments;
  for (const auto& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, arguments[0], &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) return std::unexpected{failed};
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return std::unexpected{errno};
  }
  return status;
}

}  // namespace

CyclictestResult& CyclictestResult::operator+=(const CyclictestResult& turn) {
  latency.merge(turn.latency);
  cycles += turn.cycles;
  beyond += turn.beyond;
  return *this;
}

std::vector<std::string> cyclictest_words(const CyclictestSettings& s, const fs::path& json) {
  std::vector<std::string> words = {"cyclictest",
                                    "--quiet",
                                    fmt::format("--interval={}", s.interval / 1us),
                                    fmt::format("--loops={}", s.cycles),
                                    fmt::format("--histogram={}", cyclictest_histogram_us),
                                    "--histfile=/dev/null",
                                    fmt::format("--json={}", json.string())};
  words.push_back(s.priority > 0 ? "--policy=fifo" : "--policy=other");
  if (s.priority > 0) words.push_back(fmt::format("--priority={}", s.priority));
  if (s.cpu >= 0) words.push_back(fmt::format("--affinity={}", s.cpu));
  if (s.lock_memory) words.push_back("--mlockall");
  return words;
}

std::expected<CyclictestResult, Failure> parse_cyclictest(const std::string& text) {
  const auto j = nlohmann::json::parse(text, nullptr, false);
  const auto not_understood = [](std::string_view what) {
    return error(fmt::format("cyclictest: its JSON has no {}; rt-tests 2.0 or later is needed", what));
  };
  if (!j.is_object() || !j.contains("thread")) return not_understood("thread");
  const auto& thread = j["thread"];
  if (!thread.is_object() || !thread.contains("0")) return not_understood("thread 0");
  const auto& t = thread["0"];
  if (!t.is_object() || !t.contains("histogram") || !t["histogram"].is_object())
    return not_understood("histogram");
  if (!t.contains("cycles") || !t["cycles"].is_number_unsigned()) return not_understood("cycles");
  if (!t.contains("max") || !t["max"].is_number_integer()) return not_understood("max");

  const auto cycles = t["cycles"].get<std::uint64_t>();
  CyclictestResult result;
  result.cycles = cycles;
  const auto add = [&](std::int64_t us, std::uint64_t count) {
    for (; count > 0; --count) result.latency.add(us * 1us + 500ns);
  };
  for (const auto& [us, count] : t["histogram"].items()) {
    char* end = nullptr;
    const auto value = std::strtoll(us.c_str(), &end, 10);
    const bool counts = count.is_number_unsigned() && count.get<std::uint64_t>() <= cycles;
    if (us.empty() || *end != '\0' || value < 0 || !counts) return not_understood("histogram that adds up");
    add(value, count.get<std::uint64_t>());
  }
  if (result.cycles > result.latency.count()) result.beyond = result.cycles - result.latency.count();
  add(t["max"].get<std::int64_t>(), result.beyond);
  return result;
}

std::expected<CyclictestResult, Failure> run_cyclictest(const CyclictestSettings& settings,
                                                        const fs::path& scratch) {
  const fs::path json = scratch / "cyclictest.json", log = scratch / "cyclictest.log";
  const auto status = run_program(cyclictest_words(settings, json), log);
  const std::string said = text_of(log), result = text_of(json);
  std::error_code ignored;
  fs::remove(json, ignored);
  fs::remove(log, ignored);
  if (!status && status.error() == ENOENT)
    return error("cyclictest: not found in PATH; install the package rt-tests, or leave --compare out");
  if (!status) return error(fmt::format("cyclictest: cannot be started ({})", std::strerror(status.error())));
  if (!WIFEXITED(*status) || WEXITSTATUS(*status) != 0 || result.empty())
    return error(fmt::format("cyclictest: failed: {}", last_line(said)));
  return parse_cyclictest(result);
}

}  // namespace moldloft::firmware_like
