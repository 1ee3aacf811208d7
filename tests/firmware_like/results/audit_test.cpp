#include "firmware_like/results/audit.hpp"

#include "firmware_like/made_up_run.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

constexpr std::size_t first_surface_shot = 18;  // of a made-up run: 5 + 4 + 5 + 4 boundary shots before

const Finding* found(const std::vector<Finding>& findings, FindingKind kind) {
  const auto at = std::ranges::find(findings, kind, &Finding::kind);
  return at == findings.end() ? nullptr : &*at;
}

bool says(const Finding* finding, std::string_view what) {
  return finding != nullptr && finding->text.find(what) != std::string::npos;
}

std::string texts(const std::vector<Finding>& findings) {
  std::string all;
  for (const auto& f : findings) all += std::string{to_string(f.kind)} + ": " + f.text + "\n";
  return all;
}

geometry::RigidMotion shifted(double x, double y, double z) {
  return geometry::RigidMotion{Eigen::Translation3d{x, y, z}};
}

}  // namespace

TEST_CASE("a good run has nothing to be said about it") {
  for (const double noise : {0.03, 0.05, 0.07}) {
    CAPTURE(noise);
    MadeUpRun run;
    run.noise_mm = noise;
    RunResult r = run.result();
    const auto findings = audit(r);
    CHECK_MESSAGE(findings.empty(), texts(findings));
    take_audit(r);
    CHECK(r.outcome == Outcome::complete);
  }
}

TEST_CASE("a run that is not complete is not audited") {
  RunResult r = MadeUpRun{}.result();
  r.track.edge_points.clear();
  r.outcome = Outcome::stopped;
  take_audit(r);
  CHECK(r.findings.empty());
  CHECK(r.outcome == Outcome::stopped);
  r.measured.reset();
  CHECK(audit(r).empty());
}

TEST_CASE("a plate pushed at some shot is named with that shot and how far it went") {
  for (const std::size_t from : {first_surface_shot + 3, first_surface_shot + 7, std::size_t{9}}) {
    for (const double push : {1.0, 4.0, -12.0}) {
      CAPTURE(from);
      CAPTURE(push);
      MadeUpRun run;
      run.plate_moves = [&](std::size_t shot) {
        return shot < from ? shifted(0, 0, 0) : shifted(push, push / 2, 0);
      };
      RunResult r = run.result();
      take_audit(r);
      INFO(texts(r.findings));
      const auto* moved = found(r.findings, FindingKind::plate_moved);
      REQUIRE(moved != nullptr);
      CHECK(moved->gravity == Gravity::untrusted);
      CHECK(r.outcome == Outcome::held);
      CHECK(r.message.starts_with("the result cannot be trusted: "));
      // Stripes that run along y tell of an edge along y no more than that it lies between two of them.
      CHECK(moved->size_mm > 0.9 * std::abs(push / 2) - 0.2);
      CHECK(moved->size_mm < 1.1 * std::hypot(push, push / 2));
      // Shots of the plate's middle may see nothing of a push in its plane.
      const auto first = *moved->place;
      const auto near_from = [&](std::size_t i) {
        return i < r.evidence.shots.size() && (r.evidence.shots[i].place.centre.head<2>() - first).norm() < 1;
      };
      CHECK((near_from(from) || near_from(from + 1) || near_from(from - 1) || near_from(from + 2)));
    }
  }
}

TEST_CASE("a plate lifted or tilted during the run is named with its lift") {
  MadeUpRun run;
  run.plate_moves = [](std::size_t shot) { return shifted(0, 0, shot < first_surface_shot + 6 ? 0 : 0.6); };
  RunResult r = run.result();
  take_audit(r);
  INFO(texts(r.findings));
  CHECK(says(found(r.findings, FindingKind::plate_moved), "from shot 25 on"));
  CHECK(says(found(r.findings, FindingKind::plate_moved), "0.60 mm higher"));
  CHECK(exit_code(r.outcome) == 2);
}

