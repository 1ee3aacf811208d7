// A frame whose numbers are known: what the suites of codec, driver and store send around.
#pragma once

#include "hal/scanner/frame.hpp"

#include <cmath>

namespace moldloft::hal {

inline Frame sample_frame(std::uint32_t stripes, std::uint32_t points_per_stripe, std::uint32_t shot_id = 42,
                          std::uint32_t session_id = 1000) {
  Frame frame{stripes, std::size_t{stripes} * points_per_stripe};
  frame.shot_id = shot_id;
  frame.session_id = session_id;
  frame.exposed_sensor_ns = 1'000'000u * shot_id;
  frame.stripe_count = stripes;
  frame.point_count = stripes * points_per_stripe;
  for (std::uint32_t s = 0; s < stripes; ++s) {
    frame.stripes[s] = {
        .index = static_cast<std::uint16_t>(s), .first = s * points_per_stripe, .count = points_per_stripe};
    for (std::uint32_t p = 0; p < points_per_stripe; ++p) {
      const std::size_t i = s * points_per_stripe + p;
      frame.x[i] = -50.0f + 100.0f * static_cast<float>(s) / static_cast<float>(stripes);
      frame.y[i] = -50.0f + 100.0f * static_cast<float>(p) / static_cast<float>(points_per_stripe);
      frame.z[i] = 10.0f * std::sin(0.01f * static_cast<float>(i + shot_id));
      frame.intensity[i] = static_cast<std::uint8_t>(i + shot_id);
    }
  }
  return frame;
}

}  // namespace moldloft::hal
