#include "firmware_like/inspection/inspection_files.hpp"

#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <set>

namespace moldloft::firmware_like {
namespace {

static_assert(std::endian::native == std::endian::little, "the writer copies memory as it lies");

Json spread_json(const Spread& s) {
  return {{"count", s.count},    {"mean_mm", s.mean_mm}, {"rms_mm", s.rms_mm},       {"min_mm", s.least_mm},
          {"max_mm", s.most_mm}, {"p05_mm", s.p05_mm},   {"median_mm", s.median_mm}, {"p95_mm", s.p95_mm}};
}

Json place_json(const InspectedPlace& p) {
  return {
      {"at", {p.at.x(), p.at.y(), p.at.z()}}, {"mm", p.mm}, {"sigma_mm", p.sigma_mm}, {"border", p.border}};
}

Json frame_json(const FrameLine& f) {
  Json pins = Json::array();
  for (const auto& p : f.pins) {
    Json pin{{"column", p.column}, {"way_mm", p.way_mm}, {"design_mm", p.design_mm}};
    pin["measured_mm"] = p.measured_mm ? Json(*p.measured_mm) : Json();
    pin["gap_mm"] = p.gap_mm() ? Json(*p.gap_mm()) : Json();
    pins.push_back(pin);
  }
  return {{"name", f.name},
          {"x_mm", f.x_mm},
          {"open_mm", f.open_mm},
          {"pressed_mm", f.pressed_mm},
          {"bend_mm", f.bend_mm},
          {"sight_mm", f.sight_mm},
          {"curvature_per_m", f.curvature_per_m},
          {"pins", pins}};
}

std::string verdict_words(const Inspection& i) {
  const char* close = i.is_close ? "; the worst place is within the uncertainty of the limit" : "";
  switch (i.verdict) {
    case Judgement::passes:
      return fmt::format("within the limits{}", close);
    case Judgement::fails:
      return fmt::format("outside the limits{}", close);
    case Judgement::not_judged:
      break;
  }
  return "not judged: no --limit was given";
}

template <typename T>
void put(std::string& out, T value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

// A figure with its sign, and no sign when the digits shown are all zero.
std::string with_sign(double value, int digits) {
  const double unit = std::pow(10.0, -digits);
  return std::abs(value) < unit / 2 ? fmt::format("{:.{}f}", 0.0, digits)
                                    : fmt::format("{:+.{}f}", value, digits);
}

std::string signed_gap(const std::optional<double>& gap) { return gap ? with_sign(*gap, 1) : "-"; }

}  // namespace

Json inspection_json(const Inspection& i) {
  Json pose = Json::array(), covariance = Json::array();
  for (int r = 0; r < 3; ++r) {
    Json row = Json::array();
    for (int c = 0; c < 4; ++c) row.push_back(i.design_from_world.matrix()(r, c));
    pose.push_back(row);
  }
  for (int r = 0; r < 6; ++r) {
    Json row = Json::array();
    for (int c = 0; c < 6; ++c) row.push_back(i.alignment.covariance(r, c));
    covariance.push_back(row);
  }
  Json out{{"schema", 1},
           {"unit", "mm"},
           {"frame", "design"},
           {"sign", "positive: the plate stands too high"},
           {"plate", i.plate},
           {"run", i.run},
           {"design", {{"file", i.design_file}, {"name", i.design}, {"kind", to_string(i.kind)}}},
           {"verdict", i.verdict == Judgement::passes  ? "passes"
                       : i.verdict == Judgement::fails ? "fails"
                                                       : "not judged"},
           {"close_to_limit", i.is_close}};
  const bool is_free = i.method == AlignmentMethod::datum || i.method == AlignmentMethod::none;
  out["alignment"] = {{"method", to_string(i.method)},    {"design_from_world", pose},
                      {"rms_mm", i.alignment.rms_mm},     {"outline_rms_mm", i.alignment.border_rms_mm},
                      {"outliers", i.alignment.outliers}, {"undetermined", i.undetermined}};
  if (!is_free) {
    const bool of_design = i.map_u == 0;
    const auto& c = i.alignment.centroid;
    out["alignment"]["covariance"] = {{"of", "small shift (mm), then small turn (rad), about the centroid"},
                                      {"frame", of_design ? "world" : "design"},
                                      {"centroid", {c.x(), c.y(), c.z()}},
                                      {"matrix", covariance}};
  }
  out["inside"] = spread_json(i.inside);
  out["border"] = spread_json(i.border);
  out["regions"] = Json::array();
  for (const auto& r : i.regions)
    out["regions"].push_back({{"name", r.name},
                              {"limit_mm", {r.limit.low_mm, r.limit.high_mm}},
                              {"passes", r.passes},
                              {"close_to_limit", r.is_close},
                              {"share_within", r.share_within},
                              {"spread", spread_json(r.spread)}});
  out["worst"] = Json::array();
  for (const auto& w : i.worst) out["worst"].push_back(place_json(w));
  out["histogram"] = Json::array();
  for (const auto& b : i.histogram) out["histogram"].push_back({b.from_mm, b.to_mm, b.count});
  if (i.map_u > 0) {
    Json values = Json::array();
    for (const auto& p : i.places) values.push_back(p.beyond ? Json() : Json(std::round(p.mm * 1e4) / 1e4));
    out["map"] = {{"of", "the measured surface's (u, v), rows along u"},
                  {"rows", i.map_u},
                  {"columns", i.map_v},
                  {"mm", values}};
  }
  out["twist_mm"] = i.twist_mm;
  out["frames"] = Json::array();
  for (const auto& f : i.frame_lines) out["frames"].push_back(frame_json(f));
  out["edges"] = Json::array();
  for (const auto& e : i.edges)
    out["edges"].push_back({{"name", e.name}, {"measured_mm", e.measured_mm}, {"design_mm", e.designed_mm}});
  out["remarks"] = i.remarks;
  return out;
}

std::string deviations_csv(const Inspection& i) {
  std::string out = "x_mm,y_mm,z_mm,deviation_mm,sigma_mm,class\n";
  for (const auto& p : i.places)
    out +=
        fmt::format("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{}\n", p.at.x(), p.at.y(), p.at.z(), p.mm, p.sigma_mm,
                    p.beyond   ? "beyond"
                    : p.border ? "border"
                               : "inside");
  return out;
}

std::string deviations_ply(const Inspection& i) {
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment moldloft, deviations from the design\ncomment unit mm\n"
      "comment frame design\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property float quality\nproperty float scalar_deviation\nproperty uchar scalar_border\nend_header\n",
      i.points.empty() ? i.places.size() : i.points.size());
  const auto add = [&](const Eigen::Vector3f& at, float mm, bool border) {
    for (int axis = 0; axis < 3; ++axis) put(out, at[axis]);
    put(out, mm);
    put(out, mm);
    put(out, static_cast<std::uint8_t>(border));
  };
  out.reserve(out.size() + i.points.size() * 21);
  for (const auto& p : i.points) add(p.at, p.mm, p.border);
  if (i.points.empty()) {
    for (const auto& p : i.places) add(p.at.cast<float>(), static_cast<float>(p.mm), p.border);
  }
  return out;
}

std::string frames_text(const Inspection& i, const Design& design) {
  if (design.templates) {
    std::vector<std::vector<std::optional<double>>> gaps;
    for (const auto& f : i.frame_lines) {
      gaps.emplace_back();
      for (const auto& p : f.pins) gaps.back().push_back(p.gap_mm());
    }
    return with_differences(*design.templates, gaps);
  }
  std::set<int> columns;
  double distance = 0;
  for (const auto& f : i.frame_lines) {
    for (const auto& p : f.pins) {
      columns.insert(p.column);
      if (p.column == 1) distance = p.way_mm;
    }
  }
  std::string out =
      fmt::format("MEASURED MINUS NOMINAL HEIGHTS   PLATE= {}   DISTANCE BETWEEN COLUMNS= {:g}\n\n{:<10}",
                  i.plate, distance, "FRAME");
  for (const int c : columns) out += fmt::format("{:>7}", c);
  for (const auto& f : i.frame_lines) {
    out += fmt::format("\n{:<10}", f.name);
    for (const int c : columns) {
      const auto pin = std::ranges::find(f.pins, c, &FramePin::column);
      out += fmt::format("{:>7}", pin == f.pins.end() ? ""
                                  : pin->gap_mm()     ? fmt::format("{:.1f}", *pin->gap_mm())
                                                      : "-");
    }
  }
  return out + "\n";
}

std::string inspection_table(const Inspection& i) {
  std::string out;
  const auto row = [&](std::string_view name, const std::string& value) {
    out += fmt::format("{:<27} {}\n", name, hal::printable(value));
  };
  row("verdict", verdict_words(i));
  row("plate", i.plate);
  row("design", fmt::format("{} ({})", i.design_file, to_string(i.kind)));
  row("alignment", i.method == AlignmentMethod::none || i.method == AlignmentMethod::datum
                       ? std::string{to_string(i.method)}
                       : fmt::format("{}, surface {:.3f} mm rms, outline {:.3f} mm rms", to_string(i.method),
                                     i.alignment.rms_mm, i.alignment.border_rms_mm));
  for (const auto& word : i.undetermined) row("not determined", word);
  for (const auto& word : i.remarks) row("note", word);
  const auto spread = [&](std::string_view name, const Spread& s) {
    if (s.count > 0)
      row(name, fmt::format("{} to {}, mean {}, rms {:.3f} ({} places)", with_sign(s.least_mm, 2),
                            with_sign(s.most_mm, 2), with_sign(s.mean_mm, 3), s.rms_mm, s.count));
  };
  spread("deviation inside, mm", i.inside);
  spread("deviation at border, mm", i.border);
  for (const auto& r : i.regions)
    row(fmt::format("limit {}", r.name),
        fmt::format("{:+g} to {:+g} mm: {}, {:.1f} % within", r.limit.low_mm, r.limit.high_mm,
                    r.passes ? "kept" : "not kept", 100 * r.share_within));
  for (const auto& w : i.worst)
    row("worst", fmt::format("{} mm (+- {:.2f}) at ({:.0f}, {:.0f}, {:.0f}){}", with_sign(w.mm, 2),
                             2 * w.sigma_mm, w.at.x(), w.at.y(), w.at.z(), w.border ? ", border" : ""));
  for (const auto& e : i.edges)
    row(fmt::format("{}, mm", e.name), fmt::format("{:.2f}, design {:.2f} ({:+.2f})", e.measured_mm,
                                                   e.designed_mm, e.measured_mm - e.designed_mm));
  if (!i.frame_lines.empty()) {
    row("twist, mm", with_sign(i.twist_mm, 2));
    out += fmt::format("\n{:<10}{:>10}{:>10}{:>10}{:>10}{:>14}   gaps, mm\n", "frame", "bend more", "open",
                       "pressed", "sight", "curvature 1/m");
    for (const auto& f : i.frame_lines) {
      out += fmt::format("{:<10}{:>+10.2f}{:>10.2f}{:>10.2f}{:>+10.2f}{:>+14.4f}  ", hal::printable(f.name),
                         f.bend_mm, f.open_mm, f.pressed_mm, f.sight_mm, f.curvature_per_m);
      for (const auto& p : f.pins) out += " " + signed_gap(p.gap_mm());
      out += "\n";
    }
  }
  return out;
}

}  // namespace moldloft::firmware_like
