#include "firmware_like/selftest/latency_load.hpp"

#include "firmware_like/config/cell_settings.hpp"
#include "firmware_like/config/memory_plan.hpp"
#include "firmware_like/config/task_table.hpp"
#include "hal/base/crc32c.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;
using Stage = tasks::SurfaceTask::Stage;
using hal::crc32c, hal::psc1::header_size, hal::psc1::payload_crc_size;

// A plate that fits into the smallest memory plan, with the thesis's waves; its first corner is the origin.
constexpr double side_mm = 300;
constexpr double edge_spacing_mm = 0.5;
constexpr double reach_mm = 18;       // of the hint, as the cell has it
constexpr double reach_over_mm = 12;  // how far the outermost shots look over the plate's edge

constexpr auto frame_period = 200ms;
constexpr std::size_t points_a_tick = 2048;  // unpacked
constexpr double link_bytes_per_s = 100e6 / 8;

double height(double x, double y) {
  return 12 * std::sin(2 * std::numbers::pi * x / 400) * std::cos(2 * std::numbers::pi * y / 500);
}

bool on_plate(double x, double y) { return x >= 0 && x <= side_mm && y >= 0 && y <= side_mm; }

tasks::TaskSpec row_named(std::string_view name) {
  for (const auto& row : task_table)
    if (row.name == name) return row;
  return {.name = name};
}

}  // namespace

std::size_t FrameWire::read(std::span<std::byte> out) noexcept {
  const std::size_t count = std::min(out.size(), frame_.size() - sent_);
  std::copy_n(frame_.begin() + static_cast<std::ptrdiff_t>(sent_), count, out.begin());
  sent_ += count;
  return count;
}

LatencyLoad::LatencyLoad(const CellConfig& config, hal::Clock& clock)
    : shots_{shots_of_a_plate(config)},
      recorder_{recorder_sizes(config), &flight_},
      wire_{on_the_wire(config, shots_.front().frame)},
      link_{wire_, hal::LinkId::scanner, recorder_, clock},
      message_(wire_.frame_size()),
      decoded_{cell_settings(config).max_stripes, cell_settings(config).max_points},
      bytes_a_tick_{
          static_cast<std::size_t>(link_bytes_per_s * std::chrono::duration<double>(config.tick).count())},
      view_{cell_settings(config).max_stripes, cell_settings(config).max_points, cell_settings(config).view},
      surface_{surface_settings(config)},
      receive_row_{Row{this, &LatencyLoad::receive}},
      measure_row_{Row{this, &LatencyLoad::measure}},
      scheduler_{clock, {.tick = config.tick, .missed = config.missed_ticks}, &flight_} {
  std::mt19937 random{1};
  std::normal_distribution<double> noise{0, config.scanner.noise_mm};
  corners_ = {{0, 0}, {side_mm, 0}, {side_mm, side_mm}, {0, side_mm}};
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d from = corners_[k], to = corners_[(k + 1) % 4];
    const Eigen::Vector2d along = (to - from).normalized(), across{-along.y(), along.x()};
    for (double s = edge_spacing_mm / 2; s < side_mm; s += edge_spacing_mm)
      edge_points_.push_back(from + s * along + noise(random) * across);
  }
  scheduler_.add(row_named("scanner in"), receive_row_);
  scheduler_.add(row_named("cell"), measure_row_);
  scheduler_.add_background(surface_work, surface_);
  surface_.begin();
}

// The fields of neighbouring shots overlap, those at the rim look over the edge.
std::vector<LatencyLoad::Shot> LatencyLoad::shots_of_a_plate(const CellConfig& config) {
  const auto settings = cell_settings(config);
  const auto stripes = static_cast<std::uint32_t>(config.scanner.max_stripes);
  const auto points = static_cast<std::uint32_t>(config.scanner.max_points_per_stripe);
  const double half_x = config.scanner.field_x_mm / 2, half_y = config.scanner.field_y_mm / 2;
  std::mt19937 random{2};
  std::normal_distribution<float> noise{0, static_cast<float>(config.scanner.noise_mm)};

  const auto places = [](double half) {
    const double first = half - reach_over_mm, last = side_mm - first;
    const int count = static_cast<int>(std::ceil((last - first) / (1.6 * half))) + 1;
    std::vector<double> at;
    for (int i = 0; i < count; ++i) at.push_back(first + (last - first) * i / (count - 1));
    return at;
  };
  std::vector<Shot> shots;
  for (const double cx : places(half_x)) {
    for (const double cy : places(half_y)) {
      Shot shot{.frame = hal::Frame{settings.max_stripes, settings.max_points},
                .world_from_scanner = geometry::turned_about_z(0, {cx, cy, height(cx, cy)})};
      shot.at_the_edge = !on_plate(cx - half_x, cy - half_y) || !on_plate(cx + half_x, cy + half_y);
      hal::Frame& f = shot.frame;
      f.shot_id = static_cast<std::uint32_t>(shots.size()) + 1;
      f.stripe_count = stripes;
      f.point_count = stripes * points;
      for (std::uint32_t s = 0; s < stripes; ++s) {
        f.stripes[s] = {.index = static_cast<std::uint16_t>(s), .first = s * points, .count = points};
        for (std::uint32_t p = 0; p < points; ++p) {
          const double x = half_x * (2.0 * s / (stripes - 1) - 1), y = half_y * (2.0 * p / (points - 1) - 1);
          const double z = on_plate(cx + x, cy + y) ? height(cx + x, cy + y)
                                                    : config.plate.table_z_mm - config.plate.thickness_mm;
          const std::size_t i = s * points + p;
          f.x[i] = static_cast<float>(x);
          f.y[i] = static_cast<float>(y);
          f.z[i] = static_cast<float>(z - height(cx, cy)) + noise(random);
        }
      }
      shots.push_back(std::move(shot));
    }
  }
  return shots;
}

