#include "tasks/cell/disk_wait.hpp"

#include <algorithm>
#include <string_view>

namespace moldloft::tasks {

using namespace std::chrono_literals;

namespace {

// A disk may stall for seconds while it writes back what it has taken. The arm stands meanwhile, and
// nothing is reported.
constexpr hal::Duration longest_without_room = 5s;

// A path goes first where a message has no place for all of it: what is wrong stands at the end.
hal::Message end_of(std::string_view text) MOLDLOFT_NONBLOCKING {
  constexpr std::size_t kept = 100;
  if (text.size() <= kept) return text;
  text.remove_prefix(text.size() - kept);
  while (!text.empty() && (static_cast<unsigned char>(text.front()) & 0xC0u) == 0x80u) text.remove_prefix(1);
  return hal::Message::format("...{}", text);
}

hal::Message waiting_for_room(std::string_view why, hal::Duration limit) MOLDLOFT_NONBLOCKING {
  if (limit == hal::Duration::max())
    return hal::Message::format("{}; waiting until there is room (stop ends the run)", end_of(why).view());
  return hal::Message::format("{}; waiting {} s for room (ctrl-C ends the run)", end_of(why).view(),
                              limit / 1s);
}

}  // namespace

void DiskWait::hold_without_room() {
  if (recorder_.room_for_frame()) {
    no_room_since_ = hal::Instant::max();
    return;
  }
  const hal::Instant now = supervisor_.now();
  no_room_since_ = std::min(no_room_since_, now);
  if (recorder_.store_failed()) {
    supervisor_.hold(HoldCause::recorder,
                     waiting_for_room(recorder_.store_error().view(), settings_.disk_wait));
  } else if (now - no_room_since_ > longest_without_room) {
    supervisor_.hold(HoldCause::recorder,
                     waiting_for_room("the disk does not take what is measured: too slow, or it hangs",
                                      settings_.disk_wait));
  }
}

// Goes on when there is room. Where nobody could say so, not for ever.
void DiskWait::step_held() {
  if (recorder_.room_for_frame()) return supervisor_.take_up_again();
  if (supervisor_.in_state() <= settings_.disk_wait) return;
  const hal::Message error =
      recorder_.store_failed() ? recorder_.store_error() : hal::Message{"the disk hangs"};
  supervisor_.hold(HoldCause::person, hal::Message::format("nothing could be stored for {} s: {}",
                                                           settings_.disk_wait / 1s, end_of(error).view()));
}

}  // namespace moldloft::tasks
