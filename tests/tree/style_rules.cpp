// The rules of the tree about how a file reads: order of includes, remains of re-wrapped comments, length of functions.
#include "tree/rules.hpp"
#include "tree/source_text.hpp"

#include <algorithm>
#include <array>
#include <regex>

namespace moldloft::tree {
namespace {

constexpr int most_function_lines = 70;

// Functions that are longer than one should be. The list only gets shorter.
constexpr std::array long_functions = {
    std::string_view{"geometry/error.cpp to_string"},  // a table of names
    std::string_view{"geometry/fit/net_solver.cpp NetSolver::piece"},
    std::string_view{"geometry/fit/net_solver.cpp NetSolver::step_shots"},
    std::string_view{"geometry/inspection/least_distance.cpp least_distance"},
};

std::string at_line(std::string_view path, int line) {
  return std::string{path} + ":" + std::to_string(line) + ": ";
}

std::string_view stem_of(std::string_view path) {
  path = path.substr(path.rfind('/') + 1);
  return path.substr(0, path.find('.'));
}

// Own header, ours, libraries, the system's and the standard's.
int rank_of(const Include& include, std::string_view path) {
  static const std::regex standard{R"((sys|linux|netinet|arpa|net)/.*|[a-z0-9_]+(\.h)?)"};
  if (include.quoted) {
    const auto own = stem_of(include.name), file = stem_of(path);
    return own == file || file == std::string{own} + "_test" ? 0 : 1;
  }
  const bool a_library = include.name == "sqlite3.h" || include.name == "libserialport.h";
  return !a_library && std::regex_match(include.name, standard) ? 3 : 2;
}

// What a line of comment says; nothing where the line is none.
std::string_view comment_in(std::string_view line) {
  const auto at = line.find_first_not_of(" \t");
  if (at == line.npos || line.substr(at, 2) != "//") return {};
  if (line.substr(at).starts_with("// clang-format o")) return {};  // it is for a program
  return line.substr(at + 2);
}

int words_in(std::string_view text) {
  int words = 0;
  bool inside = false;
  for (const char c : text) {
    words += c != ' ' && !inside;
    inside = c != ' ';
  }
  return words;
}

std::size_t indent_of(std::string_view text) { return std::min(text.find_first_not_of(' '), text.size()); }

// "// Blocking     no": a line of a contract's table, which begins something, however short it is.
bool begins_an_entry(std::string_view comment) {
  static const std::regex entry{R"(^ +([-*]|[0-9]+[.)]|[^ ].*  ).*)"};
  return std::regex_match(comment.begin(), comment.end(), entry);
}

}  // namespace

Findings include_order_findings(std::string_view path, std::string_view text) {
  Findings findings;
  if (!is_source(path)) return findings;
  const auto lines = lines_of(text);
  int last_line = 0, last_rank = 0;
  for (const auto& include : includes_of(text)) {
    // Between two includes stands what needs them in this order, or nothing.
    const bool apart = std::any_of(
        lines.begin() + last_line, lines.begin() + include.line - 1,
        [](auto line) { return line.find_first_not_of(" \t\r") != line.npos && comment_in(line).empty(); });
    const int rank = rank_of(include, path);
    if (!apart && rank < last_rank)
      findings.push_back(
          at_line(path, include.line) + include.name +
          ": own header first, then ours, then libraries, then the standard's (clang-format -i)");
    last_rank = rank;
    last_line = include.line;
  }
  return findings;
}

Findings comment_findings(std::string_view path, std::string_view text) {
  Findings findings;
  if (!is_source(path)) return findings;
  std::string_view before;
  int number = 0;
  for (const auto line : lines_of(text)) {
    ++number;
    const auto comment = comment_in(line);
    const bool goes_on =
        !before.empty() && words_in(before) > 0 && indent_of(comment) <= indent_of(before) + 14;
    // Text that is set in by more than a blank, but not as far as an entry's, is an example.
    const bool example = indent_of(comment) >= 4 && indent_of(comment) < 10;
    if (goes_on && !example && !begins_an_entry(comment) && words_in(comment) > 0 && words_in(comment) <= 2)
      findings.push_back(at_line(path, number) + "'" + std::string{comment.substr(indent_of(comment))} +
                         "' is left over from re-wrapping: wrap the paragraph narrower");
    before = comment;
  }
  return findings;
}

Findings function_findings(std::string_view path, std::string_view text) {
  Findings findings;
  if (!is_source(path) || !is_room(first_folder(path))) return findings;
  static const std::regex name{R"(([\w:~]+)\()"};
  static const std::regex no_function{R"(^(namespace|struct|class|enum|union|extern)\b.*|.*= ?\{+$)"};
  int number = 0, begun = 0;
  std::string head;  // the lines since the last one that ended something
  const std::string code = code_only(text);
  for (const auto line : lines_of(code)) {
    ++number;
    if (begun == 0) {
      const bool blank = line.find_first_not_of(" \t\r") == line.npos;
      if (blank || line.ends_with(";") || line.starts_with("#") || line.starts_with("}")) {
        head.clear();
        continue;
      }
      head += line;
      if (!line.ends_with("{")) continue;
      if (std::regex_match(head, no_function))
        head.clear();
      else
        begun = number;
    } else if (line == "};") {  // it was a class
      begun = 0;
      head.clear();
    } else if (line == "}") {
      std::smatch found;
      const std::string called = std::regex_search(head, found, name) ? found.str(1) : head;
      const int length = number - begun + 1;
      const bool known =
          std::ranges::find(long_functions, std::string{path} + " " + called) != long_functions.end();
      if (length > most_function_lines && !known)
        findings.push_back(at_line(path, begun) + called + " has " + std::to_string(length) + " lines, " +
                           std::to_string(most_function_lines) + " is the most");
      if (length <= most_function_lines && known)
        findings.push_back(at_line(path, begun) + called +
                           " is short enough now: take it off the list of long ones");
      begun = 0;
      head.clear();
    }
  }
  return findings;
}

}  // namespace moldloft::tree
