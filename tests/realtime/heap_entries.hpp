// Defines the C library's heap functions anew, each of which first says HEAP_CALLED(its name): a macro of the one file
// that includes this, at its global scope. Every way to the heap ends at one of them: operator new in libstdc++,
// Eigen's aligned memory, SQLite's, strdup().
//
// glibc's own entry points stand behind them: dlsym() allocates, so its answer cannot be waited for here.
#pragma once

#include <cerrno>
#include <cstddef>

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  HEAP_CALLED(malloc);
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  HEAP_CALLED(calloc);
  return __libc_calloc(n, size);
}
void* realloc(void* old, std::size_t size) {
  HEAP_CALLED(realloc);
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  HEAP_CALLED(memalign);
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  HEAP_CALLED(aligned_alloc);
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  HEAP_CALLED(posix_memalign);
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
void free(void* memory) {
  if (memory != nullptr) HEAP_CALLED(free);
  __libc_free(memory);
}
}
