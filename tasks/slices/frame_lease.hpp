// Says whether anybody still reads a frame. Each reader holds a lease. The next TRIGGER lets the driver reuse
// the buffer, so it waits until no lease is left. A lease moves on with the work: from the look at the shot
// to the reserve or to the fit.
//
// Thread       the control thread only
// Blocking     never
// Allocation   none
// Failure      none; that no lease outlives its lender is asserted
#pragma once

#include <cassert>
#include <utility>

namespace moldloft::tasks {

class FrameLender;

class FrameLease {
 public:
  FrameLease() = default;  // of no frame
  FrameLease(FrameLease&& other) noexcept : lender_{std::exchange(other.lender_, nullptr)} {}
  FrameLease& operator=(FrameLease&& other) noexcept {
    if (this == &other) return *this;
    end();
    lender_ = std::exchange(other.lender_, nullptr);
    return *this;
  }
  ~FrameLease() { end(); }

  void end() noexcept;  // reads no longer; harmless when it has ended
  bool is_held() const noexcept { return lender_ != nullptr; }

 private:
  friend class FrameLender;
  explicit FrameLease(FrameLender& lender) noexcept : lender_{&lender} {}

  FrameLender* lender_ = nullptr;
};

// Stands for the one frame that the driver, or the archive, has given last. It stays where it is: leases point to it.
class FrameLender {
 public:
  FrameLender() = default;
  FrameLender(const FrameLender&) = delete;
  FrameLender& operator=(const FrameLender&) = delete;
  ~FrameLender() { assert(is_free() && "somebody still reads the frame"); }

  FrameLease lend() noexcept {
    ++leases_;
    return FrameLease{*this};
  }
  bool is_free() const noexcept { return leases_ == 0; }

 private:
  friend class FrameLease;
  int leases_ = 0;
};

inline void FrameLease::end() noexcept {
  if (lender_ == nullptr) return;
  assert(lender_->leases_ > 0 && "a lease that nobody gave");
  --lender_->leases_;
  lender_ = nullptr;
}

}  // namespace moldloft::tasks
