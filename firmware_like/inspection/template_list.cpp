#include "firmware_like/inspection/template_list.hpp"

#include "firmware_like/inspection/text_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

namespace moldloft::firmware_like {
namespace {

constexpr double largest_mm = 1e6;  // of a ship coordinate or a distance
constexpr double largest_height_mm = 20'000;
constexpr int most_columns = 200;

enum class Meaning { name, pin, lower, upper, sight, angle, unknown };

struct Head {
  Meaning meaning = Meaning::unknown;
  int column = 0;
  std::size_t end = 0;  // numbers stand flush right below their heads
};

std::optional<int> whole(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  int value = 0;
  const auto [stopped, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || stopped != text.data() + text.size() || std::abs(value) > most_columns)
    return std::nullopt;
  return value;
}

Head head_of(const Field& field) {
  const std::string word = capitals(field.text);
  const auto begins = [&](std::initializer_list<std::string_view> words) {
    return std::ranges::any_of(words, [&](std::string_view w) { return word.starts_with(w); });
  };
  Head head{.end = field.end};
  if (const auto column = whole(word)) {
    head.meaning = Meaning::pin, head.column = *column;
  } else if (begins({"FRAME", "FR.", "TEMPL", "SECTION"})) {
    head.meaning = Meaning::name;
  } else if (begins({"LOWER", "LOW"})) {
    head.meaning = Meaning::lower;
  } else if (begins({"UPPER", "UP"})) {
    head.meaning = Meaning::upper;
  } else if (begins({"SIGHT", "MARK"})) {
    head.meaning = Meaning::sight;
  } else if (begins({"ANGLE", "ANG"})) {
    head.meaning = Meaning::angle;
  }
  return head;
}

std::optional<char> separator_of(std::string_view line) {
  for (const char c : {';', '\t'}) {
    if (std::ranges::count(line, c) >= 3) return c;
  }
  return std::nullopt;
}

bool is_table_head(const std::vector<Head>& heads) {
  return !heads.empty() && heads[0].meaning == Meaning::name &&
         std::ranges::any_of(heads, [](const Head& h) { return h.meaning == Meaning::pin; });
}

class ListReader {
 public:
  ListReader(std::string_view text, const std::string& file) : file_{file} { list_.lines = lines_of(text); }
  std::expected<TemplateList, Failure> read();

 private:
  std::expected<void, Failure> read_line(std::size_t n);
  std::expected<void, Failure> read_row(std::size_t n, const std::vector<Field>&);
  std::expected<void, Failure> take(std::size_t n, TemplateFrame&, const Head&, const Field&);
  std::expected<void, Failure> read_middle(std::size_t n, const std::vector<Field>&);
  void read_keys(std::string_view line);
  std::expected<void, Failure> finish();
  std::unexpected<Failure> refuse(std::size_t n, std::string_view why) const {
    return std::unexpected(Failure{fmt::format("{} line {}: {}", file_, n + 1, why)});
  }
  TemplateFrame& frame_named(std::string_view);

