// Notices on their way from the control thread to one other.
//
// Thread       push(): the control thread. pop(): one other thread
// Blocking     never; no locks
// Allocation   none
// Failure      a full queue drops the newest: the run store has all of them
#pragma once

#include "tasks/progress/notice.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <optional>

namespace moldloft::tasks {

class NoticeQueue {
 public:
  void push(const Notice& notice) noexcept {
    const auto written = written_.load(std::memory_order_relaxed);
    if (written - read_.load(std::memory_order_acquire) == notices_.size()) return;
    notices_[written % notices_.size()] = notice;
    written_.store(written + 1, std::memory_order_release);
  }
  std::optional<Notice> pop() noexcept {
    const auto read = read_.load(std::memory_order_relaxed);
    if (read == written_.load(std::memory_order_acquire)) return std::nullopt;
    const Notice notice = notices_[read % notices_.size()];
    read_.store(read + 1, std::memory_order_release);
    return notice;
  }

 private:
  std::array<Notice, 64> notices_{};
  std::atomic<std::size_t> written_{0}, read_{0};
};

}  // namespace moldloft::tasks
