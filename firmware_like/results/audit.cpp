#include "firmware_like/results/audit.hpp"

#include "firmware_like/results/outline_trace.hpp"
#include "firmware_like/results/shot_agreement.hpp"
#include "firmware_like/results/shot_motion.hpp"
#include "firmware_like/results/sight_map.hpp"
#include "firmware_like/results/surface_swing.hpp"
#include "geometry/edges/outline_check.hpp"
#include "geometry/fit/net_choice.hpp"
#include "geometry/fit/plan_map.hpp"
#include "tasks/cell/blind_band.hpp"
#include "tasks/planning/outline_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace moldloft::firmware_like {
namespace {

constexpr double degrees = 180 / std::numbers::pi;

// An outline that is wrong by no more than this is a matter of the rim; beyond it the plate has another shape.
constexpr double smooth_rim_mm = 2;
// Edge points that miss over less than this are single false points; a corner of radius 3 mm misses over twice as much.
constexpr double shortest_miss_mm = 1.5;
// So near to a corner, edge points that lie farther inside than this are those of a corner that is not sharp.
constexpr double corner_reach_mm = 3, blunt_mm = 0.4;
// Parts of the plate without points, smaller than this in all, are what a tack or a scratch hides.
constexpr double smallest_unseen_mm2 = 16;
// Two and a half of these in the height of a corner are what a whole plate's surface stays within.
constexpr double corner_sigma_mm = 0.03;
// A surface that leaves its points by less is what the points themselves scatter.
constexpr double smallest_swing_mm = 0.25;
constexpr std::size_t most_named = 8;  // of one kind; the rest is counted

// Standard deviation of an edge's place: its spacing, and where the arm stands in plan. On good plates, in 192 runs on
// both arms, the median of a shot's edges lies within 0.15 mm of the outline.
constexpr double edge_sigma_mm = 0.1;
constexpr double edges_agree_mm = 0.4;
// So many standard deviations apart, and shots contradict each other.
constexpr double contradiction = 5;
// The scatter of points about the surface, as a share of the scanner's noise, that is neither too much nor too little.
constexpr double most_noise = 1.5, least_noise = 0.5;
// In 192 runs on good plates the rms of so many shots stayed below 1.45 times what the arm promises.
constexpr std::size_t few_shots = 10;
constexpr double most_repeatability = 1.6;
// With more than this share of all shots against the others, the others are no better.
constexpr double most_in_height = 1.0 / 3, most_aside = 1.0 / 4, most_aside_torn = 0.45;
// A model explains the shots' disagreement when it takes away so much of its square.
constexpr double explains = 0.4;

std::string area_text(double mm2) {
  return mm2 < 1000 ? fmt::format("{:.0f} mm2", mm2) : fmt::format("{:.0f} cm2", mm2 / 100);
}

std::string place_text(const Eigen::Vector2d& p) { return fmt::format("({:.0f}, {:.0f})", p.x(), p.y()); }

class Audit {
 public:
  explicit Audit(const RunResult& result)
      : r_{result},
        plate_{*result.measured},
        outline_{plate_.outline},
        map_{plate_.outline},
        edges_{seen_edges(result.evidence, outline_, reach_of_edges_mm)},
        shots_{agreement_of_shots(result.evidence, edges_, map_, plate_.surface)} {}

  std::vector<Finding> findings() {
    check_edge_points();
    check_planned_shots();
    check_sight();
    check_corners();
    check_agreement();
    check_noise();
    check_memory();
    check_net();
    // Of what cannot be trusted the cause comes first: where shots contradict each other, the outline looks wrong too.
    const auto rank = [](const Finding& f) {
      return std::pair{f.gravity, f.kind == FindingKind::plate_moved || f.kind == FindingKind::mount};
    };
    std::ranges::stable_sort(found_, std::ranges::greater{}, rank);
    return std::move(found_);
  }

 private:
  static constexpr double reach_of_edges_mm = 30;

  void add(Finding finding) { found_.push_back(std::move(finding)); }