  std::string file_;
  TemplateList list_;
  std::vector<Head> heads_;
  std::vector<std::string> middle_names_;
  std::map<std::string, int, std::less<>> middles_;  // how many coordinates each frame has
  bool in_middles_ = false;
};

TemplateFrame& ListReader::frame_named(std::string_view name) {
  const auto found = std::ranges::find(list_.frames, name, &TemplateFrame::name);
  if (found != list_.frames.end()) return *found;
  list_.frames.push_back({.name = std::string{name},
                          .pins = {},
                          .lower_mm = {},
                          .upper_mm = {},
                          .sight_mm = {},
                          .angle_deg = {}});
  return list_.frames.back();
}

// "KEY= value" pairs; a value goes on to the next key.
void ListReader::read_keys(std::string_view line) {
  const std::string all = capitals(line);
  const auto after = [&](std::string_view key) -> std::optional<std::string_view> {
    const auto at = all.find(key);
    if (at == std::string::npos) return std::nullopt;
    std::size_t begin = line.find_first_not_of(" \t=:", at + key.size());
    if (begin == std::string_view::npos) return std::nullopt;
    return line.substr(begin, std::min(line.find_first_of(" \t;", begin), line.size()) - begin);
  };
  if (const auto plate = after("PLATE="); plate && list_.plate.empty()) list_.plate = *plate;
  if (const auto distance = after("DISTANCE BETWEEN COLUMNS")) {
    if (const auto mm = number_of(*distance, true)) list_.distance_mm = *mm;
  }
  if (const auto at = all.find("LIMITS="); at != std::string::npos) {
    // "F40-200 -- F45+200": how far before the first frame and behind the last one.
    std::vector<double> ways;
    for (const auto& field : fields_of(line.substr(at + 7))) {
      const auto sign = field.text.find_last_of("+-");
      if (sign == std::string_view::npos || sign == 0) continue;
      if (const auto mm = number_of(field.text.substr(sign), true)) ways.push_back(*mm);
      if (ways.size() == 2) break;
    }
    if (ways.size() == 2) list_.before_first_mm = -ways[0], list_.after_last_mm = ways[1];
  }
}

std::expected<void, Failure> ListReader::take(std::size_t n, TemplateFrame& frame, const Head& head,
                                              const Field& field) {
  const auto number = number_of(field.text, true);
  if (!number) return refuse(n, fmt::format("'{}' is no number", field.text));
  switch (head.meaning) {
    case Meaning::pin:
      if (std::abs(*number) > largest_height_mm)
        return refuse(n, fmt::format("a height of {} mm cannot be", field.text));
      if (std::ranges::find(frame.pins, head.column, &TemplatePin::column) != frame.pins.end())
        return refuse(n, fmt::format("frame {} has column {} twice", frame.name, head.column));
      frame.pins.push_back({head.column, *number, n, field.begin, field.end});
      return {};
    case Meaning::lower:
      frame.lower_mm = *number;
      return {};
    case Meaning::upper:
      frame.upper_mm = *number;
      return {};
    case Meaning::sight:
      frame.sight_mm = *number;
      return {};
    case Meaning::angle:
      frame.angle_deg = *number;
      return {};
    case Meaning::name:
    case Meaning::unknown:
      return {};
  }
  return {};
}

std::expected<void, Failure> ListReader::read_row(std::size_t n, const std::vector<Field>& fields) {
  auto& frame = frame_named(fields[0].text);
  const bool complete = fields.size() == heads_.size();
  if (fields.size() > heads_.size()) return refuse(n, "more numbers than there are columns");
  std::size_t last = 0;
  for (std::size_t i = 1; i < fields.size(); ++i) {
    if (fields[i].text.empty()) continue;  // no pin there
    std::size_t at = i;
    if (!complete) {  // by where it stands: flush right below its head
      const auto off = [&](std::size_t k) {
        return std::abs(static_cast<double>(heads_[k].end) - static_cast<double>(fields[i].end));
      };
      at = 1;
      for (std::size_t k = 2; k < heads_.size(); ++k) {
        if (off(k) < off(at)) at = k;
      }
      if (at <= last)
        return refuse(n, fmt::format("'{}' does not stand below a column of its own", fields[i].text));
      last = at;
    }
    if (auto taken = take(n, frame, heads_[at], fields[i]); !taken) return taken;
  }
  return {};
}

// Rows FRAME, X, Y, Z below MIDDLE POINTS.
std::expected<void, Failure> ListReader::read_middle(std::size_t n, const std::vector<Field>& fields) {
  const std::string word = capitals(fields[0].text);
  if (word.starts_with("FR") || word.starts_with("TEMPL")) {
    middle_names_.clear();
    for (std::size_t i = 1; i < fields.size(); ++i) middle_names_.emplace_back(fields[i].text);
    return {};
  }
  const auto axis = std::string_view{"XYZ"}.find(word);
  if (word.size() != 1 || axis == std::string_view::npos) return {};  // a remark below the table
  if (fields.size() - 1 != middle_names_.size())
    return refuse(n, fmt::format("{} coordinates for {} frames", fields.size() - 1, middle_names_.size()));
  for (std::size_t i = 1; i < fields.size(); ++i) {
    const auto mm = number_of(fields[i].text, true);
    if (!mm || std::abs(*mm) > largest_mm)
      return refuse(n, fmt::format("'{}' is no coordinate in mm", fields[i].text));
    const auto frame = std::ranges::find(list_.frames, middle_names_[i - 1], &TemplateFrame::name);
    if (frame == list_.frames.end())
      return refuse(n, fmt::format("frame {} has no row of heights", middle_names_[i - 1]));
    frame->middle[static_cast<Eigen::Index>(axis)] = *mm;
    ++middles_[frame->name];
  }
  return {};
}

std::expected<void, Failure> ListReader::read_line(std::size_t n) {
  const std::string& line = list_.lines[n];
  const auto fields = fields_of(line, separator_of(line));
  if (fields.empty() || (fields.size() == 1 && fields[0].text.empty())) return {};
  if (capitals(line).find("MIDDLE POINT") != std::string::npos)
    return in_middles_ = true, std::expected<void, Failure>{};
  if (in_middles_) return read_middle(n, fields);
  std::vector<Head> heads;
  for (const auto& field : fields) heads.push_back(head_of(field));
  if (is_table_head(heads)) return heads_ = std::move(heads), std::expected<void, Failure>{};
  if (line.find('=') != std::string::npos) return read_keys(line), std::expected<void, Failure>{};
  if (heads_.empty() || fields.size() < 2) return {};
  return read_row(n, fields);
}

std::expected<void, Failure> ListReader::finish() {
  const auto refused = [&](std::string_view why) {
    return std::unexpected(Failure{fmt::format("{}: {}", file_, why)});
  };
  if (list_.frames.size() < 2)
    return refused("a template list needs two frames or more, each a row of heights");
  if (!(list_.distance_mm > 0) || list_.distance_mm > largest_mm)
    return refused("say the DISTANCE BETWEEN COLUMNS, in mm, above the table");
  std::size_t pins = 0;
  for (auto& frame : list_.frames) {
    std::ranges::sort(frame.pins, {}, &TemplatePin::column);
    pins += frame.pins.size();
    if (frame.pins.size() < 3)
      return refused(fmt::format("frame {} has fewer than three heights", frame.name));
    const auto found = middles_.find(frame.name);
    if (found == middles_.end() || found->second != 3)
      return refused(
          fmt::format("frame {} has no middle point: X, Y and Z are wanted below MIDDLE POINTS", frame.name));
  }
  std::ranges::stable_sort(list_.frames, {}, [](const TemplateFrame& f) { return f.middle.x(); });
  for (std::size_t i = 1; i < list_.frames.size(); ++i) {
    if (!(list_.frames[i].middle.x() > list_.frames[i - 1].middle.x()))
      return refused(fmt::format("frames {} and {} stand at the same X", list_.frames[i - 1].name,
                                 list_.frames[i].name));
  }
  return {};
}

std::expected<TemplateList, Failure> ListReader::read() {
  for (std::size_t n = 0; n < list_.lines.size(); ++n) {
    if (auto line = read_line(n); !line) return std::unexpected(line.error());
  }
  if (auto done = finish(); !done) return std::unexpected(done.error());
  return std::move(list_);
}

}  // namespace

bool looks_like_templates(std::string_view text) {
  const std::string all = capitals(text.substr(0, 4000));
  return all.find("TEMPLATE") != std::string::npos || all.find("MIDDLE POINT") != std::string::npos ||
         all.find("DISTANCE BETWEEN COLUMNS") != std::string::npos;
}

std::expected<TemplateList, Failure> read_templates(std::string_view text, const std::string& file) {
  return ListReader{text, file}.read();
}

std::string with_differences(const TemplateList& list,
                             const std::vector<std::vector<std::optional<double>>>& differences) {
  auto lines = list.lines;
  std::map<std::size_t, std::vector<std::pair<TemplatePin, std::string>>> by_line;
  for (std::size_t f = 0; f < list.frames.size(); ++f) {
    for (std::size_t p = 0; p < list.frames[f].pins.size(); ++p) {
      const auto& difference = differences[f][p];
      by_line[list.frames[f].pins[p].line].emplace_back(
          list.frames[f].pins[p], difference ? fmt::format("{:.1f}", *difference) : "-");
    }
  }
  for (auto& [n, pins] : by_line) {
    // From the right, so that the places of the others stay; a number takes the blanks before it when it is longer.
    std::ranges::sort(pins, std::greater{}, [](const auto& p) { return p.first.begin; });
    for (const auto& [pin, text] : pins) {
      std::size_t begin = pin.begin;
      const std::size_t length = pin.end - pin.begin;
      if (text.size() < length) {
        lines[n].replace(begin, length, std::string(length - text.size(), ' ') + text);
        continue;
      }
      std::size_t more = text.size() - length;
      while (more > 0 && begin > 1 && lines[n][begin - 1] == ' ' && lines[n][begin - 2] == ' ')
        --begin, --more;
      lines[n].replace(begin, pin.end - begin, text);
    }
  }
  std::string out;
  for (const auto& line : lines) out += line + "\n";
  return out;
}

}  // namespace moldloft::firmware_like