TEST_CASE("a mount that is shifted, turned or tilted is told from a plate that was moved") {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const double degree = 0.017453;
  const std::vector<std::pair<const char*, geometry::RigidMotion>> errors{
      {"5 mm aside", shifted(5, 0, 0)},
      {"1 degree of yaw", geometry::RigidMotion{AngleAxisd{degree, Vector3d::UnitZ()}}},
      {"half a degree of roll", geometry::RigidMotion{AngleAxisd{0.5 * degree, Vector3d::UnitX()}}}};
  for (const auto& [name, error] : errors) {
    CAPTURE(name);
    MadeUpRun run;
    run.mount_error = error;
    const auto findings = audit(run.result());
    INFO(texts(findings));
    CHECK(says(found(findings, FindingKind::mount), "check [scanner.mount]"));
    CHECK(found(findings, FindingKind::plate_moved) == nullptr);
  }
}

TEST_CASE("a scanner whose lengths are wrong is told from a mount, with how wrong they are") {
  for (const double scale : {0.95, 1.02, 1.06}) {
    CAPTURE(scale);
    MadeUpRun run;
    RunResult r = run.result();
    // What a shot shows lies too far from, or too near to, the middle of its field.
    const auto stretched = [&](std::size_t shot, const Eigen::Vector3d& p) {
      const auto& motion = r.evidence.shots[shot].world_from_scanner;
      return Eigen::Vector3d{motion * (scale * (motion.inverse() * p))};
    };
    std::uint32_t run_at = 0, sample_at = 0;
    r.track.edge_points.clear();
    for (std::size_t i = 0; i < r.evidence.shots.size(); ++i) {
      const auto& shot = r.evidence.shots[i];
      for (; run_at < shot.runs_end; ++run_at) {
        auto& seen = r.evidence.runs[run_at];
        seen.first = stretched(i, seen.first), seen.last = stretched(i, seen.last);
        if (shot.purpose != hal::ShotPurpose::boundary) continue;
        if (seen.at_first == tasks::RunEdge::edge) r.track.edge_points.push_back(seen.first.head<2>());
        if (seen.at_last == tasks::RunEdge::edge) r.track.edge_points.push_back(seen.last.head<2>());
      }
      for (; sample_at < shot.samples_end; ++sample_at)
        r.evidence.samples[sample_at] = stretched(i, r.evidence.samples[sample_at]);
    }
    take_audit(r);
    INFO(texts(r.findings));
    CHECK(r.outcome == Outcome::held);
    const auto said = r.message.find("lengths were ");
    REQUIRE(said != std::string::npos);
    // Outline and surface have taken in a part of it.
    CHECK(std::stod(r.message.substr(said + 13)) ==
          doctest::Approx(std::abs(100 * (scale - 1))).epsilon(0.25));
    CHECK(r.message.find(scale > 1 ? "% too large: calibrate the scanner"
                                   : "% too small: calibrate the scanner") != std::string::npos);
  }
}

TEST_CASE("a corner whose height is not well known is named with its deviation") {
  RunResult r = MadeUpRun{}.result();
  r.measured->fit.corner_sigma_mm = {0.01, 0.02, 0.12, 0.03};
  take_audit(r);
  INFO(texts(r.findings));
  CHECK(r.outcome == Outcome::warned);
  REQUIRE(r.findings.size() == 1);
  CHECK(says(&r.findings[0], "a standard deviation of 0.12 mm"));
  CHECK((*r.findings[0].place - r.measured->outline.corners[2]).norm() < 1e-9);
}

TEST_CASE("an arm that drifts is not taken for a plate that was pushed") {
  MadeUpRun run;
  run.plate_moves = [](std::size_t shot) { return shifted(0, 0.1 * static_cast<double>(shot), 0); };
  const auto findings = audit(run.result());
  INFO(texts(findings));
  CHECK(says(found(findings, FindingKind::shot_heights), "more with every shot"));
}

