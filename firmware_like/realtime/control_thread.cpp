#include "firmware_like/realtime/control_thread.hpp"

#include <cassert>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

namespace moldloft::firmware_like {

ControlThread::ControlThread(const RealtimeConfig& config, std::function<void()> loop)
    : loop_{std::move(loop)}, thread_{[this, config] { work(config); }} {
  ready_.acquire();
}

ControlThread::~ControlThread() {
  if (!begun_) go_.release();
  join();
}

void ControlThread::begin() {
  assert(!begun_);
  begun_ = true;
  go_.release();
}

void ControlThread::join() {
  if (thread_.joinable()) thread_.join();
}

void ControlThread::work(const RealtimeConfig& config) {
  // Signals meant for the process are taken by a thread that has time for them.
  sigset_t signals;
  sigfillset(&signals);
  for (const int own_fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP})
    sigdelset(&signals, own_fault);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  pthread_setname_np(pthread_self(), "control");
  id_ = ::gettid();
  setup_ = set_up_control_thread(config);
  ready_.release();
  go_.acquire();
  if (begun_) loop_();
}

}  // namespace moldloft::firmware_like
