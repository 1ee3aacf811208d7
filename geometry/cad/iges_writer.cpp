#include "geometry/cad/iges_writer.hpp"

#include "geometry/cad/cad_text.hpp"
#include "geometry/cad/face_edges.hpp"

#include <algorithm>
#include <cassert>
#include <string_view>
#include <utility>

namespace moldloft::geometry {

namespace {

constexpr std::size_t line_columns = 72;       // before the section's letter
constexpr std::size_t longest_count = 8;       // of a Hollerith string, with its H
constexpr std::size_t parameter_columns = 64;  // of a parameter line; then a blank and the directory's number

std::string padded_left(std::string_view text, std::size_t width) {
  assert(text.size() <= width);
  return std::string(width - text.size(), ' ') + std::string(text);
}
std::string padded_right(std::string text, std::size_t width) {
  assert(text.size() <= width);
  text.resize(width, ' ');
  return text;
}

// The lines of one section, numbered in columns 73 to 80.
class Section {
 public:
  explicit Section(char letter) : letter_(letter) {}
  void add(const std::string& content) {
    text_ += padded_right(content, line_columns) + letter_ + padded_left(std::to_string(++lines_), 7) + "\n";
  }
  int lines() const { return lines_; }
  const std::string& text() const { return text_; }

 private:
  char letter_;
  int lines_ = 0;
  std::string text_;
};

enum class Use { geometry, parameters };
enum class Standing { independent, part_of_another };

class IgesText {
 public:
  // Adds an entity with its parameters and returns its directory's number, by which others refer to it.
  int add(int type, std::vector<std::string> parameters, Standing standing, Use use, std::string_view label) {
    const int number = directory_.lines() + 1;
    const int first_line = data_.lines() + 1;
    parameters.insert(parameters.begin(), std::to_string(type));
    for (std::size_t i = 0; i < parameters.size(); ++i)
      parameters[i] += i + 1 < parameters.size() ? ',' : ';';
    std::string line;
    const auto put_line = [&] {
      data_.add(padded_right(line, parameter_columns) + " " + padded_left(std::to_string(number), 7));
      line.clear();
    };
    for (const std::string& parameter : parameters) {
      if (line.size() + parameter.size() > parameter_columns) put_line();
      line += parameter;
    }
    put_line();
    const std::string kind = std::to_string(type);
    const std::string status = std::string("00") + (standing == Standing::independent ? "00" : "01") +
                               (use == Use::geometry ? "00" : "05") + "00";
    directory_.add(fields({kind, std::to_string(first_line), "0", "1", "0", "0", "0", "0", status}));
    directory_.add(fields({kind, "0", "0", std::to_string(data_.lines() - first_line + 1), "0", "", "",
                           std::string(label), "0"}));
    return number;
  }
  const Section& directory() const { return directory_; }
  const Section& data() const { return data_; }

