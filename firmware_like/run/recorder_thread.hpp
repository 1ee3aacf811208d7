// The ordinary thread that empties the recorder's rings onto the disk every few milliseconds, and writes the
// flight recorder's dumps.
#pragma once

#include "firmware_like/run/flight_files.hpp"
#include "hal/base/clock.hpp"
#include "hal/record/recorder.hpp"
#include "hal/record/run_store.hpp"

#include <atomic>
#include <thread>

namespace moldloft::firmware_like {

class RecorderThread {
 public:
  RecorderThread(hal::Recorder&, hal::RunStore&, FlightFiles&);
  ~RecorderThread();  // empties the rings a last time
  RecorderThread(const RecorderThread&) = delete;
  RecorderThread& operator=(const RecorderThread&) = delete;

 private:
  void work();
  hal::Recorder& recorder_;
  hal::RunStore& store_;
  FlightFiles& flight_;
  hal::SteadyClock clock_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace moldloft::firmware_like
