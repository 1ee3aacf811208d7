// The list of heights for flexible templates, as hull systems print it: a row a frame, signed heights at pins relative
// to the height at its middle, then the ways from the middle to the seams and to the sight mark; at the bottom the
// middle points in ship coordinates. The same list comes out again as measured minus nominal, in its own shape.
//
//     HEIGHTS FOR FLEXIBLE TEMPLATES   PLATE= A-7   DISTANCE BETWEEN COLUMNS= 200
//     FRAME    -2   -1    0    1    2   LOWER   UPPER   SIGHT   ANGLE
//     F20       9    3    0    2    7     390     395     -12    91.4
//     MIDDLE POINTS
//     FRAME   F20 ...      (likewise rows X, Y and Z)
//
// Tolerated    any spacing; empty fields (no pin there) where columns stand below their heads; rows separated by
//              semicolons or tabs; decimal commas; pins in several tables; capitals; other words for known columns
// Source       shape: AVEVA Marine, Flexible Templates Listing (page 1116245)
// Units        mm, degrees; ship coordinates
// Thread       any; pure
// Failure      one line: which line of the list, and what is wrong with it
#pragma once

#include "firmware_like/process/failure.hpp"

#include <Eigen/Core>

#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

struct TemplatePin {
  int column = 0;  // counted from the middle
  double height_mm = 0;
  std::size_t line = 0, begin = 0, end = 0;  // where in the text the number stands
};

struct TemplateFrame {
  std::string name;
  std::vector<TemplatePin> pins;  // from the lowest column up
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::optional<double> lower_mm, upper_mm, sight_mm, angle_deg;

  // The nominal place of a pin: the frame stands across x, pins go along y, heights along z.
  Eigen::Vector3d place(const TemplatePin& pin, double distance_mm) const {
    return middle + Eigen::Vector3d{0, pin.column * distance_mm, pin.height_mm};
  }
};

struct TemplateList {
  std::string plate;
  double distance_mm = 0;  // between columns
  std::vector<TemplateFrame> frames;
  std::optional<double> before_first_mm,
      after_last_mm;               // how far the plate reaches beyond the frames (LIMITS)
  std::vector<std::string> lines;  // as they came, without their ends
};

bool looks_like_templates(std::string_view text);
std::expected<TemplateList, Failure> read_templates(std::string_view text, const std::string& file);

// The same text with every height replaced by `differences` (frame by frame, pin by pin; nullopt: not measured).
std::string with_differences(const TemplateList&,
                             const std::vector<std::vector<std::optional<double>>>& differences);

}  // namespace moldloft::firmware_like
