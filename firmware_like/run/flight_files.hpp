// The flight recorder's dumps in a run's folder. An ordinary thread writes flight-01.bin and on, each when
// the ring has frozen. A signal handler writes flight-crash.bin when the program dies.
//
// Thread       FlightFiles: the ordinary thread that owns it. CrashDump: constructed and destroyed on one ordinary
//              thread while no other is; its handler runs wherever the signal comes
// Blocking     write_if_frozen() writes a file of 0.3 MB
// Allocation   at construction and in write_if_frozen(); the handler none
// Failure      a dump that cannot be written is one line on standard error, and the recorder runs on
#pragma once

#include "hal/record/flight_recorder.hpp"
#include "tasks/scheduler/scheduler.hpp"

#include <filesystem>
#include <vector>

namespace moldloft::firmware_like {

// The dumps in a folder, in order.
std::vector<std::filesystem::path> flight_dumps(const std::filesystem::path& folder);

class FlightFiles {
 public:
  FlightFiles(hal::FlightRecorder&, std::filesystem::path folder);
  ~FlightFiles();  // writes what was triggered and had not frozen yet: the run has ended before its ticks were over
  FlightFiles(const FlightFiles&) = delete;
  FlightFiles& operator=(const FlightFiles&) = delete;

  void write_if_frozen();

 private:
  void write();
  hal::FlightRecorder& flight_;
  std::filesystem::path folder_;
  int next_ = 1;  // a resumed run goes on counting
};

// While one lives: SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT (the last is also what a service manager's watchdog
// sends) leave a dump that names the running task, then do what they would have done; SIGUSR2 asks for a dump and
// ends nothing. One at a time.
class CrashDump {
 public:
  CrashDump(hal::FlightRecorder&, const tasks::Scheduler&, const std::filesystem::path& folder);
  ~CrashDump();
  CrashDump(const CrashDump&) = delete;
  CrashDump& operator=(const CrashDump&) = delete;
};

}  // namespace moldloft::firmware_like
