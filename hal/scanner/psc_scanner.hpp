// The driver of a scanner that speaks PSC1 (PROTOCOLS.md), on any byte link.
//
//     link open -> HELLO -> CONFIG -> ready -> TRIGGER -> EXPOSED -> FRAME -> ready
//
// The way through it is the table in psc_table.cpp. A shot is repeated under its own id, so nothing is
// exposed twice for one shot. One case the driver cannot mend: the sensor restarts (new session) between
// EXPOSED and FRAME. The arm may have left by then, and a second exposure would be of another place. Such a
// shot fails, and the cell plans it again.
//
// Thread, blocking, allocation, failure: as Scanner says
#pragma once

#include "hal/base/event_queue.hpp"
#include "hal/links/device_session.hpp"
#include "hal/scanner/psc1.hpp"
#include "hal/scanner/psc_table.hpp"
#include "hal/scanner/scanner.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace moldloft::hal {

class PscScanner final : public Scanner {
 public:
  struct Settings {
    psc1::Encoding encoding = psc1::Encoding::int16;
    bool intensity = true;

    Duration connect_timeout = 2s;   // a connect that the network swallows would take minutes
    Duration greeting_timeout = 1s;  // HELLO and CONFIG cost the sensor nothing
    Duration exposure_timeout =
        1s;                       // TRIGGER to EXPOSED: exposure, and a sensor that finishes its last frame
    Duration frame_timeout = 2s;  // EXPOSED to the last byte: 0.1 s of computing, 0.3 s at 10 Mb/s, margin
    Duration busy_pause = 50ms;   // a sensor that said BUSY is asked again after this long
    Duration ping_period = 1s;
    int silent_pings = 3;             // periods without a byte after which the scanner counts as lost
    Duration first_back_off = 100ms;  // doubles with each failure
    Duration last_back_off = 2s;      // a scanner that has booted is found within this time
    int retries = 2;                  // of one shot, after the first attempt

    // A quarter of a tick of a 1 Gb/s line, three ticks of a 100 Mb/s line; with points_a_tick it bounds what
    // one receive() costs.
    std::size_t bytes_a_tick = 32u << 10;
    std::size_t points_a_tick = 2048;  // unpacked by receive() where nobody asks for them
    std::uint32_t max_stripes = 200;   // of one frame; a sensor with larger ones is refused at HELLO
    std::uint32_t max_points = 100'000;
  };

  PscScanner(ByteLink&, const Settings&);

  void start(Instant now) override;
  void receive(Instant now) override;
  void transmit(Instant now) override;
  bool trigger(std::uint32_t shot_id, Instant now) override;
  void forget_shot() override;
  std::optional<ScannerEvent> next_event() override { return events_.pop(); }
  ScannerState state() const override;
  const ScannerInfo& info() const override { return info_; }
  const Frame& frame() const override { return frame_; }
  void unpack(std::size_t at_most_points) override;
  std::size_t unpacked() const override { return unpacked_; }
  std::size_t packed() const override;
  std::uint64_t frame_offset() const override { return frame_offset_; }
  std::uint32_t frame_bytes() const override { return frame_bytes_; }
  std::string_view why() const override { return why_; }
  LossCounts losses() const override;

  std::size_t plan_bytes() const override;

 private:
  using Phase = PscPhase;
  using Cue = PscCue;

  struct Shot {
    std::uint32_t id = 0;
    bool outstanding = false;
    bool exposed = false;  // the cell has been told; the arm may have moved
    int attempts = 0;
    std::uint32_t session_id = 0;       // in which it was exposed
    std::uint32_t exposed_request = 0;  // whose answer said so
  };

  // Where the bytes of the message on its way go.
  struct Incoming {
    std::array<std::byte, psc1::header_size> header{};
    std::size_t header_have = 0;
    psc1::Header head{};
    std::size_t body_have = 0;  // payload and its CRC
    std::uint32_t crc = 0;      // of the payload bytes so far
    std::uint64_t payload_offset = 0;
  };

  void cue(Cue, Instant now);
  PscContext context() const MOLDLOFT_NONBLOCKING;
  void carry_out(PscAction, Instant now) MOLDLOFT_NONBLOCKING;

  // actions
  void back_off(Instant now) MOLDLOFT_NONBLOCKING;
  void report_loss(Instant now) MOLDLOFT_NONBLOCKING;
  void greet(Instant now) MOLDLOFT_NONBLOCKING;
  void configure(Instant now) MOLDLOFT_NONBLOCKING;
  void announce(Instant now) MOLDLOFT_NONBLOCKING;
  void explain_void_shot() MOLDLOFT_NONBLOCKING;
  void send_trigger(Instant now) MOLDLOFT_NONBLOCKING;
  void report_exposed(Instant now) MOLDLOFT_NONBLOCKING;
  void report_frame() MOLDLOFT_NONBLOCKING;
  void fail_shot() MOLDLOFT_NONBLOCKING;
  void drop_shot() MOLDLOFT_NONBLOCKING;

  // what arrives
  std::size_t read_some(std::size_t budget);
  bool take_header(Instant now);
  void take_message(Instant now);
  void on_hello(std::span<const std::byte> payload, Instant now);
  void on_config(std::span<const std::byte> payload, Instant now);
  void on_exposed(std::span<const std::byte> payload, Instant now);
  void on_frame(std::span<const std::byte> payload, Instant now);
  void on_error(std::span<const std::byte> payload, Instant now);
  void look_at_arriving();
  void drop_arriving();
  bool is_of_our_shot(const psc1::FrameHead&) const;

  void watch(Instant now);
  void lose(Instant now, const Message& why);
  void refuse(Instant now, const Message& why);
  std::optional<Message> unfit(const psc1::HelloReply&) const;
  Message why_not_exposed() const;
  Message why_no_frame() const;
  void broken(Instant now, std::string_view what, psc1::Flaw);
  template <typename M>
  void send(const M& message);

  DeviceSession session_;
  const Settings settings_;
  std::vector<std::byte> body_;
  Frame frame_;
  ScannerInfo info_;
  Incoming incoming_;
  EventQueue<ScannerEvent, 16> events_;

  Phase phase_ = Phase::offline;
  Shot shot_;
  bool announced_ = false;               // ready was reported and not taken back by lost
  bool refused_ = false;                 // unfit was reported, and ready not since then
  bool was_busy_ = false;                // the present attempt was answered by BUSY
  Instant deadline_{0};                  // of the answer that the phase waits for
  std::optional<Instant> ask_again_at_;  // after BUSY
  std::uint32_t request_id_ = 0;
  std::optional<psc1::FrameHead> packed_;  // of the frame in body_ whose points are not all in frame_
  bool arriving_ = false;                  // it is the message on its way
  std::size_t unpacked_ = 0;               // points that are in frame_
  std::uint64_t frame_offset_ = 0;
  std::uint32_t frame_bytes_ = 0;
  std::uint64_t stale_frames_ = 0;    // whole and valid, but of another shot or session
  std::uint64_t broken_streams_ = 0;  // connections dropped for bytes that were wrong
  Message why_ = "not started yet";
  Message failure_;  // why the last attempt of the shot failed
};

}  // namespace moldloft::hal
