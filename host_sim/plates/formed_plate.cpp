#include "host_sim/plates/formed_plate.hpp"

#include "geometry/fit/greville.hpp"
#include "host_sim/base/plan_polygon.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace moldloft::host_sim {
namespace {

using Eigen::Vector2d;

constexpr double largest_mm = 500;
constexpr int spline_points = 48;  // each way: a span of 7 mm on the plate of 305 mm

class MistakenPlate final : public Plate {
 public:
  MistakenPlate(std::shared_ptr<const Plate> base, const Mistakes& mistakes)
      : base_{std::move(base)}, mistakes_{mistakes} {
    name_ = base_->name();
    outline_ = base_->outline();
    corners_ = base_->corners();
    thickness_mm_ = base_->thickness_mm();
    bounds_ = base_->bounds();
    middle_ = (bounds_.min + bounds_.max) / 2;
    half_ = (bounds_.max - bounds_.min) / 2;
    find_height_range();
  }

  SurfaceSample sample(double x, double y) const noexcept override {
    SurfaceSample s = base_->sample(x, y);
    s.z *= mistakes_.springback, s.slope_x *= mistakes_.springback, s.slope_y *= mistakes_.springback;
    const double p = (x - middle_.x()) / half_.x(), q = (y - middle_.y()) / half_.y();
    s.z += mistakes_.twist_mm / 4 * p * q + mistakes_.bow_mm * p * p;
    s.slope_x += (mistakes_.twist_mm / 4 * q + 2 * mistakes_.bow_mm * p) / half_.x();
    s.slope_y += mistakes_.twist_mm / 4 * p / half_.y();
    for (const auto& dent : mistakes_.dents) {
      const double dx = x - dent.x_mm, dy = y - dent.y_mm, square = dent.radius_mm * dent.radius_mm;
      const double left = 1 - (dx * dx + dy * dy) / square;
      if (left <= 0) continue;
      s.z -= dent.depth_mm * left * left * left;
      s.slope_x += 6 * dent.depth_mm * left * left * dx / square;
      s.slope_y += 6 * dent.depth_mm * left * left * dy / square;
    }
    return s;
  }
  bool inside(double x, double y) const noexcept override { return base_->inside(x, y); }

 private:
  void find_height_range() {
    constexpr int steps = 200;
    bounds_.z_min = std::numeric_limits<double>::infinity();
    bounds_.z_max = -bounds_.z_min;
    const auto take = [this](double x, double y) {
      const double z = height(x, y);
      bounds_.z_min = std::min(bounds_.z_min, z);
      bounds_.z_max = std::max(bounds_.z_max, z);
    };
    for (const auto& p : sampled_outline(outline_, 1.0)) take(p.x(), p.y());
    for (int i = 0; i <= steps; ++i) {
      for (int k = 0; k <= steps; ++k) {
        const double x = bounds_.min.x() + 2 * half_.x() * i / steps,
                     y = bounds_.min.y() + 2 * half_.y() * k / steps;
        if (inside(x, y)) take(x, y);
      }
    }
  }

  std::shared_ptr<const Plate> base_;
  Mistakes mistakes_;
  Vector2d middle_, half_;
};

std::unexpected<SimError> refuse(std::string what) { return std::unexpected(SimError{std::move(what)}); }

// The words of one mistake, blanks and commas inside a place taken for one.
std::vector<std::string> words_of(std::string_view part) {
  std::vector<std::string> words;
  for (std::size_t at = 0; at < part.size();) {
    while (at < part.size() && (part[at] == ' ' || part[at] == ',')) ++at;
    const std::size_t begin = at;
    while (at < part.size() && part[at] != ' ' && part[at] != ',') ++at;
    if (at > begin) words.emplace_back(part.substr(begin, at - begin));
  }
  return words;
}

std::optional<double> number(const std::string& word) {
  double value = 0;
  const auto [stopped, failed] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (failed != std::errc{} || stopped != word.data() + word.size() || !(std::abs(value) <= 1e5))
    return std::nullopt;
  return value;
}

// Splits at the commas that begin a new word of letters: "dent 5 mm at 100,80" stays one.
std::vector<std::string> parts_of(std::string_view text) {
  std::vector<std::string> parts{""};
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == ',') {
      const std::size_t next = text.find_first_not_of(' ', i + 1);
      const bool is_number =
          next != text.npos && (std::string_view{"+-.0123456789"}.find(text[next]) != std::string_view::npos);
      if (!is_number) {
        parts.emplace_back();
        continue;
      }
    }
    parts.back() += text[i];
  }
  return parts;
}