TEST_CASE("one shot that lies off the others in height is a warning with its number") {
  MadeUpRun run;
  run.plate_moves = [](std::size_t shot) { return shifted(0, 0, shot == first_surface_shot + 4 ? 0.25 : 0); };
  RunResult r = run.result();
  take_audit(r);
  INFO(texts(r.findings));
  const auto* one = found(r.findings, FindingKind::shot_heights);
  CHECK(says(one, "1 of 30 shots"));
  CHECK(says(one, "most shot 23 "));
  CHECK(one->size_mm == doctest::Approx(0.25).epsilon(0.1));
  CHECK(r.outcome == Outcome::warned);
  CHECK(exit_code(r.outcome) == 5);
}

TEST_CASE("a scanner that is blind over the surface is held with the share that was not seen") {
  MadeUpRun run;
  run.sees = [](std::size_t shot, const Eigen::Vector2d&) { return shot < first_surface_shot; };
  RunResult r = run.result();
  take_audit(r);
  INFO(texts(r.findings));
  // What 18 boundary fields leave of 300 x 200 mm is a rectangle of some 200 x 100.
  const auto* unseen = found(r.findings, FindingKind::unseen);
  REQUIRE(unseen != nullptr);
  CHECK(unseen->gravity == Gravity::untrusted);
  CHECK(says(unseen, "[audit] unseen_percent allows 2"));
  CHECK(unseen->place->x() == doctest::Approx(250).epsilon(0.02));
  CHECK(std::abs(unseen->place->y()) < 3);
  CHECK(r.outcome == Outcome::held);
  CHECK(found(r.findings, FindingKind::shot_missing) != nullptr);
}

TEST_CASE("a spot without points is named with place and size and the rest is measured") {
  MadeUpRun run;
  run.sees = [](std::size_t, const Eigen::Vector2d& p) { return (p - Eigen::Vector2d{240, 10}).norm() > 8; };
  RunResult r = run.result();
  take_audit(r);
  INFO(texts(r.findings));
  const auto* spot = found(r.findings, FindingKind::unseen);
  REQUIRE(spot != nullptr);
  CHECK(spot->gravity == Gravity::warning);
  CHECK((*spot->place - Eigen::Vector2d{240, 10}).norm() < 2);
  CHECK(spot->size_mm == doctest::Approx(16).epsilon(0.3));
  CHECK(r.outcome == Outcome::warned);
}

TEST_CASE("what may go unseen is what the configuration says") {
  MadeUpRun run;
  run.sees = [](std::size_t, const Eigen::Vector2d& p) { return (p - Eigen::Vector2d{240, 10}).norm() > 25; };
  RunResult r = run.result();  // 3.3 % of the plate
  r.promised.largest_unseen = 0.02;
  CHECK(audit(r).front().gravity == Gravity::untrusted);
  r.promised.largest_unseen = 0.04;
  CHECK(audit(r).front().gravity == Gravity::warning);
}

TEST_CASE("a planned shot that was never taken is counted") {
  RunResult r = MadeUpRun{}.result();
  r.track.surface_places.push_back({{255, 3, 20}, 0});
  const auto findings = audit(r);
  CHECK(says(found(findings, FindingKind::shot_missing), "1 of 13 planned shots were not taken"));
}

TEST_CASE("a place that was taken again and then seen is no finding") {
  MadeUpRun run;
  RunResult r = run.result();
  auto blind = r.evidence.shots.back();
  blind.plate_found = false;
  // Before the shot that sees: the same place, with nothing in it.
  blind.runs_end = r.evidence.shots[r.evidence.shots.size() - 2].runs_end;
  blind.samples_end = r.evidence.shots[r.evidence.shots.size() - 2].samples_end;
  r.evidence.shots.insert(r.evidence.shots.end() - 1, blind);
  const auto findings = audit(r);
  CHECK_MESSAGE(findings.empty(), texts(findings));
}

