#include "hal/links/cable.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <vector>

namespace moldloft::hal {
namespace {

// Bytes on their way in one direction. What is written back to back leaves as one stretch at the line's rate;
// the arrival of each byte follows from the stretch's start.
class Wire {
 public:
  explicit Wire(const Cable::Settings& settings)
      : bytes_(settings.capacity_bytes),
        ns_per_byte_{1e9 / settings.bytes_per_second},
        delay_{settings.delay} {
    assert(settings.capacity_bytes > 0 && settings.bytes_per_second > 0 && settings.delay >= 0ns);
  }

  std::size_t write(Instant now, std::span<const std::byte> in) noexcept {
    const std::size_t count = std::min(in.size(), bytes_.size() - (written_ - read_));
    if (count == 0) return 0;
    if (stretch_count_ == 0 || now > free_at(last_stretch())) {
      if (stretch_count_ == stretches_.size()) return 0;  // as if the line were full
      stretches_[(first_stretch_ + stretch_count_) % stretches_.size()] = {.start = now, .begin = written_};
      ++stretch_count_;
    }
    copy_in(in.first(count));
    written_ += count;
    last_stretch().end = written_;
    return count;
  }

  std::size_t read(Instant now, std::span<std::byte> out) noexcept {
    std::size_t moved = 0;
    while (stretch_count_ > 0 && moved < out.size()) {
      const Stretch& stretch = stretches_[first_stretch_];
      const std::uint64_t arrived = arrived_by(stretch, now);
      const auto count =
          static_cast<std::size_t>(std::min<std::uint64_t>(arrived - read_, out.size() - moved));
      copy_out(out.subspan(moved, count));
      read_ += count;
      moved += count;
      if (read_ < stretch.end || now < free_at(stretch)) break;
      first_stretch_ = (first_stretch_ + 1) % stretches_.size();
      --stretch_count_;
    }
    return moved;
  }

  void clear() noexcept {
    read_ = written_;
    stretch_count_ = 0;
  }

 private:
  struct Stretch {
    Instant start{0};
    std::uint64_t begin = 0, end = 0;  // counted in all bytes ever written
  };

  Stretch& last_stretch() noexcept {
    return stretches_[(first_stretch_ + stretch_count_ - 1) % stretches_.size()];
  }
  Duration transfer_time(std::uint64_t count) const noexcept {
    return Duration{std::llround(static_cast<double>(count) * ns_per_byte_)};
  }
  Instant free_at(const Stretch& stretch) const noexcept {
    return stretch.start + transfer_time(stretch.end - stretch.begin);
  }
  // A byte has arrived when its last bit has: byte k of a stretch at start + delay + (k + 1) byte times.
  std::uint64_t arrived_by(const Stretch& stretch, Instant now) const noexcept {
    const Duration since = now - stretch.start - delay_;
    if (since < 0ns) return stretch.begin;
    const auto guess = static_cast<std::uint64_t>(static_cast<double>(since.count()) / ns_per_byte_);
    std::uint64_t count = std::min(guess + 1, stretch.end - stretch.begin);
    while (count > 0 && transfer_time(count) > since) --count;
    return stretch.begin + count;
  }
  void copy_in(std::span<const std::byte> in) noexcept {
    const std::size_t at = written_ % bytes_.size();
    const std::size_t before_wrap = std::min(in.size(), bytes_.size() - at);
    std::memcpy(bytes_.data() + at, in.data(), before_wrap);
    std::memcpy(bytes_.data(), in.data() + before_wrap, in.size() - before_wrap);
  }
  void copy_out(std::span<std::byte> out) const noexcept {
    if (out.empty()) return;
    const std::size_t at = read_ % bytes_.size();
    const std::size_t before_wrap = std::min(out.size(), bytes_.size() - at);
    std::memcpy(out.data(), bytes_.data() + at, before_wrap);
    std::memcpy(out.data() + before_wrap, bytes_.data(), out.size() - before_wrap);
  }

