#include "host_sim/runs/hard_case.hpp"

#include "host_sim/plates/cut_outline.hpp"
#include "host_sim/plates/cut_plate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string>

namespace moldloft::host_sim {

namespace {

using std::string_view;

// ---- words. A rim that is not four-sided is named by what it is or by what of it lies off the four sides; whatever
// moved between shots shows as shots that disagree, and nobody can know from that alone which of the two moved.
using Words = std::array<string_view, 8>;
constexpr Words none{};
constexpr Words steep{"height", "depth", "steep", "slope", "not seen", "no points"};
constexpr Words small{"small", "short", "in the corner"};
constexpr Words ragged_words{"ragged", "step", "corner", "rough", "edge beside", "not four"};
constexpr Words notch_words{"notch", "step", "corner", "an edge", "edge beside", "not four"};
constexpr Words corner_words{"corner", "cut", "round", "not four"};
constexpr Words hole_words{"hole", "no points", "not seen", "an edge", "edge beside", "no plate under"};
constexpr Words mount_words{"mount"};
constexpr Words noise_words{"noise"};
constexpr Words robot_words{"the robot says"};
constexpr Words moved_words{"was moved", "drift", "contradict", "off the others", "edge beside"};
constexpr Words blind_words{"blind", "no points", "not seen", "no plate", "no edge", "sees nothing"};
constexpr Words scale_words{"mount", "disagree", "contradict", "scanner", "off the others", "edge beside"};

constexpr std::array<Cause, 21> causes{{
    {"sound", none},
    {"steep", steep},
    {"steep, large", steep},
    {"tall", steep},
    {"tiny", small},
    {"ragged", ragged_words},
    {"notched", notch_words},
    {"stepped", notch_words},
    {"corner cut", corner_words},
    {"rounded", corner_words},
    {"scalloped", ragged_words},
    {"corners", corner_words},
    {"holed", hole_words},
    {"mount", mount_words},
    {"noise", noise_words},
    {"robot lies", robot_words},
    {"robot moves", moved_words},
    {"blind", blind_words},
    {"half blind", blind_words},
    {"scanner lies", scale_words},
    {"plate moved", moved_words},
}};

// Tenths, as a person would write them; a text shows no more.
double round_to(double value, double step) { return std::round(value / step) / std::round(1 / step); }

// Draws a case; `variant` counts the cases of the same cause.
class Drawing {
 public:
  explicit Drawing(std::uint64_t seed) : random_(seed, Stream::hard) {
    const std::uint64_t at = (seed - 1) % causes.size();
    variant_ = (seed - 1) / causes.size();
    case_.cause = &causes[at];
    case_.cell.seed = seed;
    case_.cell.plate = shape_names()[static_cast<std::size_t>(random_.uniform(0, 6))];
    case_.what = case_.cell.plate;
  }

  HardCase drawn() {
    const string_view cause = case_.cause->name;
    if (cause == "steep" || cause == "steep, large") draw_steep(cause == "steep, large");
    if (cause == "tall") draw_tall();
    if (cause == "tiny") draw_tiny();
    if (is_cut(cause)) draw_rim(cause);
    if (cause == "mount")
      fault(one_of({"mount-yawed 0.5", "mount-yawed 1", "mount-yawed -2", "mount-shifted 2",
                    "mount-shifted 5", "mount-shifted 8"}));
    if (cause == "noise") fault(one_of({"noise 5", "noise 20"}));
    if (cause == "robot lies") draw_lie();
    if (cause == "robot moves") draw_slip();
    if (cause == "blind")
      fault(one_of({"scanner-blind 1 from surface", "scanner-blind 1 from 25", "scanner-blind 1"}));
    if (cause == "half blind")
      fault(fmt::format("scanner-blind {:.2f} from {}", random_.uniform(0.2, 0.8),
                        one_of({"surface", "1", "12"})));
    if (cause == "scanner lies")
      fault(one_of({"scanner-freezes from 3", "scanner-freezes from surface", "scanner-scales 2",
                    "scanner-scales -5", "scanner-scales 10", "scanner-mirrors",
                    "scanner-mirrors from surface"}));
    if (cause == "plate moved") draw_push();
    return std::move(case_);
  }

