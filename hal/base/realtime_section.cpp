#include "hal/base/realtime_section.hpp"

#if defined(__clang__)
#if __has_feature(realtime_sanitizer)
#include <sanitizer/rtsan_interface.h>
#define MOLDLOFT_HAS_REALTIME_SANITIZER
#endif
#endif

constinit thread_local int moldloft_realtime_section = 0;

namespace moldloft::hal {
namespace {

constinit thread_local int suspended = 0;

void sanitizer_looks_away(bool away) noexcept {
#if defined(MOLDLOFT_HAS_REALTIME_SANITIZER)
  away ? __rtsan_disable() : __rtsan_enable();
#else
  (void)away;
#endif
}

}  // namespace

MOLDLOFT_EFFECTS_UNCHECKED_BEGIN  // the mark is thread-local, which the compiler takes for something that may wait

PromiseSuspended::PromiseSuspended() noexcept
    : before_{moldloft_realtime_section} {
  if (before_ != 0) ++suspended;
  moldloft_realtime_section = 0;
  sanitizer_looks_away(true);
}

PromiseSuspended::~PromiseSuspended() noexcept {
  sanitizer_looks_away(false);
  moldloft_realtime_section = before_;
}

MOLDLOFT_EFFECTS_UNCHECKED_END

int PromiseSuspended::suspensions() noexcept { return suspended; }

}  // namespace moldloft::hal
