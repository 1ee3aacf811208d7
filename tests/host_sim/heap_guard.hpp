// Watches every call of malloc and its relatives, operator new included, on the thread that has switched it on.
// Linked into a program of its own, because it replaces the allocator's entry points.
#pragma once

#include <cstddef>

namespace moldloft::test {

// False under a sanitizer, whose allocator stands where this one would.
extern const bool heap_guard_works;

// While one lives, calls on this thread count; nested ones go on counting.
class NoHeap {
 public:
  NoHeap() noexcept;
  ~NoHeap();
  NoHeap(const NoHeap&) = delete;
  NoHeap& operator=(const NoHeap&) = delete;
};

// While one lives, calls on this thread do not count: for what is not under test but runs inside it.
class HeapAllowed {
 public:
  HeapAllowed() noexcept;
  ~HeapAllowed();
  HeapAllowed(const HeapAllowed&) = delete;
  HeapAllowed& operator=(const HeapAllowed&) = delete;

 private:
  bool before_;
};

// Calls that counted on this thread since they were last forgotten. With MOLDLOFT_HEAP_STACK in the
// environment the first one's stack goes to standard error.
std::size_t heap_calls() noexcept;
void forget_heap_calls() noexcept;

}  // namespace moldloft::test
