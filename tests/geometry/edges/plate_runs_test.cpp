#include "geometry/edges/plate_runs.hpp"

#include "geometry/edges/stripe_scene.hpp"
#include "geometry/heap_watch.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <string>

using namespace moldloft;
using geometry::Error, geometry::PlateRun, geometry::PlateRunFinder, geometry::PlateRunSettings,
    geometry::RunEnd;
using test::rectangle, test::StripeScene;

namespace {

struct EdgeErrors {
  double mean = 0, rms = 0, max = 0;
  int count = 0, missed = 0;
};

// The upper ends of all runs against the outline's chord at their stripe.
EdgeErrors upper_edge_errors(const StripeScene& scene, std::span<const PlateRun> runs) {
  EdgeErrors errors;
  std::vector<int> seen(scene.stripes);
  for (const PlateRun& run : runs) {
    if (!is_edge(run.at_last)) continue;
    const double e = run.edge_last.y() - scene.chord(scene.x_of(run.stripe)).second;
    errors.mean += e, errors.rms += e * e, errors.max = std::max(errors.max, std::abs(e));
    ++errors.count, ++seen[run.stripe];
  }
  errors.mean /= errors.count, errors.rms = std::sqrt(errors.rms / errors.count);
  errors.missed = static_cast<int>(std::count(seen.begin(), seen.end(), 0));
  return errors;
}

// A plate whose upper edge crosses the field at 20 degrees and whose other edges lie outside.
StripeScene edge_across() {
  StripeScene scene;
  scene.outline = rectangle({120, 55}, 0.35 + M_PI, 400, 300);
  return scene;
}

}  // namespace

TEST_CASE("an edge is found on every stripe without bias, whatever lies beyond it") {
  struct Beyond {
    std::string what;
    bool table;
    double shadow;
    int wall_points;
  };
  for (const Beyond& beyond :
       {Beyond{"table", true, 0, 0}, Beyond{"shadow, then table", true, 3, 0},
        Beyond{"wide shadow, then table", true, 9, 0}, Beyond{"nothing", false, 0, 0},
        Beyond{"one wall point", true, 0, 1}, Beyond{"two wall points", true, 0, 2},
        Beyond{"three wall points", true, 0, 3}, Beyond{"three wall points and shadow", true, 4, 3}}) {
    double mean = 0, rms = 0, max = 0;
    int missed = 0, count = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
      StripeScene scene = edge_across();
      scene.table = beyond.table, scene.shadow_mm = beyond.shadow, scene.wall_points = beyond.wall_points;
      scene.seed = seed, scene.y_phase = 0.01 * seed;
      const test::Frame frame = sample(scene);
      PlateRunFinder finder(100, 50'000);
      const auto runs = finder.find(frame.views, {0, -20, 0}, {});
      REQUIRE(runs.has_value());
      const EdgeErrors errors = upper_edge_errors(scene, *runs);
      mean += errors.mean * errors.count, rms += errors.rms * errors.rms * errors.count;
      max = std::max(max, errors.max), missed += errors.missed, count += errors.count;
    }
    mean /= count, rms = std::sqrt(rms / count);
    MESSAGE(beyond.what << ": mean " << mean << " rms " << rms << " max " << max << " mm, missed " << missed);
    CHECK(std::abs(mean) < 0.015);
    CHECK(rms < 0.12);  // uniform over one spacing of 0.204 mm: 0.059; drop-outs at the very edge widen it
    CHECK(max < 2.5);
    CHECK(missed == 0);
    CHECK(count == 2000);
  }
}

