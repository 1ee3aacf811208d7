// The ordinary thread that looks at the control loop every 100 ms for as long as it lives (service_watch.hpp).
#pragma once

#include <atomic>
#include <filesystem>
#include <thread>

#include "firmware_like/controller.hpp"
#include "firmware_like/service_watch.hpp"

namespace moldloft::firmware_like {

class ServiceThread {
 public:
  ServiceThread(const Controller&, const std::filesystem::path& run_folder);
  ~ServiceThread();
  ServiceThread(const ServiceThread&) = delete;
  ServiceThread& operator=(const ServiceThread&) = delete;

  void loop_has_ended() { ended_ = true; }  // what is done now needs no ticks

 private:
  void work();
  const Controller& controller_;
  ServiceNotify notify_;
  ServiceWatch watch_;
  hal::SteadyClock clock_;
  std::atomic<bool> ended_{false}, leaving_{false};
  std::thread thread_;
};

}  // namespace moldloft::firmware_like
