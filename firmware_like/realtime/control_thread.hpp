// The control thread: a thread of its own, so that scheduling, processor and touched stack are its alone. The
// ordinary threads come from the first thread, which has none of it to inherit.
//
// Thread       constructed, begun and joined by one ordinary thread
// Blocking     the constructor waits until the thread has set itself up; join() until the loop has ended
// Allocation   at construction only
// Failure      setup() lists the settings that were refused; std::system_error when no thread can be
//              started at all
#pragma once

#include "firmware_like/realtime/process_setup.hpp"

#include <functional>
#include <semaphore>
#include <sys/types.h>
#include <thread>

namespace moldloft::firmware_like {

class ControlThread {
 public:
  ControlThread(const RealtimeConfig&, std::function<void()> loop);
  ~ControlThread();  // the loop has been begun and has ended, or never runs
  ControlThread(const ControlThread&) = delete;
  ControlThread& operator=(const ControlThread&) = delete;

  void begin();  // the loop runs from now on; once
  void join();   // until it has ended

  const SetupRows& setup() const { return setup_; }
  pid_t id() const { return id_; }

 private:
  void work(const RealtimeConfig&);

  std::function<void()> loop_;
  SetupRows setup_;
  pid_t id_ = 0;
  bool begun_ = false;
  std::binary_semaphore ready_{0}, go_{0};
  std::thread thread_;
};

}  // namespace moldloft::firmware_like