TEST_CASE("points that scatter more or less than the scanner promises are named with both figures") {
  for (const double noise : {0.01, 0.12, 0.5}) {
    CAPTURE(noise);
    MadeUpRun run;
    run.noise_mm = noise;
    const auto findings = audit(run.result());
    INFO(texts(findings));
    const auto* of_noise = found(findings, FindingKind::noise);
    REQUIRE(of_noise != nullptr);
    CHECK(of_noise->size_mm == doctest::Approx(noise).epsilon(0.1));
    CHECK(says(of_noise, "noise_mm promises 0.05"));
  }
}

TEST_CASE("an outline that is not the plate's is held with the place") {
  RunResult r = MadeUpRun{}.result();
  // The corner at (400, 100) is cut by 30 mm: no edge point nearer, and others along the cut.
  auto& points = r.track.edge_points;
  const Eigen::Vector2d corner{400, 100};
  std::erase_if(points, [&](const Eigen::Vector2d& p) { return (p - corner).cwiseAbs().sum() < 31; });
  for (double t = 0; t <= 30; t += 1) points.push_back(corner - Eigen::Vector2d{t, 30 - t});
  take_audit(r);
  INFO(texts(r.findings));
  CHECK(r.outcome == Outcome::held);
  CHECK(says(found(r.findings, FindingKind::outline), "four smooth sides"));
  CHECK(says(found(r.findings, FindingKind::outline), "the corner at (400, 100) is cut by"));
}

TEST_CASE("what the memory plan left out and a net that is too coarse are warnings") {
  RunResult r = MadeUpRun{}.result();
  r.measured->fit.shots_without_offset = 3;
  r.measured->fit.finest_spans_u = 8;  // 37.5 mm of 300
  const auto findings = audit(r);
  CHECK(says(found(findings, FindingKind::memory_plan), "3 shots"));
  CHECK(says(found(findings, FindingKind::net), "37.5 mm"));
  CHECK(findings.size() == 2);
}

TEST_CASE("findings survive their file and the gravest comes first") {
  MadeUpRun run;
  run.sees = [](std::size_t shot, const Eigen::Vector2d&) { return shot < first_surface_shot; };
  const auto findings = audit(run.result());
  REQUIRE(findings.size() > 2);
  CHECK(std::ranges::is_sorted(findings, std::ranges::greater{}, &Finding::gravity));
  const Json json = findings_json(findings);
  CHECK(findings_json(findings_in(json)) == json);
  CHECK(findings_in(json).front().text == findings.front().text);
  CHECK_THROWS_AS(findings_in(Json::parse(R"([{"kind":"odd"}])")), Json::exception);
}

TEST_CASE("of many findings of one kind some are named and the rest is counted") {
  MadeUpRun run;
  run.sees = [](std::size_t, const Eigen::Vector2d& p) {
    return (p - 20 * (p / 20).array().round().matrix()).norm() > 3;
  };
  const auto findings = audit(run.result());
  CHECK(std::ranges::count(findings, FindingKind::unseen, &Finding::kind) < 12);
  CHECK(std::ranges::any_of(findings,
                            [](const Finding& f) { return f.text.find("parts more") != f.text.npos; }));
}

TEST_CASE("a surface that swings where nothing was measured is named there") {
  MadeUpRun run;
  // Nobody has seen the first corner: 40 mm of it.
  run.sees = [](std::size_t, const Eigen::Vector2d& p) { return (p - plate_at).sum() > 40; };
  RunResult r = run.result();
  r.promised.largest_unseen = 0.1;
  CHECK(found(audit(r), FindingKind::between_points) == nullptr);
  r.measured->surface.z(0, 0) += 3;
  const auto findings = audit(r);
  INFO(texts(findings));
  const auto* swing = found(findings, FindingKind::between_points);
  REQUIRE(swing != nullptr);
  CHECK((*swing->place - plate_at).norm() < 10);
  CHECK(swing->size_mm == doctest::Approx(3).epsilon(0.4));
}

