// PROTOCOLS.md against the code: every vector on that page decodes, and encodes again to the same bytes.
#include "hal/robot/robot_line.hpp"
#include "hal/scanner/psc1.hpp"

#include <doctest/doctest.h>

#include <charconv>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

using namespace moldloft::hal;
using namespace moldloft::hal::psc1;

namespace {

using Bytes = std::vector<std::byte>;
using Payload = std::span<const std::byte>;

// The fenced blocks of the page: what stands behind the fence, and the lines inside.
std::vector<std::pair<std::string, std::vector<std::string>>> fenced_blocks() {
  std::ifstream page{MOLDLOFT_SOURCE_DIR "/hal/PROTOCOLS.md"};
  REQUIRE(page);
  std::vector<std::pair<std::string, std::vector<std::string>>> blocks;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("```")) {
      inside = !inside;
      if (inside) blocks.emplace_back(line.substr(3), std::vector<std::string>{});
    } else if (inside) {
      blocks.back().second.push_back(line);
    }
  }
  REQUIRE_FALSE(inside);
  return blocks;
}

Bytes bytes_of(const std::vector<std::string>& lines) {
  Bytes bytes;
  for (const auto& line : lines) {
    std::istringstream words{line};
    for (std::string word; words >> word;) {
      unsigned value = 0;
      REQUIRE(word.size() == 2);
      REQUIRE(std::from_chars(word.data(), word.data() + 2, value, 16).ptr == word.data() + 2);
      bytes.push_back(static_cast<std::byte>(value));
    }
  }
  return bytes;
}

template <auto decode>
Bytes again(const Header& header, Payload payload) {
  const auto message = decode(payload);
  REQUIRE(message);
  Bytes out(512);
  out.resize(encode(header.request_id, *message, out));
  return out;
}

Bytes exposed_again(const Header& header, Payload payload) {
  const auto exposed = decode_exposed(payload);
  REQUIRE(exposed);
  CHECK(exposed->shot_id == 42);
  CHECK(exposed->session_id == 0x1A2B3C4D);
  Bytes out(512);
  out.resize(encode(header.request_id, *exposed, header.acquired_ns, out));
  return out;
}

Bytes frame_again(const Header& header, Payload payload) {
  const auto head = decode_frame_head(payload);
  REQUIRE(head);
  Frame frame{2, 5};
  REQUIRE(decode_frame(payload, frame));
  frame.exposed_sensor_ns = header.acquired_ns;
  CHECK(frame.exposed_sensor_ns == 1'234'567'890);
  CHECK(frame.stripes[1].index == 8);
  CHECK(frame.x[0] == doctest::Approx(-10.2).epsilon(1e-4));
  CHECK(frame.y[1] == doctest::Approx(-50.796).epsilon(1e-4));
  CHECK(frame.z[1] == doctest::Approx(1.25).epsilon(1e-3));
  CHECK(frame.z[3] == -40);
  CHECK(std::isnan(frame.x[2]));
  Bytes out(512);
  out.resize(encode_frame(header.request_id, frame, head->encoding, head->intensity, {51, 51, 40}, out));
  return out;
}

Bytes empty_again(const Header& header, Payload payload) {
  CHECK(payload.empty());
  Bytes out(header_size);
  CHECK(encode_empty(header.request_id, header.type, out) == header_size);
  return out;
}

struct Reading {
  Type type;
  Bytes (*again)(const Header&, Payload);
};

const std::map<std::string, Reading> readings = {
    {"hello-request", {Type::hello, again<decode_hello_request>}},
    {"hello-reply", {Type::hello, again<decode_hello_reply>}},
    {"config", {Type::config, again<decode_config>}},
    {"trigger", {Type::trigger, again<decode_trigger>}},
    {"exposed", {Type::exposed, exposed_again}},
    {"frame-int16", {Type::frame, frame_again}},
    {"frame-float32", {Type::frame, frame_again}},
    {"status-request", {Type::status, empty_again}},
    {"status-reply", {Type::status, again<decode_status>}},
    {"ping", {Type::ping, empty_again}},
    {"error", {Type::error, again<decode_error>}},
    {"reset", {Type::reset, empty_again}},
};

}  // namespace

TEST_CASE(
    "every PSC1 vector of PROTOCOLS.md decodes and encodes again to the same bytes, and no type is missing") {
  std::set<std::string> seen;
  for (const auto& [name, lines] : fenced_blocks()) {
    if (!name.starts_with("psc1 ")) continue;
    const std::string vector = name.substr(5);
    CAPTURE(vector);
    REQUIRE(readings.contains(vector));
    const auto& reading = readings.at(vector);
    const Bytes wire = bytes_of(lines);
    REQUIRE(wire.size() >= header_size);
    const auto header = decode_header(std::span{wire}.first<header_size>());
    REQUIRE(header);
    CHECK(header->type == reading.type);
    const std::size_t length = header->payload_length;
    REQUIRE(wire.size() == header_size + length + (length > 0 ? payload_crc_size : 0));
    const Payload payload = std::span{wire}.subspan(header_size, length);
    CHECK(reading.again(*header, payload) == wire);
    seen.insert(vector);
  }
  CHECK(seen.size() == readings.size());
}

TEST_CASE(
    "every robot line of PROTOCOLS.md, in the text as in the vectors, parses and formats to the same "
    "characters") {
  std::ifstream page{MOLDLOFT_SOURCE_DIR "/hal/PROTOCOLS.md"};
  REQUIRE(page);
  std::set<int> commands;
  std::set<std::string> replies;
  int lines = 0;
  const std::regex robot_line{R"(^ *([<>][0-9]{4} [A-Z]{3}.* \*[0-9]+)$)"};
  std::smatch match;
  for (std::string text; std::getline(page, text);) {
    if (!std::regex_match(text, match, robot_line)) continue;
    const std::string line = match[1];
    CAPTURE(line);
    ++lines;
    if (line.front() == '>') {
      const auto command = robot_line::parse_command(line);
      REQUIRE(command);
      CHECK(std::string{robot_line::format(*command).view()} == line + "\n");
      commands.insert(static_cast<int>(command->verb));
    } else {
      const auto reply = robot_line::parse_reply(line);
      REQUIRE(reply);
      CHECK(std::string{robot_line::format(*reply).view()} == line + "\n");
      replies.insert(line.substr(6, reply->verb == robot_line::Verb::nak ? 6 : 3));
    }
  }
  CHECK(lines > 25);
  CHECK(commands.size() == 7);
  CHECK(replies == std::set<std::string>{"ACK", "DON", "ERR", "EVT", "NAK CK", "NAK SQ", "NAK SY", "PNG",
                                         "POS", "STA", "STP", "SYN"});
}

TEST_CASE("every sum that PROTOCOLS.md gives in its tables is right") {
  std::ifstream page{MOLDLOFT_SOURCE_DIR "/hal/PROTOCOLS.md"};
  const std::regex row{R"(^\| `([^`]+)` \| ([0-9]+) \|$)"};
  std::smatch match;
  int rows = 0;
  for (std::string text; std::getline(page, text);) {
    if (!std::regex_match(text, match, row)) continue;
    CAPTURE(text);
    CHECK(robot_line::fletcher16(std::string{match[1]}) == std::stoul(match[2]));
    ++rows;
  }
  CHECK(rows == 5);
}
