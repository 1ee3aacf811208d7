#include "host_sim/heap_guard.hpp"

#include <cstdlib>
#include <execinfo.h>
#include <unistd.h>

namespace {

thread_local bool watching = false;
thread_local std::size_t calls = 0;

void seen() noexcept {
  if (!watching) return;
  if (calls++ > 0 || std::getenv("MOLDLOFT_HEAP_STACK") == nullptr) return;
  watching = false;
  void* frames[32];
  backtrace_symbols_fd(frames, backtrace(frames, 32), STDERR_FILENO);
  watching = true;
}

}  // namespace

namespace moldloft::test {

NoHeap::NoHeap() noexcept { watching = true; }
NoHeap::~NoHeap() { watching = false; }
HeapAllowed::HeapAllowed() noexcept : before_{watching} { watching = false; }
HeapAllowed::~HeapAllowed() { watching = before_; }
std::size_t heap_calls() noexcept { return calls; }
void forget_heap_calls() noexcept { calls = 0; }

}  // namespace moldloft::test

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
const bool moldloft::test::heap_guard_works = false;
#else
const bool moldloft::test::heap_guard_works = true;

#define HEAP_CALLED(function) seen()
#include "realtime/heap_entries.hpp"
#endif
