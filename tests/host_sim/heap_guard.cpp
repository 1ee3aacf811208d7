#include "host_sim/heap_guard.hpp"

#include <execinfo.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

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

// glibc's own entry points stand behind these names. Every way to the heap ends at one of them: operator new in
// libstdc++, Eigen's aligned memory, SQLite's, strdup().
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  seen();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  seen();
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  seen();
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  seen();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  seen();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  seen();
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
void free(void* memory) {
  if (memory != nullptr) seen();
  __libc_free(memory);
}
}
#endif