 private:
  const char* one_of(std::initializer_list<const char*> all) { return all.begin()[variant_ % all.size()]; }
  double size(double low, double high) { return round_to(random_.uniform(low, high), 0.1); }
  void say(const std::string& what) { case_.what += ", " + what; }
  void fault(const std::string& text) {
    case_.cell.faults = *faults_from(text);
    say(text);
  }
  static bool is_cut(string_view cause) {
    return cause == "ragged" || cause == "notched" || cause == "stepped" || cause == "corner cut" ||
           cause == "rounded" || cause == "scalloped" || cause == "corners" || cause == "holed";
  }

  void draw_steep(bool large) {
    case_.cell.plate = case_.what = one_of({"wave", "saddle", "twist", "dome"});
    case_.cell.amplitude_mm = size(12, 40);
    if (large) {
      case_.cell.arm = ArmKind::gantry;
      case_.cell.sizes = {.width_mm = size(500, 1500), .depth_mm = size(400, 900)};
      case_.cell.outline = OutlineKind::rectangle;
      say(fmt::format("{} x {} mm", case_.cell.sizes.width_mm, case_.cell.sizes.depth_mm));
    }
    say(fmt::format("amplitude {} mm", case_.cell.amplitude_mm));
  }

  void draw_tall() {
    switch (variant_ % 4) {
      case 0:
        case_.cell.plate = "dome";
        case_.cell.amplitude_mm = 40;
        case_.what = "dome, amplitude 40 mm";
        return;
      case 1:
        case_.cell.plate = "cylinder";
        case_.cell.radius_mm = 250;
        case_.what = "cylinder, radius 250 mm";
        return;
      case 2:
        case_.cell.thickness_mm = 100;
        return say("100 mm thick");
      default:
        case_.cell.thickness_mm = size(40, 100);
        case_.cell.plate = case_.what = "saddle";
        case_.cell.amplitude_mm = 30;
        return say(fmt::format("amplitude 30 mm, {} mm thick", case_.cell.thickness_mm));
    }
  }

  void draw_tiny() {
    auto& s = case_.cell.sizes;
    s.width_mm = size(40, 105);
    s.depth_mm = variant_ % 3 == 0 ? s.width_mm : size(40, 300);
    case_.cell.amplitude_mm = 0.03 * std::min(s.width_mm, s.depth_mm);
    case_.cell.outline = variant_ % 3 == 2 ? OutlineKind::trapezoid : OutlineKind::rectangle;
    if (variant_ % 3 == 2) s.top_width_mm = 0.7 * s.width_mm;
    say(fmt::format("{} x {} mm{}", s.width_mm, s.depth_mm, variant_ % 3 == 2 ? ", trapezoid" : ""));
  }

  void draw_lie() {
    switch (variant_ % 8) {
      case 0:
      case 1:
        return fault(fmt::format("robot-lies {} at {}", variant_ % 2 == 0 ? 5 : 50, 3 + variant_ % 20));
      case 2:
        return fault(fmt::format("robot-lies {}", size(0.5, 20)));
      case 3:
        return fault(fmt::format("robot-tilts {} at {}", size(0.1, 5), 3 + variant_ % 20));
      case 4:
        return fault(fmt::format("robot-tilts {}", size(0.1, 5)));
      case 5:
        return fault(fmt::format("robot-stays from {}", 3 + variant_ % 20));
      case 6:
        return fault("robot-lies 5000");
      default:
        return fault(fmt::format("robot-lies {} from surface", size(0.5, 5)));
    }
  }

