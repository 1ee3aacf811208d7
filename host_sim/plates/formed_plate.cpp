#include "host_sim/plates/formed_plate.hpp"

#include "geometry/fit/greville.hpp"
#include "host_sim/base/plan_polygon.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace moldloft::host_sim {
namespace {

using Eigen::Vector2d;

constexpr double largest_mm = 500;
constexpr double farthest_shift_mm = 100;
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
    SurfaceSample s = base_->sample(x - mistakes_.shift_x_mm, y - mistakes_.shift_y_mm);
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
std::vector<std::string> words_in(std::string_view part) {
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

// Beyond its end a cylinder goes on flat, with slopes that are not those of its heights.
bool has_slope(const Plate& plate, const Vector2d& p) {
  constexpr double step_mm = 1e-3, tolerance = 0.01;
  const auto s = plate.sample(p.x(), p.y());
  const double rise_x = plate.height(p.x() + step_mm, p.y()) - plate.height(p.x() - step_mm, p.y());
  const double rise_y = plate.height(p.x(), p.y() + step_mm) - plate.height(p.x(), p.y() - step_mm);
  const auto fits = [](double rise, double slope) {
    return std::abs(rise / (2 * step_mm) - slope) <= tolerance * (1 + std::abs(slope));
  };
  return fits(rise_x, s.slope_x) && fits(rise_y, s.slope_y);
}

bool take_mistake(const std::vector<std::string>& all, bool first, Mistakes& mistakes) {
  Words words{all};
  const auto take = [](const std::optional<double>& value, double& into) {
    if (value) into = *value;
    return value.has_value();
  };
  bool good = false;
  if (words.take("springback")) {
    good = take(words.take_number(), mistakes.springback) && mistakes.springback >= 0 &&
           mistakes.springback <= 3;
  } else if (words.take("twist")) {
    good = take(millimetres(words), mistakes.twist_mm);
  } else if (words.take("bow")) {
    good = take(millimetres(words), mistakes.bow_mm);
  } else if (words.take("shift")) {
    good = take(words.take_number(), mistakes.shift_x_mm) && take(millimetres(words), mistakes.shift_y_mm) &&
           std::max(std::abs(mistakes.shift_x_mm), std::abs(mistakes.shift_y_mm)) <= farthest_shift_mm;
  } else if (words.take("dent")) {
    const auto dent = dent_from(words);
    good = dent.has_value();
    if (dent) mistakes.dents.push_back(*dent);
  } else if (const auto shape = shape_named(all[0]); shape && first) {
    good = words.take(all[0]);
    mistakes.shape = *shape;
  }
  return good && words.at_end();
}

}  // namespace

std::expected<Mistakes, SimError> mistakes_from(std::string_view text) {
  Mistakes mistakes;
  if (words_in(text).empty())
    return refuse("say what the plate became, such as 'springback 0.9, dent 5 mm at 100,80'");
  std::vector<std::string> said;
  for (const auto& part : parts_of(text)) {
    const auto all = words_in(part);
    if (all.empty()) return refuse("nothing stands between two commas");
    const std::string_view shown = std::string_view{part}.substr(part.find_first_not_of(' '));
    if (!take_mistake(all, said.empty(), mistakes))
      return refuse(
          fmt::format("'{}' is not known: a shape first, springback 0..3, twist T mm, bow B mm, "
                      "shift X,Y mm, dent D mm at X,Y radius R, up to {:g} mm",
                      shown, largest_mm));
    if (all[0] != "dent" && std::ranges::find(said, all[0]) != said.end())
      return refuse(fmt::format("'{}' is said twice: only dents may be several", all[0]));
    said.push_back(all[0]);
  }
  return mistakes;
}

std::string words_of(const Mistakes& m) {
  std::vector<std::string> parts;
  if (m.shape) parts.emplace_back(shape_names()[static_cast<std::size_t>(*m.shape)]);
  if (m.springback != 1) parts.push_back(fmt::format("springback {}", m.springback));
  if (m.twist_mm != 0) parts.push_back(fmt::format("twist {} mm", m.twist_mm));
  if (m.bow_mm != 0) parts.push_back(fmt::format("bow {} mm", m.bow_mm));
  if (m.shift_x_mm != 0 || m.shift_y_mm != 0)
    parts.push_back(fmt::format("shift {},{} mm", m.shift_x_mm, m.shift_y_mm));
  for (const auto& d : m.dents)
    parts.push_back(fmt::format("dent {} mm at {},{} radius {}", d.depth_mm, d.x_mm, d.y_mm, d.radius_mm));
  return fmt::format("{}", fmt::join(parts, ", "));
}

HeightDifference height_difference(const Plate& formed, const Plate& design) {
  constexpr int steps = 200;
  const auto& b = formed.bounds();
  HeightDifference d{0, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  int count = 0;
  for (int i = 0; i <= steps; ++i) {
    for (int k = 0; k <= steps; ++k) {
      const Vector2d p = b.min + Vector2d{i / double{steps}, k / double{steps}}.cwiseProduct(b.max - b.min);
      if (!formed.inside(p.x(), p.y())) continue;
      const double off = formed.height(p.x(), p.y()) - design.height(p.x(), p.y());
      d.rms_mm += off * off;
      d.lowest_mm = std::min(d.lowest_mm, off), d.highest_mm = std::max(d.highest_mm, off);
      ++count;
    }
  }
  if (count == 0) return {};
  d.rms_mm = std::sqrt(d.rms_mm / count);
  return d;
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
  auto formed = std::make_shared<const MistakenPlate>(std::move(base), mistakes);
  if (mistakes.shift_x_mm == 0 && mistakes.shift_y_mm == 0) return formed;
  for (const auto& p : sampled_outline(formed->outline(), 1.0)) {
    if (!has_slope(*formed, p))
      return refuse(fmt::format("a shift of {:g},{:g} mm moves the plate beyond the end of its shape",
                                mistakes.shift_x_mm, mistakes.shift_y_mm));
  }
  return formed;
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
