#include "firmware_like/inspection/point_list.hpp"

#include "firmware_like/inspection/text_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

constexpr double largest = 1e9;  // of a coordinate, in any unit
constexpr std::size_t most_points = 20'000'000;

struct UnitWord {
  std::string_view word;
  double mm;
};
constexpr std::array<UnitWord, 17> units{{{"MM", 1},
                                          {"MILLIMETRE", 1},
                                          {"MILLIMETER", 1},
                                          {"MILLIMETRES", 1},
                                          {"MILLIMETERS", 1},
                                          {"CM", 10},
                                          {"M", 1000},
                                          {"METRE", 1000},
                                          {"METER", 1000},
                                          {"METRES", 1000},
                                          {"METERS", 1000},
                                          {"IN", 25.4},
                                          {"INCH", 25.4},
                                          {"INCHES", 25.4},
                                          {"FT", 304.8},
                                          {"FEET", 304.8},
                                          {"UM", 0.001}}};

// How the file's numbers are separated and written, as its lines show.
struct Style {
  std::optional<char> separator;
  bool decimal_comma = false;
  std::string words() const {
    const std::string between = !separator           ? "blanks"
                                : *separator == ';'  ? "semicolons"
                                : *separator == '\t' ? "tabs"
                                                     : "commas";
    return fmt::format("{} between numbers, decimal {}", between, decimal_comma ? "comma" : "point");
  }
};

constexpr std::array<Style, 7> styles{{{';', false},
                                       {';', true},
                                       {'\t', false},
                                       {'\t', true},
                                       {',', false},
                                       {std::nullopt, false},
                                       {std::nullopt, true}}};

bool is_remark(std::string_view line) {
  const auto at = line.find_first_not_of(" \t");
  if (at == std::string_view::npos) return true;
  return std::string_view{"#!%$*"}.find(line[at]) != std::string_view::npos ||
         line.substr(at).starts_with("//");
}

// The first three numbers of a line and how many stand behind them; words before them are a name. An integer before
// exactly three more numbers, or six, is the point's number.
struct Row {
  Eigen::Vector3d at;
  std::size_t numbers = 0;
};

std::optional<Row> row_of(std::string_view line, const Style& style) {
  std::vector<double> numbers;
  bool begun = false;
  for (const auto& field : fields_of(line, style.separator)) {
    const auto number = number_of(field.text, style.decimal_comma);
    if (!number && begun && !field.text.empty()) break;  // a word behind the numbers
    if (!number) continue;
    begun = true;
    numbers.push_back(*number);
  }
  if (numbers.size() < 3) return std::nullopt;
  return Row{{numbers[0], numbers[1], numbers[2]}, numbers.size()};
}

Style style_of(const std::vector<std::string>& lines) {
  Style best;
  std::size_t most = 0;
  for (const auto& style : styles) {
    std::size_t read = 0, tried = 0;
    for (const auto& line : lines) {
      if (is_remark(line)) continue;
      if (++tried > 200) break;
      // A separating comma that leaves blanks inside a field is none.
      read += row_of(line, style) ? 1 : 0;
    }
    if (read > most) most = read, best = style;
  }
  return best;
}

// Counts 1, 2, 3, ... before the coordinates.
bool is_numbered(const std::vector<std::string>& lines, const Style& style, std::size_t numbers) {
  if (numbers != 4 && numbers != 7) return false;
  double before = -1;
  std::size_t seen = 0;
  for (const auto& line : lines) {
    if (is_remark(line)) continue;
    const auto row = row_of(line, style);
    if (!row) continue;
    if (row->at.x() != std::floor(row->at.x()) || (seen > 0 && row->at.x() != before + 1)) return false;
    before = row->at.x();
    if (++seen > 200) break;
  }
  return seen > 3;
}

// Which columns hold x, y and z, where a head names them: not every machine writes them in this order, or first.
struct Columns {
  std::array<std::size_t, 3> of_axis{};
  std::size_t count = 0;  // of fields in a line
};

std::optional<Columns> columns_named(std::string_view line, const Style& style) {
  std::vector<std::string> names;
  for (const auto& field : fields_of(line, style.separator)) {
    std::string name = capitals(field.text);
    std::erase_if(name, [](char c) { return c == '"' || c == '#' || c == '\''; });
    const auto end = std::ranges::find_if_not(name, [](char c) { return c >= 'A' && c <= 'Z'; });
    // "[mm]" behind a blank belongs to the name before; between separators every field is a column.
    if (!style.separator && (name.empty() || name[0] == '[' || name[0] == '(')) continue;
    names.emplace_back(name.begin(), end);
  }
  Columns columns{.count = names.size()};
  for (const std::size_t axis : {0u, 1u, 2u}) {
    const std::string wanted(1, "XYZ"[axis]);
    if (std::ranges::count(names, wanted) != 1) return std::nullopt;
    columns.of_axis[axis] = static_cast<std::size_t>(std::ranges::find(names, wanted) - names.begin());
  }
  return columns;
}