  void draw_slip() {
    switch (variant_ % 5) {
      case 0:
        return fault(fmt::format("robot-slips {} at {}", size(1, 20), 3 + variant_ % 20));
      case 1:
        return fault(fmt::format("robot-slips {} from {}", size(1, 20), 3 + variant_ % 20));
      case 2:
        return fault(fmt::format("robot-drifts {:.2f}", random_.uniform(0.02, 0.3)));
      case 3:
        return fault(fmt::format("robot-leans {} from {}", size(0.2, 2), 3 + variant_ % 20));
      default:
        return fault(fmt::format("robot-slips {} from surface", size(1, 10)));
    }
  }

  void draw_push() {
    const std::string when = variant_ % 2 == 0 ? "" : " from surface";
    switch (variant_ % 3) {
      case 0:
        return fault(fmt::format("plate-pushed {}{}", size(1, 20), when));
      case 1:
        return fault(fmt::format("plate-turned {}{}", size(0.3, 3), when));
      default:
        return fault(fmt::format("plate-lifted {}{}", size(1, 20), when));
    }
  }

  // On the default square, with the surface of the plate that was drawn.
  void draw_rim(string_view cause) {
    const auto c = outline_corners(OutlineKind::square, {});
    const auto side = static_cast<std::size_t>(random_.uniform(0, 4));
    std::vector<Outline> holes;
    Outline rim{c.begin(), c.end()};
    if (cause == "ragged") {
      const double depth = size(2, 12);
      rim = ragged(c, size(6, 25), depth, random_);
      say(fmt::format("ragged, teeth of {} mm", depth));
    } else if (cause == "notched") {
      const double width = size(10, 100), depth = size(5, 60);
      rim = notched(c, side, random_.uniform(0.3, 0.7), width, depth);
      say(fmt::format("a notch of {} x {} mm", width, depth));
    } else if (cause == "stepped") {
      const double depth = size(2, 60);
      rim = stepped(c, side, depth);
      say(fmt::format("a step of {} mm", depth));
    } else if (cause == "corner cut") {
      const double length = size(5, 100);
      rim = corner_cut(c, side, length);
      say(fmt::format("a corner cut by {} mm", length));
    } else if (cause == "rounded") {
      const double radius = size(3, 60);
      rim = rounded(c, radius);
      say(fmt::format("corners of radius {} mm", radius));
    } else if (cause == "scalloped") {
      const double depth = size(2, 15), pitch = size(20, 80);
      rim = scalloped(c, pitch, depth);
      say(fmt::format("scallops of {} x {} mm", pitch, depth));
    } else if (cause == "corners") {
      const std::size_t count = variant_ % 2 == 0 ? 3 : 5 + variant_ % 4;
      rim = regular(count, size(130, 160));
      say(fmt::format("{} corners", count));
    } else {
      const double radius = size(3, 50);
      Outline hole = regular(36, radius);
      const Eigen::Vector2d at{random_.uniform(-60, 60), random_.uniform(-60, 60)};
      for (auto& p : hole) p += at;
      holes.push_back(hole);
      say(fmt::format("a hole of radius {} mm", radius));
    }
    const auto base = make_plate({.shape = *shape_named(case_.cell.plate), .corners = c});
    case_.cell.made = make_cut_plate(case_.cell.plate, *base, std::move(rim), holes);
  }

  Random random_;
  std::uint64_t variant_ = 0;
  HardCase case_;
};

bool holds_word(string_view text, string_view word) {
  const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  return std::ranges::search(text, word, same).begin() != text.end();
}

}  // namespace

std::span<const Cause> hard_causes() { return causes; }

HardCase hard_case(std::uint64_t seed) { return Drawing(seed).drawn(); }

bool names(const Cause& cause, std::string_view said) {
  return std::ranges::any_of(cause.words,
                             [&](string_view word) { return !word.empty() && holds_word(said, word); });
}

}  // namespace moldloft::host_sim
