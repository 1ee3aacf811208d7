// The file that the flight recorder leaves: a header, events and transitions, each oldest first, as they lie in
// memory (little-endian, as both machines that we build for are). The version tells another layout.
//
// Thread       read_flight_dump(): any
// Blocking     it reads a file
// Allocation   it makes its result
// Failure      one line that names the file and what is wrong with it
#pragma once

#include "hal/record/run_record.hpp"

#include <array>
#include <cstdint>
#include <expected>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::hal {

enum class FlightKind : std::uint8_t {
  tick,        // at: woken; value: how late, ns
  task,        // at: its start; value: its cost, ns; id: the task
  background,  // the same for a step in the slack
  received,    // value: bytes; id: the link
  sent,
  missed,  // value: ticks; id: the task that made it late, 255: none
};

enum class FlightCause : std::uint8_t { none, overrun, missed_tick, abort, signal, request };

std::string_view to_string(FlightCause);

struct FlightEvent {
  std::int64_t at_ns = 0;
  std::uint32_t value = 0;  // what does not fit stands as the largest number
  FlightKind kind{};
  std::uint8_t id = 0;
  std::uint16_t reserved = 0;
};
static_assert(sizeof(FlightEvent) == 16);

struct FlightTransition {
  std::int64_t at_ns = 0;
  std::array<char, 16> source{};  // all texts end with zeros, or fill their field
  std::array<char, 24> event{}, from{}, to{};
};
static_assert(sizeof(FlightTransition) == 96);

inline constexpr std::size_t flight_names = 127;  // of tasks; 255 stands for none

struct FlightHeader {
  std::array<char, 8> magic{'M', 'L', 'F', 'L', 'I', 'G', 'H', 'T'};
  std::uint32_t version = 1;
  FlightCause cause{};
  std::uint8_t running_task = 255;  // when it was written, 255: none
  std::uint16_t signal = 0;
  std::int64_t triggered_ns = 0;
  std::uint64_t tick = 0;   // number of the tick that the trigger came in
  std::uint8_t task = 255;  // whom the trigger names
  std::array<std::uint8_t, 7> reserved{};
  std::uint32_t events = 0, transitions = 0;
  std::array<std::array<char, 24>, flight_names> names{};
};
static_assert(sizeof(FlightHeader) == 48 + 24 * flight_names);

struct FlightDump {
  FlightHeader header;
  std::vector<FlightEvent> events;
  std::vector<FlightTransition> transitions;
  std::string_view name_of(std::uint8_t task) const;
};

struct FlightDumpError {
  std::string what;
};

std::expected<FlightDump, FlightDumpError> read_flight_dump(const std::string& path);

template <std::size_t size>
std::string_view flight_text(const std::array<char, size>& text) {
  const std::string_view all{text.data(), size};
  return all.substr(0, all.find('\0'));
}

}  // namespace moldloft::hal
