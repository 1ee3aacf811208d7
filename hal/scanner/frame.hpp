// One exposure of the scanner, decoded: stripes of points in scanner coordinates, column by column.
//
// Scanner coordinates: origin at the centre of the field of view, z towards the scanner, stripes run along y and follow
// one another along x; millimetres. A missing point has NaN in x, y and z.
//
// Thread       the control thread
// Allocation   in the constructor only: a frame never holds more than the sensor said it can deliver
#pragma once

#include "hal/base/clock.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace moldloft::hal {

struct Stripe {
  std::uint16_t index = 0;  // which laser line of the sensor, counted along +x
  std::uint32_t first = 0;  // its first point in the columns
  std::uint32_t count = 0;  // its points, ordered along +y, missing ones included
};

struct Frame {
  Frame() = default;
  Frame(std::size_t max_stripes, std::size_t max_points)
      : stripes(max_stripes), x(max_points), y(max_points), z(max_points), intensity(max_points) {}

  std::uint32_t shot_id = 0;
  std::uint32_t session_id = 0;
  std::uint64_t exposed_sensor_ns = 0;  // the sensor's own clock
  Instant arrived{0};                   // our clock, when the last byte was read
  std::uint32_t stripe_count = 0;
  std::uint32_t point_count = 0;
  std::vector<Stripe> stripes;  // the first stripe_count are valid
  std::vector<float> x, y, z;   // the first point_count are valid
  std::vector<std::uint8_t> intensity;

  std::span<const Stripe> lines() const noexcept { return {stripes.data(), stripe_count}; }
};

}  // namespace moldloft::hal
