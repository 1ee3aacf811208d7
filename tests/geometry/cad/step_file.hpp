// A STEP file taken apart: instances by their number, each a type and its parameters as text. For files of
// ours: one level of parentheses is enough to be told apart, complex instances keep theirs as one text.
#pragma once

#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace moldloft::test {

struct StepInstance {
  std::string type;                     // empty for a complex instance
  std::vector<std::string> parameters;  // of the outermost parentheses
};

// The parts of "(a,(b,c),'d,e')", split at the commas of the outermost level.
inline std::vector<std::string> step_items(std::string_view text) {
  std::vector<std::string> items;
  if (text.size() < 2 || text.front() != '(' || text.back() != ')') return items;
  int depth = 0;
  bool quoted = false;
  std::string item;
  for (const char c : text.substr(1, text.size() - 2)) {
    if (c == '\'') quoted = !quoted;
    if (!quoted && c == '(') ++depth;
    if (!quoted && c == ')') --depth;
    if (!quoted && depth == 0 && c == ',') {
      items.push_back(std::exchange(item, {}));
    } else {
      item += c;
    }
  }
  items.push_back(item);
  return items;
}

inline std::vector<double> step_numbers(std::string_view text) {
  std::vector<double> numbers;
  for (const auto& item : step_items(text)) numbers.push_back(std::strtod(item.c_str(), nullptr));
  return numbers;
}

class StepFile {
 public:
  explicit StepFile(const std::string& text) {
    std::string statement;
    bool quoted = false;
    for (const char c : text) {
      if (c == '\n') continue;
      if (c == '\'') quoted = !quoted;
      if (c == ';' && !quoted) {
        take(std::exchange(statement, {}));
      } else {
        statement += c;
      }
    }
  }

  const std::map<int, StepInstance>& instances() const { return instances_; }
  const std::vector<std::string>& others() const { return others_; }  // statements that are no instances

  const StepInstance& operator[](const std::string& ref) const {
    return instances_.at(std::stoi(ref.substr(1)));
  }
  std::vector<const StepInstance*> all(std::string_view type) const {
    std::vector<const StepInstance*> found;
    for (const auto& [id, instance] : instances_) {
      if (instance.type == type) found.push_back(&instance);
    }
    return found;
  }
  std::vector<double> point(const std::string& ref) const {
    return step_numbers((*this)[ref].parameters.at(1));
  }

 private:
  void take(const std::string& statement) {
    const auto equals = statement.find('=');
    if (statement.empty() || statement.front() != '#') {
      others_.push_back(statement);
      return;
    }
    const auto open = statement.find('(', equals);
    instances_[std::stoi(statement.substr(1, equals - 1))] = {
        statement.substr(equals + 1, open - equals - 1),
        step_items(std::string_view(statement).substr(open))};
  }

  std::map<int, StepInstance> instances_;
  std::vector<std::string> others_;
};

}  // namespace moldloft::test
