// The ordinary thread that looks at the control loop every 100 ms for as long as it lives (service_watch.hpp), and
// hands what the cell has noted to the journal, where standard error is one.
#pragma once

#include "firmware_like/gateway/progress_text.hpp"
#include "firmware_like/gateway/service_watch.hpp"
#include "tasks/cell/cell.hpp"

#include <atomic>
#include <filesystem>
#include <thread>

namespace moldloft::firmware_like {

class ServiceThread {
 public:
  ServiceThread(tasks::Cell&, const tasks::Scheduler&, const std::filesystem::path& run_folder, Surroundings);
  ~ServiceThread();
  ServiceThread(const ServiceThread&) = delete;
  ServiceThread& operator=(const ServiceThread&) = delete;

  void loop_has_ended() { ended_ = true; }  // what is done now needs no ticks

 private:
  void work();
  void pass_notices_on();
  tasks::Cell& cell_;
  const tasks::Scheduler& scheduler_;
  const Surroundings around_;
  ServiceNotify notify_;
  ServiceWatch watch_;
  hal::SteadyClock clock_;
  std::atomic<bool> ended_{false}, leaving_{false};
  std::thread thread_;
};

}  // namespace moldloft::firmware_like