std::optional<Eigen::Vector3d> at_columns(std::string_view line, const Style& style, const Columns& columns) {
  const auto fields = fields_of(line, style.separator);
  if (fields.size() != columns.count) return std::nullopt;
  Eigen::Vector3d at;
  for (const std::size_t axis : {0u, 1u, 2u}) {
    const auto number = number_of(fields[columns.of_axis[axis]].text, style.decimal_comma);
    if (!number) return std::nullopt;
    at[static_cast<Eigen::Index>(axis)] = *number;
  }
  return at;
}

std::optional<Eigen::Vector3d> place_of(const Row& row, bool numbered, std::string_view line,
                                        const Style& style) {
  if (!numbered) return row.at;
  std::vector<double> all;
  for (const auto& field : fields_of(line, style.separator)) {
    if (const auto number = number_of(field.text, style.decimal_comma)) all.push_back(*number);
  }
  return Eigen::Vector3d{all[1], all[2], all[3]};
}

std::optional<double> unit_in(std::string_view line) {
  std::string words = capitals(line);
  for (char& c : words) {
    if (!(c >= 'A' && c <= 'Z')) c = ' ';
  }
  for (const auto& field : fields_of(words)) {
    if (field.text == "M" || field.text == "IN") continue;  // alone they are words too; "[m]" is seen below
    if (const auto mm = mm_per_unit_named(field.text)) return mm;
  }
  const std::string all = capitals(line);
  for (const auto& unit : units) {
    for (const auto& shape :
         {"[{}]", "({})", "UNIT {}", "UNIT={}", "UNITS={}", "UNIT: {}", "UNITS: {}", "UNITS {}"}) {
      const std::string text = fmt::format(fmt::runtime(shape), unit.word);
      const auto at = all.find(text);
      if (at == std::string::npos) continue;
      const std::size_t end = at + text.size();
      if (end == all.size() || !(all[end] >= 'A' && all[end] <= 'Z')) return unit.mm;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<double> mm_per_unit_named(std::string_view word) {
  const std::string upper = capitals(word);
  const auto found = std::ranges::find(units, upper, &UnitWord::word);
  if (found == units.end()) return std::nullopt;
  return found->mm;
}

std::expected<PointList, Failure> read_points(std::string_view text, const std::string& file) {
  const auto refused = [&](std::string_view why) {
    return std::unexpected(Failure{fmt::format("{}: {}", file, why)});
  };
  if (text.find('\0') != std::string_view::npos)
    return refused("is no text; points are wanted as lines of x y z");
  const auto lines = lines_of(text);
  const Style style = style_of(lines);
  PointList list;
  std::size_t numbers = 0;
  bool numbered = false;
  std::optional<Columns> columns;
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const auto row = is_remark(lines[n]) ? std::nullopt : row_of(lines[n], style);
    if (!row) {
      if (list.points.empty()) {
        if (const auto unit = unit_in(lines[n])) list.mm_per_unit = unit;
        if (const auto named = columns_named(lines[n], style)) columns = named;
      }
      if (list.points.empty() || is_remark(lines[n])) continue;
      return refused(fmt::format("line {} holds no point: '{:.60}'", n + 1, lines[n]));
    }
    if (list.points.empty()) {
      numbers = row->numbers;
      // A head of other columns than the lines below it says nothing of them.
      if (columns && fields_of(lines[n], style.separator).size() != columns->count) columns.reset();
      numbered = !columns && is_numbered(lines, style, numbers);
    } else if (row->numbers != numbers) {
      return refused(
          fmt::format("line {} has {} numbers, those before have {}", n + 1, row->numbers, numbers));
    }
    const auto place =
        columns ? at_columns(lines[n], style, *columns) : place_of(*row, numbered, lines[n], style);
    if (!place) return refused(fmt::format("line {} holds no point: '{:.60}'", n + 1, lines[n]));
    const Eigen::Vector3d& at = *place;
    if (at.cwiseAbs().maxCoeff() > largest)
      return refused(fmt::format("line {}: a coordinate beyond {:g} cannot be", n + 1, largest));
    if (list.points.size() == most_points) return refused(fmt::format("more than {} points", most_points));
    list.points.push_back(at);
  }
  if (list.points.size() < 6)
    return refused(
        fmt::format("{} points were found; 6 or more lines of x y z are wanted", list.points.size()));
  list.understood = fmt::format("{} points: {}{}{}", list.points.size(), style.words(),
                                numbered ? ", a number before each" : "",
                                columns ? ", columns as the head names them" : "");
  return list;
}

}  // namespace moldloft::firmware_like
