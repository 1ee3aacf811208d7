#include "geometry/heap_watch.hpp"

#include <atomic>
#include <cstdlib>

namespace {
std::atomic<std::size_t> count{0}, given_back{0};
}

namespace moldloft::test {
std::size_t allocations() noexcept { return count.load(std::memory_order_relaxed); }
std::size_t releases() noexcept { return given_back.load(std::memory_order_relaxed); }
}  // namespace moldloft::test

// Under a sanitizer the allocator is the sanitizer's own: nothing is counted there, and the tests
// that ask pass.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(MOLDLOFT_NO_HEAP_WATCH)
// glibc's own entry points stand behind these names: operator new and Eigen's allocator both end here.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(n, size);
}
void* realloc(void* old, std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(old, size);
}
void free(void* block) {
  if (block != nullptr) given_back.fetch_add(1, std::memory_order_relaxed);
  __libc_free(block);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, size);
}
}
#endif
