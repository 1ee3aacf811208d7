#include "firmware_like/config/device_makes.hpp"

#include "hal/robot/line_robot.hpp"
#include "hal/scanner/psc_scanner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace moldloft::firmware_like {
namespace {

static_assert(default_scanner_port == hal::psc1::default_port);
static_assert(default_robot_port == hal::robot_line::default_port);

// A configuration that is refused for this word is looked at all the same, for what else is wrong with it.
hal::psc1::Encoding psc_encoding(const ScannerConfig& config) {
  return hal::psc1::encoding_named(config.encoding).value_or(hal::psc1::Encoding::int16);
}

std::vector<std::string> psc_encodings() {
  using hal::psc1::Encoding;
  return {std::string{to_string(Encoding::int16)}, std::string{to_string(Encoding::float32)}};
}

std::unique_ptr<hal::Scanner> psc_scanner(const ScannerConfig& config, hal::ByteLink& link) {
  hal::PscScanner::Settings s;
  s.encoding = psc_encoding(config);
  s.max_stripes = static_cast<std::uint32_t>(config.max_stripes);
  s.max_points = static_cast<std::uint32_t>(config.max_stripes * config.max_points_per_stripe);
  return std::make_unique<hal::PscScanner>(link, s);
}

std::size_t largest_psc_frame(const ScannerConfig& config) {
  const auto stripes = static_cast<std::size_t>(config.max_stripes);
  const auto points = stripes * static_cast<std::size_t>(config.max_points_per_stripe);
  return hal::psc1::largest_message(stripes, points, psc_encoding(config));
}

std::unique_ptr<hal::Robot> line_robot(const RobotConfig& config, hal::ByteLink& link, std::uint32_t nonce) {
  return std::make_unique<hal::LineRobot>(
      link, hal::LineRobot::Settings{.baud = config.place.baud, .first_nonce = nonce});
}

std::vector<ScannerMake>& scanners() {
  static std::vector<ScannerMake> makes = {
      {"psc1", &hal::psc1::frame_codec, largest_psc_frame, psc_scanner,
       hal::PscScanner::Settings{}.frame_timeout, psc_encodings()},
  };
  return makes;
}

std::vector<RobotMake>& robots() {
  static std::vector<RobotMake> makes = {
      {"line", line_robot},
  };
  return makes;
}

template <typename Make>
void add(std::vector<Make>& makes, const Make& make) {
  const auto known = std::ranges::find(makes, make.name, &Make::name);
  known == makes.end() ? makes.push_back(make) : void(*known = make);
}

template <typename Make>
std::vector<std::string> names_of(const std::vector<Make>& makes) {
  std::vector<std::string> names;
  for (const auto& make : makes) names.emplace_back(make.name);
  return names;
}

}  // namespace

void add_scanner_make(const ScannerMake& make) { add(scanners(), make); }
void add_robot_make(const RobotMake& make) { add(robots(), make); }
std::vector<std::string> scanner_names() { return names_of(scanners()); }
std::vector<std::string> robot_names() { return names_of(robots()); }

const ScannerMake* find_scanner_make(std::string_view name) {
  const auto found = std::ranges::find(scanners(), name, &ScannerMake::name);
  return found == scanners().end() ? nullptr : &*found;
}

const ScannerMake& make_of(const ScannerConfig& config) {
  const ScannerMake* make = find_scanner_make(config.driver);
  assert(make != nullptr && "the configuration admits only known drivers");
  return *make;
}

std::unique_ptr<hal::Scanner> make_scanner(const ScannerConfig& config, hal::ByteLink& link) {
  return make_of(config).driver(config, link);
}

std::unique_ptr<hal::Robot> make_robot(const RobotConfig& config, hal::ByteLink& link, std::uint32_t nonce) {
  const auto make = std::ranges::find(robots(), config.driver, &RobotMake::name);
  assert(make != robots().end() && "the configuration admits only known drivers");
  return make->driver(config, link, nonce);
}

std::expected<const hal::FrameCodec*, Failure> frame_codec_of(const hal::RunStore& store) {
  const auto kept = store.meta(frame_codec_key);
  if (!kept) return &hal::psc1::frame_codec;
  for (const auto& make : scanners()) {
    if (make.codec->name == *kept) return make.codec;
  }
  return std::unexpected{Failure{fmt::format(
      "{}: its frames are of the make '{}', which this program does not know; read it with the program "
      "that measured it",
      store.path(), *kept)}};
}

}  // namespace moldloft::firmware_like
