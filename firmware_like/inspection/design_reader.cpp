#include "firmware_like/inspection/design_reader.hpp"

#include "firmware_like/inspection/point_list.hpp"
#include "firmware_like/inspection/text_fields.hpp"
#include "firmware_like/process/json_file.hpp"
#include "firmware_like/results/stored_result.hpp"
#include "firmware_like/run/surface_file.hpp"
#include "geometry/splines/refinement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;
using geometry::DesignFace;

constexpr std::uintmax_t largest_file = 2'000'000'000;

std::unexpected<Failure> refuse(const fs::path& file, std::string_view why) {
  return std::unexpected(Failure{fmt::format("{}: {}", file.string(), why)});
}

bool are_numbers(const Json& json, std::size_t count) {
  return json.is_array() && json.size() == count && std::ranges::all_of(json, &Json::is_number);
}

// Weights that are all alike change nothing.
bool are_rational(const Json& weights) {
  return std::ranges::any_of(weights, [&](const Json& weight) { return weight != weights.front(); });
}

std::expected<DesignFace, std::string> face_of(const Json& json) {
  DesignFace face;
  auto& s = face.surface;
  s.degree_u = json.at("degree_u").get<int>();
  s.degree_v = json.at("degree_v").get<int>();
  if (std::min(s.degree_u, s.degree_v) < 1 || std::max(s.degree_u, s.degree_v) > 3)
    return std::unexpected("is of a degree beyond 3; moldloft-cad writes bicubic faces");
  if (json.contains("weights") && are_rational(json.at("weights")))
    return std::unexpected("is rational; moldloft-cad writes faces without weights");
  s.knots_u = json.at("knots_u").get<std::vector<double>>();
  s.knots_v = json.at("knots_v").get<std::vector<double>>();
  const auto& control = json.at("control");
  const auto rows = static_cast<Eigen::Index>(s.knots_u.size()) - s.degree_u - 1,
             columns = static_cast<Eigen::Index>(s.knots_v.size()) - s.degree_v - 1;
  if (rows <= s.degree_u || columns <= s.degree_v ||
      control.size() != static_cast<std::size_t>(rows * columns))
    return std::unexpected("knots and control points do not fit together");
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(rows, columns);
  std::size_t at = 0;
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index k = 0; k < columns; ++k, ++at) {
      if (!are_numbers(control[at], 3))
        return std::unexpected(fmt::format("control point {} is not three numbers", at + 1));
      s.x(i, k) = control[at].at(0);
      s.y(i, k) = control[at].at(1);
      s.z(i, k) = control[at].at(2);
    }
  }
  if (const auto fine = geometry::check(s); !fine)
    return std::unexpected(std::string{geometry::to_string(fine.error())});
  if (!s.bicubic()) s = geometry::elevate(s, geometry::cubic, geometry::cubic);
  if (!json.contains("trims")) return face;
  for (const auto& loop : json.at("trims")) {
    face.trims.emplace_back();
    for (const auto& p : loop) {
      if (!are_numbers(p, 2))
        return std::unexpected(fmt::format("a corner of trim {} is not two numbers", face.trims.size()));
      face.trims.back().push_back({p.at(0).get<double>(), p.at(1).get<double>()});
    }
  }
  return face;
}

std::expected<Design, Failure> read_design_json(const fs::path& path, const Json& json) {
  Design design{.file = path.string(),
                .name = path.stem().string(),
                .faces = {},
                .points = {},
                .edges = {},
                .templates = {},
                .mm_per_unit = 1.0,
                .remarks = {}};
  try {
    if (json.at("version") != 1)
      return refuse(path, "is of another version of moldloft-design; version 1 is needed");
    if (json.at("unit") != "mm") return refuse(path, "moldloft-design is in mm");
    for (const auto& one : json.at("faces")) {
      auto face = face_of(one);
      if (!face) return refuse(path, fmt::format("face {}: {}", design.faces.size() + 1, face.error()));
      design.faces.push_back(std::move(*face));
    }
  } catch (const Json::exception& error) {
    return refuse(path, error.what());
  }
  if (design.faces.empty()) return refuse(path, "holds no face");
  if (design.faces.size() > 1) design.remarks.push_back(fmt::format("{} faces", design.faces.size()));
  return design;
}

std::expected<Design, Failure> read_json_design(const fs::path& path) {
  const auto json = read_json(path);
  if (!json) return std::unexpected(json.error());
  if (json->is_object() && json->value("format", "") == std::string{"moldloft-design"})
    return read_design_json(path, *json);
  if (!json->is_object() || !json->contains("control"))
    return refuse(path, "is neither a surface.json of a run nor a moldloft-design");
  auto surface = read_surface(path);
  if (!surface) return std::unexpected(surface.error());
  Design design{.file = path.string(),
                .name = path.stem().string(),
                .faces = {},
                .points = {},
                .edges = {},
                .templates = {},
                .mm_per_unit = 1.0,
                .remarks = {}};
  design.faces.push_back({std::move(*surface), {}});
  return design;
}

