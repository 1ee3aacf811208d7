#include "hal/record/flight_dump.hpp"

#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

#include <fstream>

namespace moldloft::hal {
namespace {

// No dump of ours is larger; a header that says more is not believed.
constexpr std::uint32_t most_entries = 1u << 24;

template <typename T>
bool read_into(std::ifstream& file, T* first, std::size_t count) {
  const auto bytes = static_cast<std::streamsize>(count * sizeof(T));
  return static_cast<bool>(file.read(reinterpret_cast<char*>(first), bytes));
}

// A file may hold anything, and these texts go to a terminal.
template <std::size_t size>
void make_printable_in_place(std::array<char, size>& text) {
  const auto fit = printable_text<size>(flight_text(text));
  text = {};
  fit.view().copy(text.data(), size);
}

}  // namespace

std::string_view to_string(FlightCause cause) {
  switch (cause) {
    case FlightCause::none:
      return "none";
    case FlightCause::overrun:
      return "overrun";
    case FlightCause::missed_tick:
      return "missed tick";
    case FlightCause::abort:
      return "abort";
    case FlightCause::signal:
      return "signal";
    case FlightCause::request:
      return "request";
  }
  return "unknown";
}

std::string_view FlightDump::name_of(std::uint8_t task) const {
  if (task >= flight_names) return "none";
  return flight_text(header.names[task]);
}

std::expected<FlightDump, FlightDumpError> read_flight_dump(const std::string& path) {
  const auto flaw = [&](std::string_view what) {
    return std::unexpected{FlightDumpError{fmt::format("{}: {}", path, what)}};
  };
  std::ifstream file{path, std::ios::binary};
  if (!file) return flaw("cannot be read");
  FlightDump dump;
  if (!read_into(file, &dump.header, 1) || dump.header.magic != FlightHeader{}.magic)
    return flaw("is not a flight recorder's dump");
  if (dump.header.version != FlightHeader{}.version)
    return flaw(fmt::format("was written in layout {}, this program reads {}", dump.header.version,
                            FlightHeader{}.version));
  if (dump.header.events > most_entries || dump.header.transitions > most_entries)
    return flaw("has a header that cannot be true; the file is damaged");
  dump.events.resize(dump.header.events);
  dump.transitions.resize(dump.header.transitions);
  if (!read_into(file, dump.events.data(), dump.events.size()) ||
      !read_into(file, dump.transitions.data(), dump.transitions.size()))
    return flaw("ends early; was the disk full?");
  for (auto& name : dump.header.names) make_printable_in_place(name);
  for (auto& t : dump.transitions) {
    make_printable_in_place(t.source);
    for (auto* text : {&t.event, &t.from, &t.to}) make_printable_in_place(*text);
  }
  return dump;
}

}  // namespace moldloft::hal
