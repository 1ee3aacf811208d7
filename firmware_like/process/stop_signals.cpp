#include "firmware_like/process/stop_signals.hpp"

#include <array>
#include <atomic>
#include <cerrno>

namespace moldloft::firmware_like {
namespace {

constexpr std::array stopping{SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPWR, SIGXCPU};
constexpr std::array without_meaning{SIGUSR1, SIGUSR2,   SIGALRM, SIGVTALRM, SIGPROF,
                                     SIGIO,   SIGSTKFLT, SIGTTIN, SIGTTOU};

std::atomic<Stoppable*> running{nullptr};
std::atomic<std::int64_t> asked_at{0};  // on `clock`; 0: not yet
std::atomic<bool> asked_to_suspend{false};
static_assert(decltype(running)::is_always_lock_free && decltype(asked_at)::is_always_lock_free);
hal::SteadyClock clock;

void set(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigemptyset(&action.sa_mask);
  ::sigaction(signal, &action, nullptr);
}

void on_stop(int signal) {
  const int error = errno;
  const std::int64_t now = clock.now().count() + 1;  // never 0
  std::int64_t first = 0;
  if (asked_at.compare_exchange_strong(first, now)) {
    if (Stoppable* r = running.load()) r->stop_for_good();
  } else if (now - first >= StopSignals::one_wish.count()) {
    set(signal, SIG_DFL);
    ::raise(signal);
  }
  errno = error;
}

void on_suspend(int) { asked_to_suspend = true; }

}  // namespace

StopSignals::StopSignals() {
  asked_at = 0;
  asked_to_suspend = false;
  const auto take = [this](int signal, void (*handler)(int)) {
    struct sigaction before {};
    if (::sigaction(signal, nullptr, &before) != 0) return;
    if (signal == SIGHUP && before.sa_handler == SIG_IGN) return;
    before_.emplace_back(signal, before);
    set(signal, handler);
  };
  for (const int signal : stopping) take(signal, on_stop);
  for (const int signal : without_meaning) take(signal, SIG_IGN);
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) take(signal, SIG_IGN);
  take(SIGTSTP, on_suspend);
}

StopSignals::~StopSignals() {
  running = nullptr;
  for (const auto& [signal, action] : before_) ::sigaction(signal, &action, nullptr);
}

void StopSignals::stops(Stoppable* what) noexcept {
  running = what;
  if (what != nullptr && asked()) what->stop_for_good();
}

bool StopSignals::asked() noexcept { return asked_at != 0; }
bool StopSignals::suspension_was_asked() noexcept { return asked_to_suspend.exchange(false); }

}  // namespace moldloft::firmware_like