  // The first few are named, the others counted.
  void add_named(std::vector<Finding> all, std::string_view others) {
    std::ranges::stable_sort(all, std::ranges::greater{}, &Finding::size_mm);
    const std::size_t more = all.size() > most_named ? all.size() - most_named : 0;
    for (std::size_t i = 0; i < all.size() - more; ++i) add(all[i]);
    if (more > 0) {
      Finding rest = all[most_named];
      rest.place.reset();
      rest.text = fmt::format("and {} {} more, each smaller", more, others);
      add(rest);
    }
  }

  void check_edge_points();
  std::vector<Finding> blunt_corners() const;
  void check_planned_shots();
  void check_sight();
  void check_swings(const std::vector<UnseenPart>&);
  void check_corners();
  void check_agreement();
  void check_repeatability();
  void say_cause(const Motion&, double worst_mm);
  void check_noise();
  void check_memory();
  void check_net();
  double height_limit(const ShotAgreement&) const;
  const tasks::ShotSeen& seen(const ShotAgreement& a) const { return r_.evidence.shots[a.shot]; }

  const RunResult& r_;
  const MeasuredPlate& plate_;
  OutlineTrace outline_;
  geometry::PlanMap map_;
  std::vector<SeenEdge> edges_;
  std::vector<ShotAgreement> shots_;
  std::vector<Finding> found_;
  bool is_torn_ = false;  // most of the rim is ragged
  int apart_ = 0;         // places where edge points lie beside the outline and others on it
};

void Audit::check_edge_points() {
  using Kind = geometry::OutlineDeviation::Kind;
  const auto deviations = geometry::check_outline(
      plate_.outline, r_.track.edge_points,
      {.limit_mm = geometry::outline_limit_mm(edge_sigma_mm), .min_length_mm = shortest_miss_mm});
  if (!deviations)
    return add(
        {.kind = FindingKind::outline,
         .gravity = Gravity::untrusted,
         .place = {},
         .text = "the outline cannot be compared with the edge points that were seen: keep the run's folder "
                 "and report it"});
  // Where most of the rim is ragged, a corner that is off by as much is another tooth.
  double ragged_length = 0, teeth = 0;
  for (const auto& d : *deviations) {
    if (d.kind != Kind::ragged) continue;
    ragged_length += d.length_mm;
    teeth = std::max(teeth, d.distance_mm());
  }
  is_torn_ = ragged_length > outline_.length_mm() / 2;
  const double other_shape_mm = is_torn_ ? std::max(smooth_rim_mm, 1.5 * teeth) : smooth_rim_mm;
  std::vector<Finding> named;
  std::optional<std::size_t> shape;  // of those, the farthest that is no matter of the rim
  for (const auto& d : *deviations) {
    const bool rim = d.kind == Kind::ragged || d.kind == Kind::apart || d.kind == Kind::unseen;
    const double size = d.kind == Kind::unseen ? d.length_mm : d.farthest_mm();
    if (d.kind == Kind::apart && size > smooth_rim_mm) ++apart_;
    const bool other_shape = !rim && size > other_shape_mm;
    if (other_shape && (!shape || size > named[*shape].size_mm)) shape = named.size();
    named.push_back({.kind = d.kind == Kind::ragged ? FindingKind::ragged_rim : FindingKind::outline,
                     .gravity = other_shape ? Gravity::untrusted : Gravity::warning,
                     .place = d.place,
                     .size_mm = size,
                     .text = std::string{tasks::words_of(d).view()}});
  }
  if (shape)
    named[*shape].text = fmt::format(
        "the plate has not four smooth sides that meet in four corners: {}; its outline cannot be told",
        named[*shape].text);
  add_named(std::move(named), "places");
  if (is_torn_) return;
  for (Finding& corner : blunt_corners()) add(std::move(corner));
}

// A corner that is rounded by a few millimetres moves two or three edge points only, too few for a stretch that misses.
std::vector<Finding> Audit::blunt_corners() const {
  std::vector<Finding> blunt;
  for (const Eigen::Vector2d& corner : plate_.outline.corners) {
    const bool is_named = std::ranges::any_of(
        found_, [&](const Finding& f) { return f.place && (*f.place - corner).norm() < corner_reach_mm; });
    double deepest = 0;
    int inside = 0;
    for (const Eigen::Vector2d& p : r_.track.edge_points) {
      if ((p - corner).norm() > corner_reach_mm) continue;
      const double inwards = -outline_.locate(p).distance_mm;
      if (inwards > blunt_mm / 2) ++inside;
      deepest = std::max(deepest, inwards);
    }
    if (is_named || inside < 2 || deepest < blunt_mm) continue;
    blunt.push_back(
        {.kind = FindingKind::outline,
         .place = corner,
         .size_mm = deepest,
         .text = fmt::format("the corner at {} is blunt: edge points beside it lie {:.1f} mm inside; it is "
                             "known to {:.0f} mm only",
                             place_text(corner), deepest, corner_reach_mm)});
  }
  return blunt;
}

// Every place of the zig-zag was seen, at the first time or when it was taken again.
void Audit::check_planned_shots() {
  std::vector<Finding> named;
  for (const auto& shot : r_.evidence.shots) {
    if (shot.plate_found || shot.purpose != hal::ShotPurpose::surface) continue;
    const Eigen::Vector2d centre = shot.place.centre.head<2>();
    const bool taken_again = std::ranges::any_of(r_.evidence.shots, [&](const tasks::ShotSeen& other) {
      return other.plate_found && other.purpose == hal::ShotPurpose::surface &&
             (other.place.centre.head<2>() - centre).norm() < 1;
    });
    if (taken_again || outline_.locate(centre).distance_mm > 0) continue;
    named.push_back(
        {.kind = FindingKind::shot_missing,
         .place = centre,
         .size_mm = r_.track.field_x_mm,
         .text = fmt::format("shot {} at {} shows no plate, though the outline says that there is: "
                             "it is not in the result",
                             shot.number, place_text(centre))});
  }
  const auto was_taken = [&](const tasks::ShotPlace& place) {
    return std::ranges::any_of(r_.evidence.shots, [&](const tasks::ShotSeen& shot) {
      return shot.purpose == hal::ShotPurpose::surface &&
             (shot.place.centre - place.centre).head<2>().norm() < 1;
    });
  };
  const auto& planned = r_.track.surface_places;
  if (const auto missed = std::ranges::count_if(planned, std::not_fn(was_taken)); missed > 0)
    named.push_back({.kind = FindingKind::shot_missing,
                     .place = {},
                     .size_mm = r_.track.field_x_mm,
                     .text = fmt::format("{} of {} planned shots were not taken", missed, planned.size())});
  add_named(std::move(named), "shots");
}

void Audit::check_sight() {
  const auto parts = SightMap{outline_, r_.evidence}.unseen();
  check_swings(parts);
  double unseen = 0;
  for (const auto& part : parts) unseen += part.area_mm2;
  if (unseen < smallest_unseen_mm2) return;
  const double share = unseen / std::max(outline_.area_mm2(), 1.0);
  const bool too_much = share > r_.promised.largest_unseen;
  std::vector<Finding> named;
  for (const auto& part : parts) {
    const Eigen::Vector2d extent = part.high - part.low;
    named.push_back(
        {.kind = FindingKind::unseen,
         .gravity = too_much ? Gravity::untrusted : Gravity::warning,
         .place = part.centre,
         .size_mm = extent.maxCoeff(),
         .text = fmt::format("no points within {:.0f} x {:.0f} mm at {}: {} of the plate were not seen",
                             extent.x(), extent.y(), place_text(part.centre), area_text(part.area_mm2))});
  }
  if (too_much)
    add({.kind = FindingKind::unseen,
         .gravity = Gravity::untrusted,
         .place = parts.front().centre,
         .size_mm = std::sqrt(unseen),
         .text = fmt::format(
             "{:.1f} % of the plate ({}) were not seen, the most of it at {}; [audit] unseen_percent "
             "allows {:g}: look whether the scanner sees the plate there",
             100 * share, area_text(unseen), place_text(parts.front().centre),
             100 * r_.promised.largest_unseen)});
  add_named(std::move(named), "parts");
}

void Audit::check_swings(const std::vector<UnseenPart>& unseen) {
  const double limit = std::max(smallest_swing_mm, contradiction * r_.promised.noise_mm);
  std::vector<Finding> named;
  for (const auto& s : surface_swings(outline_, unseen, r_.evidence, map_, plate_.surface, limit))
    named.push_back({.kind = FindingKind::between_points,
                     .gravity = Gravity::warning,
                     .place = s.place,
                     .size_mm = std::abs(s.height_mm),
                     .text = fmt::format("at {} the surface lies {:.1f} mm off what was seen nearest to it, "
                                         "{:.0f} mm away: do not use it there",
                                         place_text(s.place), s.height_mm, s.from_points_mm)});
  add_named(std::move(named), "places");
}

// Beyond the last points the surface is continued: the finer the net, the less is known of its corners.
void Audit::check_corners() {
  for (std::size_t i = 0; i < plate_.outline.corners.size(); ++i) {
    const double sigma = plate_.fit.corner_sigma_mm[i];
    if (sigma <= corner_sigma_mm) continue;
    const Eigen::Vector2d& corner = plate_.outline.corners[i];
    add({.kind = FindingKind::between_points,
         .place = corner,
         .size_mm = sigma,
         .text =
             fmt::format("the surface's height in the corner at {} has a standard deviation of {:.2f} mm: "
                         "few points lie near it",
                         place_text(corner), sigma)});
  }
}

// Of the mean of its samples: the arm's repeatability, the points' noise, and what the net may miss.
double Audit::height_limit(const ShotAgreement& a) const {
  const double points = r_.promised.noise_mm / std::sqrt(std::max(1, a.samples));
  return contradiction * std::hypot(r_.promised.repeatability_z_mm, points, 2 * plate_.tolerance_mm);
}

void Audit::say_cause(const Motion& m, double worst_mm) {
  const double shift = m.shift_mm.norm();
  switch (m.cause) {
    case Cause::mount:
      return add({.kind = FindingKind::mount,
                  .gravity = Gravity::untrusted,
                  .place = {},
                  .size_mm = worst_mm,
                  .text = fmt::format(
                      "shots disagree by {:.1f} mm, as if the scanner sat {:.1f} mm aside on the tip, "
                      "turned by {:.1f} and tilted by {:.1f} degrees: check [scanner.mount]{}",
                      worst_mm, shift, std::abs(m.turn_rad) * degrees, m.tilt_rad.norm() * degrees,
                      m.shot == 0 ? ""
                                  : fmt::format(", and whether the plate was moved before shot {}",
                                                r_.evidence.shots[m.shot].number))});
    case Cause::scale:
      return add(
          {.kind = FindingKind::mount,
           .gravity = Gravity::untrusted,
           .place = {},
           .size_mm = worst_mm,
           .text = fmt::format("shots disagree by {:.1f} mm, as if the scanner's lengths were {:.1f} % too "
                               "{}: calibrate the scanner",
                               worst_mm, 100 * std::abs(m.scale), m.scale > 0 ? "large" : "small")});
    case Cause::drift:
      return add({.kind = FindingKind::shot_heights,
                  .gravity = Gravity::untrusted,
                  .place = {},
                  .size_mm = worst_mm,
                  .text = fmt::format(
                      "shots disagree by {:.1f} mm, more with every shot: {:.1f} mm aside and {:.2f} mm "
                      "in height from the first to the last; look whether the arm drifts, or the "
                      "plate slides",
                      worst_mm, shift, m.lift_mm)});
    case Cause::moved: {
      const auto& first = r_.evidence.shots[m.shot];
      return add(
          {.kind = FindingKind::plate_moved,
           .gravity = Gravity::untrusted,
           .place = first.place.centre.head<2>(),
           .size_mm = std::max(shift, std::abs(m.lift_mm)),
           .text = fmt::format(
               "the plate was moved: from shot {} on it lies {:.1f} mm or more aside, {:.2f} mm higher, "
               "turned by {:.1f} and tilted by {:.1f} degrees; hold it fast and measure again",
               first.number, shift, m.lift_mm, std::abs(m.turn_rad) * degrees, m.tilt_rad.norm() * degrees)});
    }
  }
}

// All shots together tell it sooner than any alone: on a steep plate, errors in plan turn into heights.
void Audit::check_repeatability() {
  const double rms = plate_.fit.shot_offset_rms_mm, promised = r_.promised.repeatability_z_mm;
  if (promised <= 0 || shots_.size() < few_shots || rms < most_repeatability * promised) return;
  add({.kind = FindingKind::shot_heights,
       .place = {},
       .size_mm = rms,
       .text = fmt::format(
           "shot heights scatter {:.3f} mm rms, [robot] repeatability_z_mm promises {:g}: the arm repeats "
           "worse, or the plate is so steep that errors in plan show in height",
           rms, promised)});
}

// Every shot against all others: in height, and where it sees the edge.
void Audit::check_agreement() {
  const ShotAgreement *highest = nullptr, *farthest = nullptr;
  int in_height = 0, aside = 0;
  for (const auto& a : shots_) {
    if (a.samples > 0 && std::abs(a.height_mm) > height_limit(a)) {
      ++in_height;
      if (highest == nullptr || std::abs(a.height_mm) > std::abs(highest->height_mm)) highest = &a;
    }
    if (a.edges > 0 && std::abs(a.aside_mm) > edges_agree_mm) {
      ++aside;
      if (farthest == nullptr || std::abs(a.aside_mm) > std::abs(farthest->aside_mm)) farthest = &a;
    }
  }
  check_repeatability();
  if (const auto band = tasks::blind_band(r_.evidence, r_.track.field_y_mm))
    return add(
        {.kind = FindingKind::unseen,
         .place = {},
         .size_mm = band->share(r_.track.field_y_mm) * r_.track.field_y_mm,
         .text = fmt::format("from shot {} on the scanner shows no points in {:.0f} % of its field, all "
                             "on one side: look at its window and shutter",
                             r_.evidence.shots[band->shot].number, 100 * band->share(r_.track.field_y_mm))});
  const double scatter = plate_.fit.sigma_mm / r_.promised.noise_mm;
  if (highest == nullptr && farthest == nullptr && scatter < most_noise) return;
  const Motion cause =
      best_motion(r_.evidence, edges_, map_, plate_.surface,
                  {.edge_mm = edge_sigma_mm,
                   .height_mm = std::hypot(r_.promised.repeatability_z_mm, r_.promised.noise_mm)});
  const double worst =
      std::max(highest ? std::abs(highest->height_mm) : 0.0, farthest ? std::abs(farthest->aside_mm) : 0.0);
  if (cause.explained > explains && (highest != nullptr || farthest != nullptr))
    return say_cause(cause, worst);
  const auto share = [&](int count) {
    return static_cast<double>(count) / static_cast<double>(shots_.size());
  };
  // A rim that is torn puts edges aside too, though of fewer shots than a wrong mount does.
  const bool edges_contradict = apart_ > 1 && share(aside) > (is_torn_ ? most_aside_torn : most_aside);
  if (share(in_height) > most_in_height || edges_contradict)
    add({.kind = FindingKind::shot_edges,
         .gravity = Gravity::untrusted,
         .place = {},
         .size_mm = worst,
         .text = fmt::format(
             "{} of {} shots contradict the others, by up to {:.1f} mm: check [scanner.mount], and "
             "that neither plate nor scanner nor arm gives way",
             std::max(in_height, aside), shots_.size(), worst)});
  if (highest != nullptr)
    add({.kind = FindingKind::shot_heights,
         .place = seen(*highest).place.centre.head<2>(),
         .size_mm = std::abs(highest->height_mm),
         .text = fmt::format(
             "{} of {} shots lie off the others in height, most shot {} at {}: {:.2f} mm; [robot] "
             "repeatability_z_mm promises {:g}",
             in_height, shots_.size(), seen(*highest).number,
             place_text(seen(*highest).place.centre.head<2>()), highest->height_mm,
             r_.promised.repeatability_z_mm)});
  if (farthest != nullptr)
    add({.kind = FindingKind::shot_edges,
         .place = farthest->aside_at,
         .size_mm = std::abs(farthest->aside_mm),
         .text = fmt::format("{} of {} shots see the edge beside the outline, most shot {} at {}: {:.1f} mm",
                             aside, shots_.size(), seen(*farthest).number, place_text(farthest->aside_at),
                             farthest->aside_mm)});
}

// What a shot's own points scatter is the scanner's; what all points scatter beyond that, the shots' or the net's.
void Audit::check_noise() {
  std::vector<double> of_shots;
  for (const auto& a : shots_) {
    if (a.samples > 20) of_shots.push_back(a.scatter_mm);
  }
  if (of_shots.empty()) return;
  const auto middle = of_shots.begin() + static_cast<std::ptrdiff_t>(of_shots.size() / 2);
  std::ranges::nth_element(of_shots, middle);
  const double promised = r_.promised.noise_mm, scatter = *middle, all = plate_.fit.sigma_mm;
  if (scatter > most_noise * promised || scatter < least_noise * promised)
    return add({.kind = FindingKind::noise,
                .place = {},
                .size_mm = scatter,
                .text = fmt::format(
                    "points scatter {:.3f} mm about the surface; [scanner] noise_mm promises {:g}: look "
                    "at the scanner's window and the plate's shine, or state what it is",
                    scatter, promised)});
  if (all < most_noise * promised) return;
  const auto& worst = *std::ranges::max_element(shots_, {}, &ShotAgreement::scatter_mm);
  add({.kind = FindingKind::noise,
       .place = seen(worst).place.centre.head<2>(),
       .size_mm = all,
       .text = fmt::format(
           "the surface misses its points by {:.2f} mm rms, most in shot {} at {}: the plate is rougher "
           "than [fit] finest_span_mm = {:g} follows, or its shots contradict each other",
           all, seen(worst).number, place_text(seen(worst).place.centre.head<2>()),
           r_.promised.finest_span_mm)});
}

void Audit::check_memory() {
  if (const int left_out = plate_.fit.shots_without_offset; left_out > 0)
    add({.kind = FindingKind::memory_plan,
         .place = {},
         .text = fmt::format(
             "the memory plan had no room for the heights of {} shots: they are taken as exact; raise "
             "[plate] largest_mm",
             left_out)});
  if (r_.recorder_lost > 0)
    add({.kind = FindingKind::memory_plan,
         .place = {},
         .text =
             fmt::format("{} records of the run were not saved: the disk was too slow", r_.recorder_lost)});
}

void Audit::check_net() {
  const auto& fit = plate_.fit;
  if (fit.finest_spans_u == 0 || fit.finest_spans_v == 0) return;  // from before it was kept
  const auto side = [&](std::size_t i) {
    return (plate_.outline.corners[(i + 1) % 4] - plate_.outline.corners[i]).norm();
  };
  const double span = std::max(std::max(side(0), side(2)) / fit.finest_spans_u,
                               std::max(side(1), side(3)) / fit.finest_spans_v);
  // Numbers of spans are powers of two.
  if (span <= 2.02 * r_.promised.finest_span_mm) return;
  const double halved =
      4.0 * fit.finest_spans_u * fit.finest_spans_v;  // cells of the next net, about its unknowns
  const char* const remedy =
      static_cast<double>(fit.points_used) < geometry::points_an_unknown * halved
          ? "the plate's points are too few for a finer one: more stripes, or more points a stripe"
      : std::max(fit.finest_spans_u, fit.finest_spans_v) >= geometry::most_finest_spans
          ? "a net has 256 spans at most: state a longer one"
          : "raise [plate] largest_mm";
  add({.kind = FindingKind::net,
       .place = {},
       .size_mm = span,
       .text =
           fmt::format("the finest net tried has spans of {:.1f} mm; [fit] finest_span_mm asks for {:g}: {}",
                       span, r_.promised.finest_span_mm, remedy)});
}

}  // namespace

std::vector<Finding> audit(const RunResult& r) {
  if (!r.measured) return {};
  return Audit{r}.findings();
}

void take_audit(RunResult& r) {
  if (r.outcome != Outcome::complete) return;
  r.findings = audit(r);
  r.is_audited = true;
  if (r.findings.empty()) return;
  if (r.findings.front().gravity == Gravity::warning) {
    r.outcome = Outcome::warned;
    return;
  }
  r.outcome = Outcome::held;
  r.message = "the result cannot be trusted: " + r.findings.front().text;
}

}  // namespace moldloft::firmware_like