  std::vector<std::byte> bytes_;
  // Writes that are not back to back and not yet read: a tick writes once, so this is seconds of
  // a stalled reader.
  std::vector<Stretch> stretches_{4096};
  std::size_t first_stretch_ = 0, stretch_count_ = 0;
  std::uint64_t written_ = 0, read_ = 0;
  double ns_per_byte_;
  Duration delay_;
};

}  // namespace

// What both ends share. Every successful open() of the host starts a new connection with empty wires. The
// device then sees `lost` once, as a server sees its old connection end before it accepts the next.
struct Cable::Ends {
  class End final : public ByteLink {
   public:
    End(Ends& ends, Wire& out, Wire& in, bool is_host) : ends_{ends}, out_{out}, in_{in}, is_host_{is_host} {}

    void open() override { is_host_ ? ends_.connect() : ends_.accept(); }
    void close() noexcept override { ends_.hang_up(*this); }

    std::size_t read(std::span<std::byte> out) noexcept override {
      return state_ == LinkState::open && current() ? in_.read(ends_.clock.now(), out) : 0;
    }
    std::size_t write(std::span<const std::byte> in) noexcept override {
      return state_ == LinkState::open && current() ? out_.write(ends_.clock.now(), in) : 0;
    }
    LinkState state() noexcept override {
      if (current()) return state_;
      connection_ = ends_.connection;  // looked at once: from now on the new connection is ours
      return LinkState::lost;
    }
    std::string_view why() const noexcept override { return why_; }

    void set(LinkState state, std::string_view why) noexcept {
      state_ = state;
      why_ = why;
    }
    bool current() const noexcept { return connection_ == ends_.connection; }
    void join() noexcept { connection_ = ends_.connection; }

   private:
    Ends& ends_;
    Wire& out_;
    Wire& in_;
    bool is_host_;
    LinkState state_ = LinkState::closed;
    std::uint64_t connection_ = 0;
    std::string_view why_ = "not opened yet";
  };

  Ends(Clock& c, const Settings& settings)
      : clock{c},
        to_device{settings},
        to_host{settings},
        host{*this, to_device, to_host, true},
        device{*this, to_host, to_device, false} {}

  void connect() noexcept {
    if (!whole) {
      host.set(LinkState::lost, "the cable is cut");
      return;
    }
    const bool device_was_open = device.state() == LinkState::open;
    to_device.clear();
    to_host.clear();
    ++connection;
    host.join();
    if (!device_was_open) device.join();
    host.set(LinkState::open, "");
    device.set(LinkState::open, "");
  }

  // The device cannot call the host: opening its end only forgets an earlier loss.
  void accept() noexcept {
    device.join();
    const bool connected = host.state() == LinkState::open;
    device.set(connected ? LinkState::open : LinkState::closed,
               connected ? "" : "the host has not connected");
  }

  void hang_up(End& closing) noexcept {
    End& far = &closing == &host ? device : host;
    closing.set(LinkState::closed, "closed");
    if (far.state() == LinkState::open) far.set(LinkState::lost, "closed by the far end");
    to_device.clear();
    to_host.clear();
  }

  void cut() noexcept {
    whole = false;
    for (End* end : {&host, &device}) {
      if (end->state() == LinkState::open) end->set(LinkState::lost, "the cable is cut");
    }
    to_device.clear();
    to_host.clear();
  }

  Clock& clock;
  Wire to_device, to_host;
  std::uint64_t connection = 0;
  bool whole = true;
  End host, device;
};

Cable::Cable(Clock& clock, const Settings& settings) : ends_{std::make_unique<Ends>(clock, settings)} {}
Cable::~Cable() = default;

ByteLink& Cable::host() noexcept { return ends_->host; }
ByteLink& Cable::device() noexcept { return ends_->device; }
void Cable::cut() noexcept { ends_->cut(); }
void Cable::mend() noexcept { ends_->whole = true; }

}  // namespace moldloft::hal