std::vector<std::byte> LatencyLoad::on_the_wire(const CellConfig& config, const hal::Frame& frame) {
  // Of another make's configuration the sizes count, not its words.
  const auto encoding =
      hal::psc1::encoding_named(config.scanner.encoding).value_or(hal::psc1::Encoding::int16);
  std::vector<std::byte> bytes(hal::psc1::encoded_frame_size(frame, encoding, true));
  const std::array<float, 3> half{static_cast<float>(config.scanner.field_x_mm / 2),
                                  static_cast<float>(config.scanner.field_y_mm / 2),
                                  static_cast<float>(config.scanner.depth_mm)};
  hal::psc1::encode_frame(1, frame, encoding, true, half, bytes);
  return bytes;
}

void LatencyLoad::receive(hal::Instant now) {
  unpack();
  if (wire_.idle()) {
    if (now < next_frame_) return;
    next_frame_ = now + frame_period;
    if (!recorder_.room_for_frame()) {
      ++refused_;
      return;
    }
    wire_.begin_frame();
    received_ = 0;
    crc_ = 0;
  }
  const auto room = std::span{message_}.subspan(received_);
  const std::size_t count = link_.read(room.first(std::min(bytes_a_tick_, room.size())));
  // As the driver does it: the sum grows with the bytes, so that no tick sums up a whole frame.
  const std::size_t begin = std::max(received_, header_size);
  received_ += count;
  const std::size_t end = std::min(received_, message_.size() - payload_crc_size);
  if (begin < end) crc_ = crc32c(std::span{message_}.subspan(begin, end - begin), crc_);
  if (received_ == message_.size()) frame_arrived(now);
}

void LatencyLoad::frame_arrived(hal::Instant now) {
  std::uint32_t crc = 0;
  std::memcpy(&crc, payload().data() + payload().size(), sizeof crc);
  const auto begun = hal::psc1::begin_frame(payload(), decoded_);
  if (crc != crc_ || !begun) {
    ++damaged_;
    return;
  }
  packed_ = *begun;
  unpacked_ = 0;
  hal::psc1::decode_intensities(payload(), *begun, decoded_);
  ++frames_;
  const auto received = recorder_.offset(hal::LinkId::scanner, hal::Direction::received);
  recorder_.shot({.at = now,
                  .shot_id = static_cast<std::uint32_t>(frames_),
                  .purpose = hal::ShotPurpose::surface,
                  .payload_offset = received - payload_crc_size - payload().size(),
                  .payload_bytes = static_cast<std::uint32_t>(payload().size())});
}

// A frame's points in pieces, as the driver does it where nobody is in a hurry.
void LatencyLoad::unpack() {
  if (!packed_) return;
  const std::size_t end = std::min<std::size_t>(unpacked_ + points_a_tick, packed_->point_count);
  hal::psc1::decode_points(payload(), *packed_, unpacked_, end, decoded_);
  unpacked_ = end;
  if (unpacked_ == packed_->point_count) packed_.reset();
}

std::span<const std::byte> LatencyLoad::payload() const {
  return std::span{message_}.subspan(header_size, message_.size() - header_size - payload_crc_size);
}

// One piece of the cell's part a tick; the pieces between are background work.
void LatencyLoad::measure(hal::Instant) {
  if (surface_.has_work()) return;
  switch (surface_.stage()) {
    case Stage::idle:
      return walk_the_edge();
    case Stage::open:
      return sweep();
    case Stage::ready:
      ++surfaces_;
      surface_.begin();
      return walk_the_edge();
    default:
      return;
  }
}

void LatencyLoad::walk_the_edge() {
  if (looked_at_ != nullptr && view_.found()) {
    surface_.keep(view_, looked_at_->world_from_scanner, {});  // no lease: these frames stay
    looked_at_ = nullptr;
    return;
  }
  if (!look_at_next(true)) surface_.build_outline(edge_points_, corners_);
}

void LatencyLoad::sweep() {
  if (looked_at_ != nullptr && view_.found()) {
    surface_.fold(view_, looked_at_->world_from_scanner, {});
    points_ += looked_at_->frame.point_count;
    looked_at_ = nullptr;
    return;
  }
  if (!look_at_next(false)) surface_.solve();
}

// Begins to look at the next shot; false when there is none, and the next time it is the first again.
bool LatencyLoad::look_at_next(bool at_the_edge_only) {
  while (next_shot_ < shots_.size() && at_the_edge_only && !shots_[next_shot_].at_the_edge) ++next_shot_;
  if (next_shot_ == shots_.size()) {
    next_shot_ = 0;
    return false;
  }
  looked_at_ = &shots_[next_shot_++];
  view_.begin(looked_at_->frame, {.reach_mm = reach_mm, .boundary = at_the_edge_only});
  surface_.look(view_);
  return true;
}

}  // namespace moldloft::firmware_like