TEST_CASE("where most of the rim is ragged its teeth are warnings and no other shape") {
  RunResult r = MadeUpRun{}.result();
  for (auto& p : r.track.edge_points) {
    const bool on_x_side =
        std::abs(p.y() - plate_at.y()) < 2 || std::abs(p.y() - plate_at.y() - plate_y_mm) < 2;
    const double along = on_x_side ? p.x() : p.y();
    const Eigen::Vector2d inwards =
        on_x_side ? Eigen::Vector2d{0, p.y() < 0 ? 1 : -1} : Eigen::Vector2d{p.x() < 250 ? 1 : -1, 0};
    if (std::fmod(along + 1000, 20) < 10) p += 4 * inwards;
  }
  take_audit(r);
  INFO(texts(r.findings));
  CHECK(r.outcome == Outcome::warned);
  CHECK(says(found(r.findings, FindingKind::ragged_rim), "a ragged rim, up to 4"));
}

TEST_CASE("shots that all scatter a little in height are told together") {
  RunResult r = MadeUpRun{}.result();
  r.measured->fit.shot_offset_rms_mm = 0.019;
  CHECK(audit(r).empty());
  r.measured->fit.shot_offset_rms_mm = 0.022;
  CHECK(says(found(audit(r), FindingKind::shot_heights), "scatter 0.022 mm rms"));
  r.promised.repeatability_z_mm = 0.02;
  CHECK(audit(r).empty());
}

TEST_CASE("shots that contradict each other without a pattern are held") {
  for (const bool in_plan : {false, true}) {
    CAPTURE(in_plan);
    // A scanner with a loose screw: every shot is off by something else.
    MadeUpRun run;
    run.plate_moves = [&](std::size_t shot) {
      const double off = 3 * std::sin(7.0 * static_cast<double>(shot * shot % 31));
      return in_plan ? shifted(off, -off, 0) : shifted(0, 0, off / 5);
    };
    RunResult r = run.result();
    take_audit(r);
    INFO(texts(r.findings));
    CHECK(r.outcome == Outcome::held);
    CHECK(std::ranges::any_of(r.findings, [](const Finding& f) {
      return f.gravity == Gravity::untrusted && says(&f, "contradict the others, by up to") &&
             says(&f, "check [scanner.mount]");
    }));
  }
}

TEST_CASE("a corner that is rounded by a few millimetres only is named at its place") {
  for (const double radius : {0.5, 2.5, 3.3}) {
    CAPTURE(radius);
    RunResult r = MadeUpRun{}.result();
    const Eigen::Vector2d middle = plate_at + Eigen::Vector2d{radius, radius};
    std::erase_if(r.track.edge_points, [&](const Eigen::Vector2d& p) { return (p - plate_at).norm() < 6; });
    for (double along = radius; along < 6; along += 0.8) {
      r.track.edge_points.push_back(plate_at + Eigen::Vector2d{along, 0});
      r.track.edge_points.push_back(plate_at + Eigen::Vector2d{0, along});
    }
    for (const double angle : {0.3, 0.55, 0.785, 1.02, 1.27})
      r.track.edge_points.push_back(middle - radius * Eigen::Vector2d{std::cos(angle), std::sin(angle)});
    take_audit(r);
    INFO(texts(r.findings));
    const Finding* blunt = found(r.findings, FindingKind::outline);
    // The arc's middle lies 0.29 radii from both sides: of half a millimetre nobody can tell.
    REQUIRE((blunt != nullptr) == (radius > 1));
    if (blunt == nullptr) continue;
    CHECK((*blunt->place - plate_at).norm() < 3);
    CHECK(blunt->size_mm == doctest::Approx(0.29 * radius).epsilon(0.2));
    CHECK(r.outcome == Outcome::warned);
  }
}

TEST_CASE("an outline that cannot be compared with its edge points is not trusted") {
  RunResult r = MadeUpRun{}.result();
  r.measured->outline.sides[1].control[1].x() = std::numeric_limits<double>::quiet_NaN();
  take_audit(r);
  INFO(texts(r.findings));
  CHECK(r.outcome == Outcome::held);
  CHECK(says(found(r.findings, FindingKind::outline), "cannot be compared with the edge points"));
}
