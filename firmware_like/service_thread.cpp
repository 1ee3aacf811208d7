#include "firmware_like/service_thread.hpp"

#include "firmware_like/display.hpp"

namespace moldloft::firmware_like {

ServiceThread::ServiceThread(const Controller& controller, const std::filesystem::path& run_folder)
    : controller_{controller}, watch_{notify_, run_folder / "watchdog.json"}, thread_{[this] { work(); }} {}

ServiceThread::~ServiceThread() {
  leaving_ = true;
  thread_.join();
}

void ServiceThread::work() {
  const auto& scheduler = controller_.scheduler();
  while (!leaving_) {
    watch_.look({.ticks = scheduler.heartbeat(),
                 .task = scheduler.name_of(scheduler.running_task()),
                 .status = status_line(controller_.cell().progress()),
                 .ended = ended_},
                clock_.now());
    clock_.sleep_until(clock_.now() + ServiceWatch::period);
  }
}

}  // namespace moldloft::firmware_like
