#include "firmware_like/run/flight_files.hpp"

#include "firmware_like/process/console.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

namespace moldloft::firmware_like {

std::vector<std::filesystem::path> flight_dumps(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> dumps;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator{folder, failed}) {
    const std::string name = entry.path().filename();
    if (name.starts_with("flight-") && name.ends_with(".bin")) dumps.push_back(entry.path());
  }
  std::ranges::sort(dumps);
  return dumps;
}

FlightFiles::FlightFiles(hal::FlightRecorder& flight, std::filesystem::path folder)
    : flight_{flight}, folder_{std::move(folder)} {
  std::error_code failed;
  while (std::filesystem::exists(folder_ / fmt::format("flight-{:02}.bin", next_), failed)) ++next_;
}

FlightFiles::~FlightFiles() {
  if (flight_.due()) write();
}

void FlightFiles::write_if_frozen() {
  if (flight_.frozen()) write();
}

void FlightFiles::write() {
  const auto path = folder_ / fmt::format("flight-{:02}.bin", next_++);
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  const bool written = file >= 0 && flight_.dump(file);
  if (file >= 0) ::close(file);
  if (!written) {
    say(fmt::format("moldloft: {}: the flight recorder's dump cannot be written; is the disk full?\n",
                    path.string()));
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
  flight_.thaw();
}

namespace {

constexpr std::array<int, 5> fatal_signals{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

// What the handler needs, ready before the signal comes: it may call nothing that allocates.
std::atomic<hal::FlightRecorder*> watched{nullptr};
std::atomic<const tasks::Scheduler*> scheduler{nullptr};
std::array<char, 4096> crash_path{};

void on_fatal(int number) {
  // The second fault, in here or on another thread, ends the program at once.
  std::signal(number, SIG_DFL);
  if (hal::FlightRecorder* flight = watched.exchange(nullptr)) {
    const int file = ::open(crash_path.data(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file >= 0) {
      flight->dump(file, hal::FlightCause::signal, scheduler.load()->running_task(), number);
      ::close(file);
      constexpr char text[] =
          "moldloft: crashed; flight-crash.bin in the run's folder holds the last second "
          "(moldloft replay RUN --timeline)\n";
      [[maybe_unused]] const auto said = ::write(STDERR_FILENO, text, sizeof text - 1);
    }
  }
  ::raise(number);
}

void on_request(int) {
  if (hal::FlightRecorder* flight = watched.load()) flight->request();
}

}  // namespace

CrashDump::CrashDump(hal::FlightRecorder& flight, const tasks::Scheduler& watched_scheduler,
                     const std::filesystem::path& folder) {
  std::error_code failed;  // the folder that the program was started in may be gone
  const auto absolute = std::filesystem::absolute(folder / "flight-crash.bin", failed);
  const std::string path = failed ? folder / "flight-crash.bin" : absolute;
  std::strncpy(crash_path.data(), path.c_str(), crash_path.size() - 1);
  scheduler = &watched_scheduler;
  watched = &flight;
  for (const int number : fatal_signals) std::signal(number, on_fatal);
  std::signal(SIGUSR2, on_request);
}

CrashDump::~CrashDump() {
  watched = nullptr;
  for (const int number : fatal_signals) std::signal(number, SIG_DFL);
  std::signal(SIGUSR2, SIG_IGN);
}

}  // namespace moldloft::firmware_like