TEST_CASE("steep, bent and wavy plates are one run a stripe") {
  const std::function<double(double, double)> shapes[] = {
      [](double, double y) { return 0.577 * y; },                             // 30 degrees along the stripes
      [](double x, double) { return -0.577 * x; },                            // and across them
      [](double, double y) { return std::sqrt(200.0 * 200 - y * y) - 200; },  // cylinder of 200 mm
      [](double x, double y) { return 3 * std::sin(x / 12) * std::cos(y / 12); }};
  for (const auto& shape : shapes) {
    StripeScene scene;
    scene.outline = rectangle({-200, -200}, 0, 400, 400);
    scene.height = shape;
    scene.drop_outs = 0.05, scene.outliers = 0.01;
    const test::Frame frame = sample(scene);
    PlateRunFinder finder(100, 50'000);
    const auto runs = finder.find(frame.views, {0, 0, 0}, {});
    REQUIRE(runs.has_value());
    CHECK(runs->size() == 100);
    for (const PlateRun& run : *runs) {
      CHECK(run.at_first == RunEnd::field_limit);
      CHECK(run.at_last == RunEnd::field_limit);
    }
  }
}

TEST_CASE("the ends of runs are named by what follows") {
  StripeScene scene;
  scene.outline = rectangle({-200, -200}, 0, 400, 400);
  scene.stripes = 20;
  scene.drop_outs = scene.outliers = 0;

  SUBCASE("a drop is a step down, and from below a rise hides what comes") {
    scene.height = [](double, double y) { return y > 10 ? -6.0 : 0.0; };
    const test::Frame frame = sample(scene);
    PlateRunFinder finder(20, 10'000);
    const auto upper = finder.find(frame.views, {0, 0, 0}, {});
    REQUIRE(upper.has_value());
    REQUIRE(upper->size() == 20);
    CHECK((*upper)[7].at_first == RunEnd::field_limit);
    CHECK((*upper)[7].at_last == RunEnd::step_down);
    CHECK((*upper)[7].edge_last.y() == doctest::Approx(10).epsilon(0.011));
    const auto lower = finder.find(frame.views, {0, 30, -6}, {});
    REQUIRE(lower.has_value());
    REQUIRE(lower->size() == 20);
    CHECK((*lower)[7].at_first == RunEnd::hidden);
  }
  SUBCASE("where nothing follows the end is free") {
    scene.outline = rectangle({-200, -200}, 0, 400, 210);
    scene.table = false;
    const test::Frame frame = sample(scene);
    PlateRunFinder finder(20, 10'000);
    const auto runs = finder.find(frame.views, {0, 0, 0}, {});
    REQUIRE(runs.has_value());
    CHECK((*runs)[7].at_last == RunEnd::free_end);
    CHECK((*runs)[7].edge_last.y() == doctest::Approx(10).epsilon(0.011));
  }
  SUBCASE("a step of less than the smallest is no edge") {
    scene.height = [](double, double y) { return y > 10 ? -0.9 : 0.0; };
    const test::Frame frame = sample(scene);
    PlateRunFinder finder(20, 10'000);
    const auto runs = finder.find(frame.views, {0, 0, 0}, {});
    REQUIRE(runs.has_value());
    CHECK(runs->size() == 20);
    CHECK((*runs)[7].at_last == RunEnd::field_limit);
  }
}

TEST_CASE("a drop-out of 3.5 mm is bridged and one of 6 mm is not") {
  StripeScene scene;
  scene.outline = rectangle({-200, -200}, 0, 400, 400);
  scene.stripes = 10;
  for (const double hole : {3.5, 6.0}) {
    test::Frame frame = sample(scene);
    for (int s = 2; s < 7; ++s) {
      for (int i = 200; i < 200 + static_cast<int>(hole / 0.204); ++i) frame.z[s][i] = NAN;
    }
    PlateRunFinder finder(10, 5'000);
    const auto runs = finder.find(frame.views, {0, 0, 0}, {});
    REQUIRE(runs.has_value());
    CHECK(runs->size() == (hole < 4 ? 10 : 15));
  }
}

TEST_CASE("the hint selects the region, and a hint far from everything is an error") {
  StripeScene scene = edge_across();
  const test::Frame frame = sample(scene);
  PlateRunFinder finder(100, 50'000);
  const auto plate = finder.find(frame.views, {0, -20, 1}, {});
  REQUIRE(plate.has_value());
  REQUIRE(plate->size() == 100);
  CHECK((*plate)[50].edge_first.z() == doctest::Approx(0).epsilon(0.2));
  const auto ground = finder.find(frame.views, {0, 45, -6}, {});
  REQUIRE(ground.has_value());
  for (const PlateRun& run : *ground) CHECK(std::abs(run.edge_last.z() + 6.5) < 0.3);
  CHECK(finder.find(frame.views, {0, 0, 60}, {}).error() == Error::not_on_plate);
  CHECK(finder.find({}, {0, 0, 0}, {}).error() == Error::not_on_plate);
}

TEST_CASE("a missing stripe does not cut the plate in two") {
  StripeScene scene;
  scene.outline = rectangle({-200, -200}, 0, 400, 400);
  test::Frame frame = sample(scene);
  for (const int s : {40, 41}) std::fill(frame.z[s].begin(), frame.z[s].end(), NAN);
  PlateRunFinder finder(100, 50'000);
  const auto runs = finder.find(frame.views, {0, 0, 0}, {});
  REQUIRE(runs.has_value());
  CHECK(runs->size() == 98);
}

TEST_CASE("a frame larger than planned is refused, an empty or senseless one survived") {
  StripeScene scene = edge_across();
  const test::Frame frame = sample(scene);
  CHECK(PlateRunFinder(99, 50'000).find(frame.views, {0, 0, 0}, {}).error() == Error::capacity);
  CHECK(PlateRunFinder(100, 49'999).find(frame.views, {0, 0, 0}, {}).error() == Error::capacity);

  std::mt19937 random(3);
  std::uniform_real_distribution<float> anything(-50, 50);
  test::Frame chaos = frame;
  for (auto& column : chaos.z) {
    for (float& z : column) z = anything(random);
  }
  PlateRunFinder finder(100, 50'000);
  (void)finder.find(chaos.views, {0, 0, 0}, {});  // no plate there; whatever is said, it returns
}

TEST_CASE("finding runs takes no memory and less than a tick") {
  const test::Frame frame = sample(edge_across());
  PlateRunFinder finder(100, 50'000);
  const std::size_t before = test::allocations();
  double least = 1e9;
  for (int repeat = 0; repeat < 20; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    const auto runs = finder.find(frame.views, {0, -20, 0}, {});
    least = std::min(
        least, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    if (!runs) break;
  }
  const std::size_t after = test::allocations();
  CHECK(after == before);
  MESSAGE("50,000 points: " << least << " ms, " << finder.bytes() << " bytes");
  CHECK(least < 20);  // an unoptimized build under a sanitizer is allowed to be slow
}

TEST_CASE("a frame cut in any portions, stripes of unequal length included, gives the same runs") {
  StripeScene scene = edge_across();
  scene.wall_points = 2, scene.shadow_mm = 3, scene.drop_outs = 0.05, scene.outliers = 0.02;
  test::Frame frame = sample(scene);
  for (std::size_t s = 0; s < frame.views.size(); s += 3) {  // some short, one empty
    const std::size_t kept = s == 30 ? 0 : 300 + s;
    frame.views[s] = {frame.views[s].x.first(kept), frame.views[s].y.first(kept),
                      frame.views[s].z.first(kept)};
  }
  PlateRunFinder finder(100, 50'000);
  const auto whole = finder.find(frame.views, {0, -20, 0}, {});
  REQUIRE(whole.has_value());
  REQUIRE(whole->size() >= 98);
  const std::vector<PlateRun> truth(whole->begin(), whole->end());
  for (const std::size_t portion : {1, 2, 3, 7}) {
    REQUIRE(finder.begin(frame.views).has_value());
    for (bool done = false; !done;) done = finder.cut_stripes(portion, {}).value();
    for (bool done = false; !done;) done = finder.find_plate(3 * portion, {0, -20, 0}, {}).value();
    const auto runs = finder.plate_runs();
    REQUIRE(runs.size() == truth.size());
    for (std::size_t k = 0; k < truth.size(); ++k) {
      CHECK(runs[k].stripe == truth[k].stripe);
      CHECK(runs[k].first == truth[k].first);
      CHECK(runs[k].last == truth[k].last);
      CHECK(runs[k].edge_first == truth[k].edge_first);
      CHECK(runs[k].edge_last == truth[k].edge_last);
    }
  }
}

TEST_CASE("where the depth range ends is no edge of the plate") {
  // The plate rises along the stripes; what would follow at 10 mm lies higher than the scanner measures.
  StripeScene scene;
  scene.outline = rectangle({-200, -200}, 0, 400, 210);
  scene.height = [](double, double y) { return y; };
  scene.table = false;
  const test::Frame frame = sample(scene);
  PlateRunFinder finder(100, 50'000);
  PlateRunSettings settings;
  const auto last_end = [&] {
    const auto runs = finder.find(frame.views, {0, 0, 0}, settings);
    REQUIRE(runs.has_value());
    return (*runs)[7].at_last;
  };
  CHECK(last_end() == RunEnd::free_end);
  settings.depth_mm = 10.5;
  CHECK(last_end() == RunEnd::out_of_depth);
  CHECK_FALSE(is_edge(RunEnd::out_of_depth));
  settings.depth_mm = 12;
  CHECK(last_end() == RunEnd::free_end);
}
