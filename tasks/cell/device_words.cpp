#include "tasks/cell/device_words.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::tasks {

using namespace std::chrono_literals;

namespace {

// The library's starts_with() has a branch that throws.
bool begins_with(std::string_view text, std::string_view word) MOLDLOFT_NONBLOCKING {
  return text.size() >= word.size() && std::equal(word.begin(), word.end(), text.begin());
}

}  // namespace

hal::Message why_not_ready(std::string_view device, std::string_view why) {
  constexpr std::string_view article = "the ";
  const std::string_view named =
      begins_with(why, article) ? std::string_view{why.data() + article.size(), why.size() - article.size()}
                                : why;
  const bool names_it = begins_with(named, device);
  return names_it ? hal::Message{why} : hal::Message::format("{}: {}", device, why);
}

hal::Message waiting_for_scanner(std::string_view why, hal::Duration limit) {
  if (limit == hal::Duration::max())
    return hal::Message::format("{:.100}; waiting until it is back (stop ends the run)", why);
  return hal::Message::format("{:.100}; waiting {} s for it to come back (ctrl-C ends the run)", why,
                              limit / 1s);
}

std::optional<hal::Message> refuse_scanner(const hal::ScannerInfo& info, const CellSettings& settings) {
  constexpr double tolerance = 0.01;
  const double x = 2 * settings.tracker.field_half_x_mm, y = 2 * settings.tracker.field_half_y_mm;
  if (info.depth_mm < (1 - tolerance) * settings.depth_mm) {
    return hal::Message::format(
        "scanner measures {:.1f} mm to each side in height: correct [scanner] depth_mm = {:.1f}",
        info.depth_mm, settings.depth_mm);
  }
  if (std::abs(info.field_x_mm - x) <= tolerance * x && std::abs(info.field_y_mm - y) <= tolerance * y)
    return std::nullopt;
  return hal::Message::format(
      "scanner reports a field of {:.1f} x {:.1f} mm: correct [scanner] field_mm = [{:.1f}, {:.1f}]",
      info.field_x_mm, info.field_y_mm, x, y);
}

}  // namespace moldloft::tasks