std::expected<Design, Failure> read_run(const fs::path& folder) {
  const auto result = read_result(folder);
  if (!result) return std::unexpected(result.error());
  if (!result->measured || !is_measured(result->outcome))
    return refuse(folder, fmt::format("that run is {}: it has no surface to be compared with",
                                      to_string(result->outcome)));
  Design design{.kind = DesignKind::earlier_run,
                .file = folder.string(),
                .name = result->label.plate,
                .faces = {},
                .points = {},
                .edges = {},
                .templates = {},
                .mm_per_unit = 1.0,
                .remarks = {}};
  design.faces.push_back({result->measured->surface, {}});
  return design;
}

// The program beside this one, else on the path.
std::string cad_program() {
  std::error_code failed;
  const fs::path self = fs::read_symlink("/proc/self/exe", failed);
  const fs::path beside = self.parent_path() / "moldloft-cad";
  return !failed && fs::exists(beside, failed) ? beside.string() : "moldloft-cad";
}

struct Ended {
  bool started = false;
  int status = 0;
  std::string words;  // its line on standard error
};

// Its answer is not ours to show, its complaint is ours to tell.
Ended run_program(std::vector<std::string> words, const fs::path& complaint) {
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, complaint.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0600);
  pid_t child = 0;
  Ended ended;
  ended.started = posix_spawnp(&child, arguments[0], &files, nullptr, arguments.data(), environ) == 0;
  posix_spawn_file_actions_destroy(&files);
  if (!ended.started) return ended;
  while (waitpid(child, &ended.status, 0) < 0 && errno == EINTR) {
  }
  std::ifstream in{complaint};
  std::getline(in, ended.words);
  if (ended.words.starts_with("moldloft-cad: "))
    ended.words.erase(0, std::string_view{"moldloft-cad: "}.size());
  return ended;
}

std::expected<Design, Failure> read_cad(const fs::path& path) {
  std::string folder = (fs::temp_directory_path() / "moldloft-design-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr)
    return refuse(path, "no folder for its conversion can be made under the temporary files");
  const fs::path out = fs::path{folder} / "design.json";
  const auto ended = run_program({cad_program(), "import", path.string(), "--out", out.string()},
                                 fs::path{folder} / "words");
  const bool missing = !ended.started || (WIFEXITED(ended.status) && WEXITSTATUS(ended.status) == 127);
  std::expected<Design, Failure> design;
  if (missing) {
    design = refuse(
        path,
        "CAD files are read by moldloft-cad, which is not installed: install the package moldloft-cad, or "
        "export the surface as points");
  } else if (ended.status != 0) {
    design = ended.words.empty() ? refuse(path, "moldloft-cad ended without a word, and read nothing")
                                 : std::unexpected(Failure{ended.words});
  } else {
    design = read_json_design(out);
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  if (design) design->file = path.string(), design->name = path.stem().string();
  return design;
}

// The seams along all frames and the two ends, where the list says them: what the outline is laid on.
std::vector<Eigen::Vector3d> template_edges(const TemplateList& list) {
  struct Ends {
    Eigen::Vector3d lower, upper;
  };
  std::vector<Ends> ends;
  for (const auto& frame : list.frames) {
    if (!frame.lower_mm || !frame.upper_mm || !list.before_first_mm || !list.after_last_mm) return {};
    const auto height_at = [&](double way) {
      const double column = way / list.distance_mm;
      auto next = std::ranges::find_if(frame.pins, [&](const TemplatePin& p) { return p.column >= column; });
      if (next == frame.pins.begin()) ++next;
      if (next == frame.pins.end()) --next;
      const auto &a = *std::prev(next), &b = *next;
      return a.height_mm + (b.height_mm - a.height_mm) * (column - a.column) / (b.column - a.column);
    };
    ends.push_back({frame.middle + Eigen::Vector3d{0, -*frame.lower_mm, height_at(-*frame.lower_mm)},
                    frame.middle + Eigen::Vector3d{0, *frame.upper_mm, height_at(*frame.upper_mm)}});
  }
  const auto beyond = [](const Ends& from, const Ends& to, double way) {
    const double part = way / (to.lower.x() - from.lower.x());
    return Ends{from.lower + part * (to.lower - from.lower), from.upper + part * (to.upper - from.upper)};
  };
  const auto last = ends.size() - 1;
  const Ends before = beyond(ends[0], ends[1], -*list.before_first_mm);
  const Ends after = beyond(ends[last], ends[last - 1], *list.after_last_mm);
  ends.insert(ends.begin(), before);
  ends.push_back(after);
  const double all = (ends.back().lower - ends.front().lower).norm();
  std::vector<Eigen::Vector3d> edges;
  const auto line = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const int count = std::max(1, static_cast<int>(std::lround(80 * (b - a).norm() / all)));
    for (int i = 0; i < count; ++i) edges.push_back(a + (b - a) * (i + 0.5) / count);
  };
  for (std::size_t i = 1; i < ends.size(); ++i) {
    line(ends[i - 1].lower, ends[i].lower);
    line(ends[i - 1].upper, ends[i].upper);
  }
  line(ends.front().lower, ends.front().upper);
  line(ends.back().lower, ends.back().upper);
  return edges;
}

Design design_from(TemplateList list, const fs::path& path) {
  Design design{.kind = DesignKind::templates,
                .file = path.string(),
                .name = list.plate,
                .faces = {},
                .points = {},
                .edges = {},
                .templates = {},
                .mm_per_unit = 1.0,
                .remarks = {}};
  for (const auto& frame : list.frames) {
    for (const auto& pin : frame.pins) {
      const double way = pin.column * list.distance_mm;
      // The curve is drawn on to the first pin outside the plate: that one stands on nothing.
      if ((frame.lower_mm && way < -*frame.lower_mm) || (frame.upper_mm && way > *frame.upper_mm)) continue;
      design.points.push_back(frame.place(pin, list.distance_mm));
    }
  }
  design.remarks.push_back(
      fmt::format("{} frames, pins every {:g} mm", list.frames.size(), list.distance_mm));
  design.edges = template_edges(list);
  design.templates = std::move(list);
  return design;
}

std::expected<Design, Failure> read_text(const fs::path& path, const std::string& unit) {
  std::ifstream in{path, std::ios::binary};
  if (!in) return refuse(path, "cannot be read");
  const std::string text{std::istreambuf_iterator<char>{in}, {}};
  if (looks_like_templates(text)) {
    auto list = read_templates(text, path.string());
    if (!list) return std::unexpected(list.error());
    return design_from(std::move(*list), path);
  }
  auto points = read_points(text, path.string());
  if (!points) return std::unexpected(points.error());
  Design design{.kind = DesignKind::points,
                .file = path.string(),
                .name = path.stem().string(),
                .faces = {},
                .points = std::move(points->points),
                .edges = {},
                .templates = {},
                .mm_per_unit = points->mm_per_unit,
                .remarks = {points->understood}};
  if (!unit.empty()) {
    const auto said = mm_per_unit_named(unit);
    if (design.mm_per_unit && *design.mm_per_unit != *said)
      return refuse(path, fmt::format("says another unit than --unit {}", unit));
    design.mm_per_unit = said;
  }
  return design;
}

}  // namespace

