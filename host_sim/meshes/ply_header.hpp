// The head of a PLY file: its form, and the elements and properties that its body holds, in the file's own order.
//
// Keywords, types and names are taken in any case and come out in small letters. Lines end with LF, CRLF or
// CR. Comments and obj_info may stand anywhere.
#pragma once

#include "host_sim/base/sim_error.hpp"

#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::host_sim {

enum class PlyForm { ascii, binary_little_endian, binary_big_endian };
enum class PlyScalar { i8, u8, i16, u16, i32, u32, f32, f64 };

std::size_t bytes_of(PlyScalar);

struct PlyProperty {
  std::string name;
  PlyScalar type{};
  std::optional<PlyScalar> list_count;  // set when the property is a list: the type of its length
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;  // as announced: not yet believed
  std::vector<PlyProperty> properties;

  int scalar_named(std::string_view) const;  // its index, or -1
  int list_named(std::string_view) const;
};

struct PlyHeader {
  PlyForm form{};
  std::vector<PlyElement> elements;
  std::size_t body_byte = 0, body_line = 0;  // where the data begin
};

std::expected<PlyHeader, SimError> read_ply_header(const std::string& name, std::string_view bytes);

}  // namespace moldloft::host_sim
