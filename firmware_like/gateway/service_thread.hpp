// An ordinary thread that looks at the control loop every 100 ms for as long as it lives (service_watch.hpp).
// Where standard error is the journal, it also writes the cell's notices there.
#pragma once

#include "firmware_like/gateway/progress_text.hpp"
#include "firmware_like/gateway/service_watch.hpp"
#include "tasks/progress/cell_port.hpp"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <thread>

namespace moldloft::firmware_like {

struct LoopPulse {
  std::uint64_t ticks = 0;  // the loop's heartbeat
  std::string_view task;    // that is running now; the name outlives the thread
};

class ServiceThread {
 public:
  // `look_at_loop` is called from the thread.
  ServiceThread(tasks::CellPort&, std::function<LoopPulse()> look_at_loop,
                const std::filesystem::path& run_folder, Surroundings);
  ~ServiceThread();
  ServiceThread(const ServiceThread&) = delete;
  ServiceThread& operator=(const ServiceThread&) = delete;

  void loop_has_ended() { ended_ = true; }  // what is done now needs no ticks

 private:
  void work();
  void pass_notices_on();
  tasks::CellPort& cell_;
  const std::function<LoopPulse()> look_at_loop_;
  const Surroundings around_;
  ServiceNotify notify_;
  ServiceWatch watch_;
  hal::SteadyClock clock_;
  std::atomic<bool> ended_{false}, leaving_{false};
  std::thread thread_;
};

}  // namespace moldloft::firmware_like
