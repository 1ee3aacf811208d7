#include "firmware_like/controller/device_check.hpp"

#include "firmware_like/config/device_makes.hpp"
#include "hal/robot/robot_line.hpp"
#include "tasks/cell/motion_guard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

constexpr hal::Duration step = std::chrono::milliseconds{1};

class ScannerCheck {
 public:
  ScannerCheck(const CellConfig& config, hal::ByteLink& link, std::uint32_t shot_id)
      : config_{config}, driver_{make_scanner(config.scanner, link)}, shot_id_{shot_id} {}

  void start(hal::Instant now) { driver_->start(now); }
  bool is_over() const { return over_; }

  void work(hal::Instant now) {
    driver_->receive(now);
    while (const auto event = driver_->next_event()) take(*event, now);
    if (!over_) driver_->transmit(now);
  }

  DeviceReport report() const {
    if (over_) return report_;
    return {.ok = false,
            .text = std::string{greeted_ ? "answers, but gives no frame" : driver_->why()},
            .warnings = {}};
  }

 private:
  void take(const hal::ScannerEvent& event, hal::Instant now) {
    using Kind = hal::ScannerEvent::Kind;
    if (event.kind == Kind::ready) {
      greeted_ = true;
      driver_->trigger(shot_id_, now);
    } else if (event.kind == Kind::frame) {
      driver_->unpack(driver_->packed());
      over_ = true;
      describe();
    } else if (event.kind == Kind::shot_failed || event.kind == Kind::unfit) {
      over_ = true;
      report_.text = std::string{event.text.view()};
    }
  }

  void describe() {
    const auto& info = driver_->info();
    const auto& frame = driver_->frame();
    std::size_t seen = 0;
    double low = INFINITY, high = -INFINITY;
    for (std::size_t i = 0; i < driver_->unpacked(); ++i) {
      const double z = frame.z[i];
      if (!std::isfinite(z)) continue;
      ++seen;
      low = std::min(low, z);
      high = std::max(high, z);
    }
    report_.ok = true;
    report_.text = fmt::format("{}, field {:g} x {:g} mm, depth +-{:g} mm; one exposure: {} points",
                               info.sensor.view(), info.field_x_mm, info.field_y_mm, info.depth_mm, seen);
    if (seen > 0)
      report_.text += fmt::format(", heights {:.1f} to {:.1f} mm in the scanner's frame", low, high);
    const auto differs = [&](const char* key, double ours, double theirs) {
      if (std::abs(ours - theirs) > 0.01 * theirs + 1e-6)
        report_.warnings.push_back(fmt::format(
            "[scanner] {}: {:g} in the configuration, {:g} by the scanner's word", key, ours, theirs));
    };
    differs("field_mm", config_.scanner.field_x_mm, info.field_x_mm);
    differs("field_mm", config_.scanner.field_y_mm, info.field_y_mm);
    differs("depth_mm", config_.scanner.depth_mm, info.depth_mm);
  }

  const CellConfig& config_;
  std::unique_ptr<hal::Scanner> driver_;
  std::uint32_t shot_id_;
  bool over_ = false, greeted_ = false;
  DeviceReport report_;
};

class RobotCheck {
 public:
  RobotCheck(const CellConfig& config, hal::ByteLink& link, std::uint32_t nonce)
      : config_{config}, driver_{make_robot(config.robot, link, nonce)} {}

  void start(hal::Instant now) { driver_->start(now); }
  bool is_over() const { return over_; }

  void work(hal::Instant now) {
    driver_->receive(now);
    while (const auto event = driver_->next_event()) {
      using Kind = hal::RobotEvent::Kind;
      const bool faulted = event->kind == Kind::fault || event->kind == Kind::manual;
      over_ = over_ || event->kind == Kind::ready || faulted;
      if (event->kind == Kind::ready) describe(event->pose, event->calibrated);
      if (faulted) report_ = {false, std::string{event->text.view()}, {}};
    }
    if (!over_) driver_->transmit(now);
  }

  DeviceReport report() const {
    if (over_) return report_;
    return {.ok = false, .text = std::string{driver_->why()}, .warnings = {}};
  }

 private:
  void describe(const hal::Pose& p, bool calibrated) {
    report_.ok = true;
    report_.text = fmt::format(
        "synchronised, {}; the tip stands at {:.1f} {:.1f} {:.1f} mm, {:.1f} {:.1f} {:.1f} degrees",
        calibrated ? "calibrated" : "not calibrated (a run does that first)", p.x_mm, p.y_mm, p.z_mm,
        p.yaw / hal::degree, p.pitch / hal::degree, p.roll / hal::degree);
    auto here = config_.robot.workspace;
    here.max_speed_percent = 100;
    if (const auto outside = tasks::refuse_target(p, p, 1, here); calibrated && outside)
      report_.warnings.push_back("[robot.workspace]: the arm stands outside of it: " +
                                 std::string{outside->view()});
  }

  const CellConfig& config_;
  std::unique_ptr<hal::Robot> driver_;
  bool over_ = false;
  DeviceReport report_;
};

}  // namespace

DeviceReports try_devices(const CellConfig& config, hal::Clock& clock, hal::ByteLink& scanner_link,
                          hal::ByteLink& robot_link, std::uint32_t shot_id) {
  ScannerCheck scanner{config, scanner_link, shot_id};
  // As fresh as the shot: what the arm answers to a greeting of before is not taken for an answer to this one.
  RobotCheck robot{config, robot_link, shot_id & hal::robot_line::largest_nonce};
  const hal::Instant begin = clock.now(), end = begin + config.device_timeout;
  scanner.start(begin);
  robot.start(begin);
  for (hal::Instant now = begin; now < end && !(scanner.is_over() && robot.is_over()); now = clock.now()) {
    if (!scanner.is_over()) scanner.work(now);
    if (!robot.is_over()) robot.work(now);
    clock.sleep_until(now + step);
  }
  scanner_link.close();
  robot_link.close();
  return {scanner.report(), robot.report()};
}

}  // namespace moldloft::firmware_like
