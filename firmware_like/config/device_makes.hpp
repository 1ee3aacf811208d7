// The makes of devices that the program knows, by the name that [scanner] driver and [robot] driver give: one table for
// each kind. A new make is its driver in hal/ and one row here.
//
// Thread       add_*(): the first thread, before a configuration is read; the rest anywhere
// Blocking     never
// Allocation   yes
#pragma once

#include "firmware_like/config/config.hpp"
#include "firmware_like/process/failure.hpp"
#include "hal/links/byte_link.hpp"
#include "hal/record/run_store.hpp"
#include "hal/robot/robot.hpp"
#include "hal/scanner/frame_codec.hpp"
#include "hal/scanner/scanner.hpp"

#include <memory>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

struct ScannerMake {
  std::string_view name;
  const hal::FrameCodec* codec = nullptr;
  // What a frame of the configured size takes on the link at most, head and all.
  std::size_t (*largest_frame_bytes)(const ScannerConfig&) = nullptr;
  std::unique_ptr<hal::Scanner> (*driver)(const ScannerConfig&, hal::ByteLink&) = nullptr;
  hal::Duration frame_timeout = std::chrono::seconds{2};  // how long the driver waits for a whole frame
  // What [scanner] encoding may say, the default first. A make with one encoding only gives none.
  std::vector<std::string> encodings = {};
};

struct RobotMake {
  std::string_view name;
  // `nonce`: before the first greeting's; another at each start of the program.
  std::unique_ptr<hal::Robot> (*driver)(const RobotConfig&, hal::ByteLink&, std::uint32_t nonce) = nullptr;
};

// Makes that are linked to this program from elsewhere. A name that is there already is replaced.
void add_scanner_make(const ScannerMake&);
void add_robot_make(const RobotMake&);

std::vector<std::string> scanner_names();
std::vector<std::string> robot_names();
const ScannerMake* find_scanner_make(std::string_view name);  // null for none

// By the configuration, which admits known names only.
const ScannerMake& make_of(const ScannerConfig&);
std::unique_ptr<hal::Scanner> make_scanner(const ScannerConfig&, hal::ByteLink&);
std::unique_ptr<hal::Robot> make_robot(const RobotConfig&, hal::ByteLink&, std::uint32_t nonce);

// The codec of a stored run's frames. Runs of before it was kept are PSC1's.
std::expected<const hal::FrameCodec*, Failure> frame_codec_of(const hal::RunStore&);
inline constexpr const char* frame_codec_key = "frames";  // of the store's meta

}  // namespace moldloft::firmware_like