 private:
  static std::string fields(const std::vector<std::string>& texts) {
    std::string line;
    for (const std::string& text : texts) line += padded_left(text, 8);
    return line;
  }
  Section directory_{'D'}, data_{'P'};
};

void append_reals(std::vector<std::string>& parameters, const std::vector<double>& numbers) {
  for (const double x : numbers) parameters.push_back(iges_real(x));
}

Eigen::Vector3d in_space(const Eigen::Vector3d& p) { return p; }
Eigen::Vector3d in_space(const Eigen::Vector2d& p) { return {p.x(), p.y(), 0}; }

template <typename Curve>
int curve(IgesText& iges, const Curve& c, Use use) {
  const std::size_t n = c.control.size();
  const bool closed = c.control.front() == c.control.back(), plane = use == Use::parameters;
  std::vector<std::string> p = {
      std::to_string(n - 1), std::to_string(cubic), plane ? "1" : "0", closed ? "1" : "0", "1", "0"};
  append_reals(p, c.knots);
  append_reals(p, std::vector<double>(n, 1.0));
  for (const auto& control : c.control) {
    const Eigen::Vector3d at = in_space(control);
    append_reals(p, {at.x(), at.y(), at.z()});
  }
  append_reals(p, {c.knots.front(), c.knots.back(), 0, 0, plane ? 1.0 : 0.0});
  return iges.add(126, std::move(p), Standing::part_of_another, use, plane ? "PATH" : "EDGE");
}

int net(IgesText& iges, const BSplineSurface& s, Standing standing) {
  std::vector<std::string> p = {std::to_string(s.control_u() - 1),
                                std::to_string(s.control_v() - 1),
                                std::to_string(cubic),
                                std::to_string(cubic),
                                "0",
                                "0",
                                "1",
                                "0",
                                "0"};
  append_reals(p, s.knots_u);
  append_reals(p, s.knots_v);
  append_reals(p, std::vector<double>(static_cast<std::size_t>(s.x.size()), 1.0));
  for (int j = 0; j < s.control_v(); ++j) {
    for (int i = 0; i < s.control_u(); ++i) append_reals(p, {s.x(i, j), s.y(i, j), s.z(i, j)});
  }
  append_reals(p, {s.knots_u.front(), s.knots_u.back(), s.knots_v.front(), s.knots_v.back()});
  return iges.add(128, std::move(p), standing, Use::geometry, "SURFACE");
}

int joined(IgesText& iges, const std::vector<int>& curves, Use use) {
  if (curves.size() == 1) return curves.front();
  std::vector<std::string> p = {std::to_string(curves.size())};
  for (const int c : curves) p.push_back(std::to_string(c));
  return iges.add(102, std::move(p), Standing::part_of_another, use, "LOOP");
}

// IGES has no curve that is walked backwards: it is turned round.
int loop_on_surface(IgesText& iges, const FaceLoop& loop, int surface) {
  std::vector<int> paths, images;
  for (const FaceEdge& edge : loop.edges) {
    paths.push_back(curve(iges, edge.reversed ? reversed(edge.path) : edge.path, Use::parameters));
    images.push_back(curve(iges, edge.reversed ? reversed(edge.image) : edge.image, Use::geometry));
  }
  const int path = joined(iges, paths, Use::parameters), image = joined(iges, images, Use::geometry);
  constexpr std::string_view made_in_an_unknown_way = "0", path_is_preferred = "1";
  return iges.add(142,
                  {std::string(made_in_an_unknown_way), std::to_string(surface), std::to_string(path),
                   std::to_string(image), std::string(path_is_preferred)},
                  Standing::part_of_another, Use::geometry, "TRIM");
}

void trimmed(IgesText& iges, const std::vector<FaceLoop>& loops, int surface) {
  std::vector<int> curves;
  for (const FaceLoop& loop : loops)
    curves.push_back(loop.natural ? 0 : loop_on_surface(iges, loop, surface));
  const bool outer_is_given = curves.front() != 0;
  std::vector<std::string> p = {std::to_string(surface), outer_is_given ? "1" : "0",
                                std::to_string(curves.size() - 1), std::to_string(curves.front())};
  for (std::size_t i = 1; i < curves.size(); ++i) p.push_back(std::to_string(curves[i]));
  iges.add(144, std::move(p), Standing::independent, Use::geometry, "FACE");
}

std::string digits(int number, int width) {
  std::string text = std::to_string(number);
  return text.size() < static_cast<std::size_t>(width) ? std::string(width - text.size(), '0') + text : text;
}

std::string date(const CadStamp& s) {
  return iges_string(digits(s.year, 4) + digits(s.month, 2) + digits(s.day, 2) + "." + digits(s.hour, 2) +
                     digits(s.minute, 2) + digits(s.second, 2));
}

double largest_coordinate(const BSplineSurface& s) {
  return std::max({s.x.cwiseAbs().maxCoeff(), s.y.cwiseAbs().maxCoeff(), s.z.cwiseAbs().maxCoeff()});
}

// Only text in a Hollerith string may go on in the next line; everything else moves there whole.
Section global(const TrimmedSurface& face, const CadLabel& label) {
  const std::string name = iges_string(label.name), system = iges_string(label.system);
  const std::vector<std::string> parameters = {
      "1H,",
      "1H;",
      name,
      iges_string(label.file_name),
      system,
      system,
      "32",
      "38",
      "6",
      "308",
      "15",  // bits of an integer; power and digits of a real, then of a double
      name,
      "1.",
      "2",
      "2HMM",
      "1",
      "0.",  // model scale, millimetres, line weights
      date(label.stamp),
      iges_real(label.closure_mm),
      iges_real(largest_coordinate(face.surface)),
      iges_string(label.author),
      iges_string(label.organization),
      "11",
      "0",  // IGES 5.3, no drafting standard
      date(label.stamp),
      ""};
  Section section('G');
  std::string line;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    std::string text = parameters[i] + (i + 1 < parameters.size() ? ',' : ';');
    const bool overfull = line.size() + text.size() > line_columns;
    const bool count_is_cut = line.size() + longest_count > line_columns;
    if (overfull && (text.size() <= line_columns || count_is_cut)) section.add(std::exchange(line, {}));
    while (line.size() + text.size() > line_columns) {
      const std::size_t room = line_columns - line.size();
      section.add(std::exchange(line, {}) + text.substr(0, room));
      text.erase(0, room);
    }
    line += text;
  }
  section.add(line);
  return section;
}

Section start(const CadLabel& label) {
  Section section('S');
  const auto add = [&](const std::string& line) {
    std::string text = iges_string(line);
    text.erase(0, text.find('H') + 1);  // the start section is prose
    for (std::size_t at = 0; at < text.size(); at += line_columns) section.add(text.substr(at, line_columns));
  };
  add(label.name + ": " + label.description);
  for (const std::string& note : label.notes) add(note);
  return section;
}

}  // namespace

std::expected<std::string, Error> iges_text(const TrimmedSurface& face, const CadLabel& label) {
  const auto loops = face_edges(face, label.closure_mm);
  if (!loops) return std::unexpected(loops.error());
  const bool whole = loops->size() == 1 && loops->front().natural;
  IgesText iges;
  const int surface = net(iges, face.surface, whole ? Standing::independent : Standing::part_of_another);
  if (!whole) trimmed(iges, *loops, surface);

  const Section head = start(label), about = global(face, label);
  Section end('T');
  const auto count = [](char letter, const Section& s) {
    return letter + padded_left(std::to_string(s.lines()), 7);
  };
  end.add(count('S', head) + count('G', about) + count('D', iges.directory()) + count('P', iges.data()));
  return head.text() + about.text() + iges.directory().text() + iges.data().text() + end.text();
}

}  // namespace moldloft::geometry