class Words {
 public:
  explicit Words(std::vector<std::string> words) : words_{std::move(words)} {}
  bool take(std::string_view word) { return at_ < words_.size() && words_[at_] == word && (++at_, true); }
  std::optional<double> take_number() {
    if (at_ == words_.size()) return std::nullopt;
    const auto value = number(words_[at_]);
    if (value) ++at_;
    return value;
  }
  bool at_end() const { return at_ == words_.size(); }

 private:
  std::vector<std::string> words_;
  std::size_t at_ = 0;
};

std::optional<double> millimetres(Words& words) {
  const auto value = words.take_number();
  words.take("mm");
  if (!value || std::abs(*value) > largest_mm) return std::nullopt;
  return value;
}

std::optional<Dent> dent_from(Words& words) {
  Dent dent;
  const auto depth = millimetres(words);
  if (!depth || !words.take("at")) return std::nullopt;
  const auto x = words.take_number(), y = words.take_number();
  if (!x || !y) return std::nullopt;
  dent.depth_mm = *depth, dent.x_mm = *x, dent.y_mm = *y;
  if (words.take("radius")) {
    const auto radius = words.take_number();
    words.take("mm");
    if (!radius || !(*radius >= 1)) return std::nullopt;
    dent.radius_mm = *radius;
  }
  return dent;
}

}  // namespace

std::expected<Mistakes, SimError> mistakes_from(std::string_view text) {
  Mistakes mistakes;
  if (words_of(text).empty())
    return refuse("say what the plate became, such as 'springback 0.9, dent 5 mm at 100,80'");
  bool first = true;
  for (const auto& part : parts_of(text)) {
    const auto all = words_of(part);
    Words words{all};
    bool good = false;
    if (all.empty()) return refuse("nothing stands between two commas");
    if (words.take("springback")) {
      const auto factor = words.take_number();
      good = factor && *factor >= 0 && *factor <= 3;
      mistakes.springback = factor.value_or(1);
    } else if (words.take("twist")) {
      const auto mm = millimetres(words);
      good = mm.has_value();
      mistakes.twist_mm = mm.value_or(0);
    } else if (words.take("bow")) {
      const auto mm = millimetres(words);
      good = mm.has_value();
      mistakes.bow_mm = mm.value_or(0);
    } else if (words.take("dent")) {
      const auto dent = dent_from(words);
      good = dent.has_value();
      if (dent) mistakes.dents.push_back(*dent);
    } else if (const auto shape = shape_named(all[0]); shape && first) {
      words.take(all[0]);
      mistakes.shape = *shape;
      good = true;
    }
    const std::string_view shown = std::string_view{part}.substr(part.find_first_not_of(' '));
    if (!good || !words.at_end())
      return refuse(
          fmt::format("'{}' is not known: a shape first, springback 0..3, twist T mm, bow B mm, "
                      "dent D mm at X,Y radius R, up to {:g} mm",
                      shown, largest_mm));
    first = false;
  }
  return mistakes;
}

std::expected<std::shared_ptr<const Plate>, SimError> make_formed_plate(std::shared_ptr<const Plate> base,
                                                                        const Mistakes& mistakes) {
  for (const auto& dent : mistakes.dents) {
    const auto& b = base->bounds();
    if (dent.x_mm < b.min.x() || dent.x_mm > b.max.x() || dent.y_mm < b.min.y() || dent.y_mm > b.max.y())
      return refuse(fmt::format(
          "the dent at {:g},{:g} is not on the plate, which reaches from {:.0f},{:.0f} to {:.0f},{:.0f}",
          dent.x_mm, dent.y_mm, b.min.x(), b.min.y(), b.max.x(), b.max.y()));
  }
  return std::make_shared<const MistakenPlate>(std::move(base), mistakes);
}

geometry::BSplineSurface spline_of(const Plate& plate, const geometry::RigidMotion& placed) {
  constexpr int count = spline_points;
  std::vector<double> knots;
  for (int i = 0; i < count + 4; ++i)
    knots.push_back(std::clamp((i - 3) / static_cast<double>(count - 3), 0.0, 1.0));
  const auto places = geometry::greville_places(knots);
  Eigen::MatrixXd x(count, count), y = x, z = x;
  const auto& c = plate.corners();
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k) {
      const double u = places[static_cast<std::size_t>(i)], v = places[static_cast<std::size_t>(k)];
      const Vector2d p = (1 - v) * ((1 - u) * c[0] + u * c[1]) + v * ((1 - u) * c[3] + u * c[2]);
      const Eigen::Vector3d at = placed * Eigen::Vector3d{p.x(), p.y(), plate.height(p.x(), p.y())};
      x(i, k) = at.x(), y(i, k) = at.y(), z(i, k) = at.z();
    }
  }
  return geometry::surface_through(knots, knots, x, y, z);
}

}  // namespace moldloft::host_sim