std::string_view to_string(DesignKind kind) {
  switch (kind) {
    case DesignKind::surface:
      return "surface";
    case DesignKind::points:
      return "points";
    case DesignKind::templates:
      return "templates";
    case DesignKind::earlier_run:
      return "earlier run";
  }
  return "";
}

std::expected<Design, Failure> read_design(const fs::path& path, const std::string& unit) {
  std::error_code failed;
  if (!fs::exists(path, failed)) return refuse(path, "no such file or run");
  if (!unit.empty() && !mm_per_unit_named(unit))
    return std::unexpected(Failure{fmt::format("--unit: '{}' given; mm, cm, m, in or ft is wanted", unit)});
  if (fs::is_directory(path, failed)) return read_run(path);
  if (fs::is_regular_file(path, failed) && fs::file_size(path, failed) > largest_file)
    return refuse(path, "is larger than 2 GB");
  const std::string ending = capitals(path.extension().string());
  if (ending == ".JSON") return read_json_design(path);
  if (ending == ".STP" || ending == ".STEP" || ending == ".IGS" || ending == ".IGES") return read_cad(path);
  return read_text(path, unit);
}

Json design_json(std::span<const DesignFace> faces, const std::string& source) {
  Json list = Json::array();
  for (const auto& face : faces) {
    const auto& s = face.surface;
    Json control = Json::array();
    for (int i = 0; i < s.control_u(); ++i) {
      for (int k = 0; k < s.control_v(); ++k) control.push_back({s.x(i, k), s.y(i, k), s.z(i, k)});
    }
    Json one{{"degree_u", 3},
             {"degree_v", 3},
             {"knots_u", s.knots_u},
             {"knots_v", s.knots_v},
             {"control", control}};
    for (const auto& loop : face.trims) {
      Json points = Json::array();
      for (const auto& p : loop) points.push_back({p.x(), p.y()});
      one["trims"].push_back(points);
    }
    list.push_back(one);
  }
  return {{"format", "moldloft-design"},
          {"version", 1},
          {"unit", "mm"},
          {"source", {{"file", source}}},
          {"faces", list}};
}

}  // namespace moldloft::firmware_like
