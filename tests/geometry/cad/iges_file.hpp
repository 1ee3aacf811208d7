// An IGES file taken apart by the rules of the fixed format.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace moldloft::test {

struct IgesEntity {
  int type = 0, first_line = 0, lines = 0;
  std::string status;
  std::vector<std::string> parameters;  // from the entity's own number on
  double real(std::size_t i) const {
    std::string text = parameters.at(i);
    std::ranges::replace(text, 'D', 'E');
    return std::strtod(text.c_str(), nullptr);
  }
  int integer(std::size_t i) const { return std::stoi(parameters.at(i)); }
};

struct IgesFile {
  std::vector<std::string> lines;
  std::map<char, std::vector<std::string>> sections;  // columns 1 to 72
  std::map<int, IgesEntity> entities;                 // by their directory's number
  std::vector<std::string> global;

  explicit IgesFile(const std::string& text) {
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) {
      lines.push_back(line);
      if (line.size() == 80) sections[line[72]].push_back(line.substr(0, 72));
    }
    std::string about;
    for (const auto& line : sections['G']) about += line;
    global = fields(about);
    const auto& d = sections['D'];
    for (std::size_t i = 0; i + 1 < d.size(); i += 2) {
      const auto column = [&](std::size_t line, std::size_t c) { return d[line].substr(8 * (c - 1), 8); };
      IgesEntity e;
      e.type = std::stoi(column(i, 1));
      e.first_line = std::stoi(column(i, 2));
      e.status = column(i, 9);
      e.lines = std::stoi(column(i + 1, 4));
      std::string all;
      for (int l = 0; l < e.lines; ++l) all += sections['P'].at(e.first_line - 1 + l).substr(0, 64);
      e.parameters = fields(all);
      entities[static_cast<int>(i) + 1] = e;
    }
  }

  std::vector<const IgesEntity*> all(int type) const {
    std::vector<const IgesEntity*> found;
    for (const auto& [number, e] : entities) {
      if (e.type == type) found.push_back(&e);
    }
    return found;
  }

  // Split at commas up to the semicolon; "5Ha,b;c" is one field.
  static std::vector<std::string> fields(const std::string& text) {
    std::vector<std::string> all;
    std::string field;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == 'H' && !field.empty() && field.find_first_not_of("0123456789") == field.npos) {
        const std::size_t n = std::stoul(field);
        field += text.substr(i, n + 1);
        i += n;
      } else if (text[i] == ',' || text[i] == ';') {
        all.push_back(std::exchange(field, {}));
        if (text[i] == ';') break;
      } else if (text[i] != ' ') {
        field += text[i];
      }
    }
    return all;
  }
};

}  // namespace moldloft::test
