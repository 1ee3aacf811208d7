#include "firmware_like/run/recorder_thread.hpp"

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;

// A frame takes 30 ms on a 100 Mb/s link, the rings hold four: at this period they stay nearly empty, and a transaction
// still gathers enough to be worth its sync.
constexpr auto drain_period = 10ms;

}  // namespace

RecorderThread::RecorderThread(hal::Recorder& recorder, hal::RunStore& store, FlightFiles& flight)
    : recorder_{recorder}, store_{store}, flight_{flight}, thread_{[this] { work(); }} {}

RecorderThread::~RecorderThread() {
  ending_ = true;
  thread_.join();
}

void RecorderThread::work() {
  while (!ending_) {
    recorder_.drain(store_);
    flight_.write_if_frozen();
    clock_.sleep_until(clock_.now() + drain_period);
  }
  recorder_.drain(store_);
}

}  // namespace moldloft::firmware_like
