// The control thread's promise, written so that tools can check it: no waiting, no lock, no heap.
//
// MOLDLOFT_NONBLOCKING stands on every function of the control path, between its parameters (const,
// noexcept) and `override`. Clang's -Wfunction-effects then refuses to compile a call of anything that might
// wait or allocate. RealtimeSanitizer stops a program in which such a function does so all the same. Other
// compilers see nothing.
//
// Two ways lead around these checks, each use with its reason beside it:
//
//   checked_at_run_time   the compiler cannot see through a library (an unmarked declaration, a branch that throws and
//                         is never taken); the sanitizer and the guards of tests/realtime go on watching. Where that
//                         holds for a whole file of arithmetic, MOLDLOFT_CHECKED_AT_RUN_TIME stands at its head
//   answered_at_once      a system call that comes back at once by the state of its descriptor, which the sanitizer
//                         cannot know: a read of a non-blocking socket. Nowhere else is the sanitizer told to look away
#pragma once

#include <utility>

#if defined(__clang__)
#if __has_cpp_attribute(clang::nonblocking)
#define MOLDLOFT_NONBLOCKING [[clang::nonblocking]]
#define MOLDLOFT_EFFECTS_UNCHECKED_BEGIN \
  _Pragma("clang diagnostic push") _Pragma("clang diagnostic ignored \"-Wfunction-effects\"")
#define MOLDLOFT_EFFECTS_UNCHECKED_END _Pragma("clang diagnostic pop")
#define MOLDLOFT_CHECKED_AT_RUN_TIME _Pragma("clang diagnostic ignored \"-Wfunction-effects\"")
#endif
#if __has_feature(realtime_sanitizer)
#include <sanitizer/rtsan_interface.h>
#define MOLDLOFT_SANITIZER_LOOKS_AWAY const __rtsan::ScopedDisabler sanitizer_looks_away;
#endif
#endif

#if !defined(MOLDLOFT_NONBLOCKING)
#define MOLDLOFT_NONBLOCKING
#define MOLDLOFT_EFFECTS_UNCHECKED_BEGIN
#define MOLDLOFT_EFFECTS_UNCHECKED_END
#define MOLDLOFT_CHECKED_AT_RUN_TIME
#endif
#if !defined(MOLDLOFT_SANITIZER_LOOKS_AWAY)
#define MOLDLOFT_SANITIZER_LOOKS_AWAY
#endif

namespace moldloft::hal {

MOLDLOFT_EFFECTS_UNCHECKED_BEGIN

template <typename Call>
decltype(auto) checked_at_run_time(Call&& call) noexcept MOLDLOFT_NONBLOCKING {
  return std::forward<Call>(call)();
}

template <typename Call>
decltype(auto) answered_at_once(Call&& call) noexcept MOLDLOFT_NONBLOCKING {
  MOLDLOFT_SANITIZER_LOOKS_AWAY
  return std::forward<Call>(call)();
}

MOLDLOFT_EFFECTS_UNCHECKED_END

}  // namespace moldloft::hal
