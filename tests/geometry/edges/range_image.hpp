// Height maps that SICK ships with its samples (The Unlicense), where they are present beside the source
// tree. Every row is one laser profile: rows are stripes, columns are points.
#pragma once

#include "geometry/edges/plate_runs.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace moldloft::test {

struct RangeImage {
  int width = 0, height = 0;
  double point_mm = 0, stripe_mm = 0, unit_mm = 0;
  std::vector<std::uint16_t> value;  // 0: missing
};

inline std::vector<std::uint8_t> from_base64(const std::string& text) {
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<int> digit(256, -1);
  for (int i = 0; i < 64; ++i) digit[static_cast<unsigned char>(alphabet[i])] = i;
  std::vector<std::uint8_t> bytes;
  unsigned bits = 0;
  int count = 0;
  for (const unsigned char c : text) {
    if (digit[c] < 0) continue;
    bits = bits << 6 | static_cast<unsigned>(digit[c]);
    if ((count += 6) >= 8) bytes.push_back(static_cast<std::uint8_t>(bits >> (count -= 8)));
  }
  return bytes;
}

// Of no width when the file is not there.
inline RangeImage load_range_image(const std::string& name) {
  const std::filesystem::path path =
      std::filesystem::path(MOLDLOFT_SOURCE_DIR) / "../shared/data/range-images" / name;
  RangeImage image;
  std::ifstream file(path);
  if (!file) return image;
  const auto json = nlohmann::json::parse(file);
  const auto& data = json[0]["data"];
  image.width = data["Data"]["Width"], image.height = data["Data"]["Height"];
  image.point_mm = data["PixelSize"]["x"], image.stripe_mm = data["PixelSize"]["y"],
  image.unit_mm = data["PixelSize"]["z"];
  const auto& pixels = data["Data"]["Pixels"];
  const std::vector<std::uint8_t> bytes = from_base64(pixels["data"]);
  const bool big = pixels["endian"] == "big";
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    image.value.push_back(
        static_cast<std::uint16_t>(big ? bytes[i] << 8 | bytes[i + 1] : bytes[i + 1] << 8 | bytes[i]));
  }
  return image;
}

// Rows [first, end) as stripes. Scanner coordinates: y = column, x = row, both in mm from pixel (0, 0);
// z above `datum`.
struct Stripes {
  std::vector<std::vector<float>> x, y, z;
  std::vector<geometry::StripeView> views;
};

inline Stripes stripes_of(const RangeImage& image, int first, int end, int datum) {
  Stripes stripes;
  for (int row = first; row < end; ++row) {
    std::vector<float> x, y, z;
    for (int column = 0; column < image.width; ++column) {
      const int value = image.value[static_cast<std::size_t>(row) * image.width + column];
      x.push_back(static_cast<float>(row * image.stripe_mm));
      y.push_back(static_cast<float>(column * image.point_mm));
      z.push_back(value == 0 ? NAN : static_cast<float>((value - datum) * image.unit_mm));
    }
    stripes.x.push_back(x), stripes.y.push_back(y), stripes.z.push_back(z);
  }
  for (std::size_t s = 0; s < stripes.x.size(); ++s)
    stripes.views.push_back({stripes.x[s], stripes.y[s], stripes.z[s]});
  return stripes;
}

}  // namespace moldloft::test
